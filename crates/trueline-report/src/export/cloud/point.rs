//! Points of a cloud, and what takes them.

use std::io;

/// A point of a cloud.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CloudPoint {
    /// Where it is in base, m.
    pub in_base_m: [f64; 3],
    /// When it was exposed, by the robot's clock, ns.
    pub exposed_ns: i64,
    /// Brightness in the sensor's own unit.
    pub intensity: Option<f64>,
    /// Its ±, m.
    pub sigma_m: Option<f64>,
    /// Which frame.
    pub frame: u64,
}

/// What is written of each point beside its place and its time.
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
    /// What the operating system or the format's library says.
    fn take(&mut self, points: &[CloudPoint]) -> io::Result<()>;
}
