//! A profiler that is off its own calibration.

/// A profiler that reports something else than what is there.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SensorError {
    /// Too wide by this part.
    pub width: f64,
    /// Too deep by this part.
    pub depth: f64,
    /// Shifted along x by this part of the depth.
    pub shear: f64,
    /// Larger by this part for each metre of x and of depth.
    pub keystone_per_m: [f64; 2],
    /// How far the laser sheet bends out of its plane at ±30 mm, m.
    pub bow_m: f64,
}

/// Depth about which a sensor is off, m.
const MIDDLE_M: f64 = 0.16;

impl SensorError {
    /// Reported coordinates of a point, x and z in m.
    #[must_use]
    pub fn reported(&self, [x, z]: [f64; 2]) -> [f64; 2] {
        let deep = z - MIDDLE_M;
        let larger = 1.0 + self.keystone_per_m[0] * x + self.keystone_per_m[1] * deep;
        [(x * (1.0 + self.width) + self.shear * deep) * larger, MIDDLE_M + deep * (1.0 + self.depth) * larger]
    }

    /// How far the sheet is out of its plane at a place x, both m.
    #[must_use]
    pub fn out_of_plane_m(&self, x: f64) -> f64 {
        const REACH_M: f64 = 0.03;
        self.bow_m * (x / REACH_M).powi(2)
    }
}
