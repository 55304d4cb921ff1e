//! Points of a cloud, and their receivers.

use std::io;

/// A point of a cloud.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CloudPoint {
    /// Its place in base, m.
    pub in_base_m: [f64; 3],
    /// When it was exposed, by the robot's clock, ns.
    pub exposed_ns: i64,
    /// Brightness in the sensor's own unit.
    pub intensity: Option<f64>,
    /// Its ±, m.
    pub sigma_m: Option<f64>,
    /// The frame.
    pub frame: u64,
}

/// Columns of each point besides its place and its time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CloudColumns {
    /// Brightness.
    pub intensity: bool,
    /// The ±.
    pub sigma: bool,
    /// The frame's number.
    pub frame: bool,
}

/// Takes the points of a file.
pub trait CloudSink {
    /// The next points.
    ///
    /// # Errors
    /// Error of the operating system or of the format's library.
    fn take(&mut self, points: &[CloudPoint]) -> io::Result<()>;
}
