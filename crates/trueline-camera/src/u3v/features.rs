//! The features of a USB3 Vision camera.

use super::link::Link;
use crate::error::CameraError;
use crate::genicam::{Features, Refusal, RefusedBy};
use telegenic::genicam::port::PortIo;
use telegenic::genicam::{Genicam, NodeId, parse_xml};
use telegenic::{CameraError as Driver, GenicamError};
use viva_u3v::UsbTransfer;

/// The features of a device by its description.
pub(super) struct UsbFeatures<T: UsbTransfer + 'static> {
    graph: Genicam,
    /// The device.
    pub link: Link<T>,
}

impl<T: UsbTransfer + 'static> UsbFeatures<T> {
    /// By a description.
    ///
    /// # Errors
    /// An invalid description.
    pub(super) fn new(description: &str, link: Link<T>) -> Result<Self, CameraError> {
        let graph = parse_xml(description).map_err(|error| Refusal::of("device description", &error))?;
        Ok(Self { graph, link })
    }

    fn with<A>(
        &mut self,
        name: &str,
        act: impl FnOnce(&mut Genicam, NodeId, &dyn PortIo) -> Result<A, GenicamError>,
    ) -> Result<A, Refusal> {
        let found = self.graph.lookup(name);
        found.and_then(|id| act(&mut self.graph, id, &self.link)).map_err(|error| refusal(name, &error))
    }
}

/// An error of the device itself is reported without the driver's words.
fn refusal(name: &str, error: &GenicamError) -> Refusal {
    match error {
        GenicamError::Camera(Driver::Protocol(why)) => Refusal {
            error: Box::new(CameraError::Feature { name: name.to_owned(), why: why.clone() }),
            by: RefusedBy::Camera,
        },
        error => Refusal::of(name, error),
    }
}

impl<T: UsbTransfer + 'static> Features for UsbFeatures<T> {
    fn has_feature(&self, name: &str) -> bool {
        self.graph.lookup(name).is_ok()
    }

    fn get_integer(&mut self, name: &str) -> Result<i64, Refusal> {
        self.with(name, Genicam::int_value)
    }

    fn set_integer(&mut self, name: &str, value: i64) -> Result<(), Refusal> {
        self.with(name, |graph, id, port| graph.set_int_value(id, value, port))
    }

    fn integer_bounds(&mut self, name: &str) -> Result<(i64, i64), Refusal> {
        self.with(name, Genicam::int_bounds)
    }

    fn integer_increment(&mut self, name: &str) -> Result<i64, Refusal> {
        self.with(name, Genicam::int_increment)
    }

    fn get_float(&mut self, name: &str) -> Result<f64, Refusal> {
        self.with(name, Genicam::float_value)
    }

    fn set_float(&mut self, name: &str, value: f64) -> Result<(), Refusal> {
        self.with(name, |graph, id, port| graph.set_float_value(id, value, port))
    }

    fn float_bounds(&mut self, name: &str) -> Result<(f64, f64), Refusal> {
        self.with(name, Genicam::float_bounds)
    }

    fn get_boolean(&mut self, name: &str) -> Result<bool, Refusal> {
        self.with(name, Genicam::bool_value)
    }

    fn set_boolean(&mut self, name: &str, value: bool) -> Result<(), Refusal> {
        self.with(name, |graph, id, port| graph.set_bool_value(id, value, port))
    }

    fn get_enum(&mut self, name: &str) -> Result<String, Refusal> {
        self.with(name, Genicam::string_value)
    }

    fn set_enum(&mut self, name: &str, entry: &str) -> Result<(), Refusal> {
        self.with(name, |graph, id, port| graph.set_enum_entry(id, entry, port))
    }

    fn enum_entries(&mut self, name: &str) -> Result<Vec<String>, Refusal> {
        self.with(name, |graph, id, _| graph.enum_entries(id))
    }

    fn execute(&mut self, name: &str) -> Result<(), Refusal> {
        self.with(name, Genicam::execute)
    }

    fn forget(&mut self) -> Result<(), Refusal> {
        self.graph.invalidate_caches();
        Ok(())
    }
}
