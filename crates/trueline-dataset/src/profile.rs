//! A laser profile: the points of one stripe in the profiler's own frame.

/// One point of a profile.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProfilePoint {
    /// Position along the stripe, m.
    pub x_m: f64,
    /// Range, m.
    pub z_m: f64,
    /// Brightness in the sensor's own unit, where recorded.
    pub intensity: Option<f64>,
}

/// The points of one stripe, at one stamp. Columns without a return are not there.
#[derive(Clone, Debug, PartialEq)]
pub struct Profile {
    /// Stamp on arrival, ns.
    pub stamp_ns: i64,
    /// Frame counter, where recorded.
    pub frame: Option<u64>,
    /// The points, as the file has them.
    pub points: Vec<ProfilePoint>,
}
