//! LAS 1.4: coordinates to 1 µm, the time as GPS time of the exposure (s, of the robot's clock), intensity to whole numbers.

use super::point::{CloudColumns, CloudPoint, CloudSink};
use las::point::Format;
use las::{Builder, Point, Transform, Vector, Version, Writer};
use std::fs::File;
use std::io::{self, BufWriter};

/// Smallest step of a coordinate, m: 32 bits of it reach 2 km.
const STEP_M: f64 = 1e-6;
/// Nanoseconds in a second.
const NS_PER_S: f64 = 1e9;
/// Point format with a time.
const POINT_FORMAT: u8 = 6;

struct Sink {
    writer: Writer<BufWriter<File>>,
}

impl CloudSink for Sink {
    fn take(&mut self, points: &[CloudPoint]) -> io::Result<()> {
        for point in points {
            let [x, y, z] = point.in_base_m;
            let intensity = point.intensity.unwrap_or(0.0).round().clamp(0.0, f64::from(u16::MAX)) as u16;
            self.writer
                .write_point(Point {
                    x,
                    y,
                    z,
                    intensity,
                    gps_time: Some(point.exposed_ns as f64 / NS_PER_S),
                    return_number: 1,
                    number_of_returns: 1,
                    ..Point::default()
                })
                .map_err(io::Error::other)?;
        }
        Ok(())
    }
}

pub(super) fn write<E: From<io::Error>>(
    file: &File,
    _: CloudColumns,
    fill: &mut dyn FnMut(&mut dyn CloudSink) -> Result<(), E>,
) -> Result<(), E> {
    let axis = Transform { scale: STEP_M, offset: 0.0 };
    let mut builder = Builder::default();
    builder.point_format = Format::new(POINT_FORMAT).map_err(io::Error::other)?;
    builder.version = Version::new(1, 4);
    builder.transforms = Vector { x: axis, y: axis, z: axis };
    builder.generating_software = concat!("trueline ", env!("CARGO_PKG_VERSION")).to_owned();
    // The same recording gives the same bytes.
    builder.date = None;
    let header = builder.into_header().map_err(io::Error::other)?;
    let writer = Writer::new(BufWriter::new(file.try_clone()?), header).map_err(io::Error::other)?;
    let mut sink = Sink { writer };
    fill(&mut sink)?;
    sink.writer.close().map_err(|error| io::Error::other(error).into())
}
