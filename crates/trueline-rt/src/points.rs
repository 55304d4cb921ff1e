//! The points of a frame.

/// Points of one frame, as the sensor reports them.
#[derive(Clone, Copy, Debug)]
pub enum Points<'a> {
    /// (x along the stripe, z range) of a profiler, m.
    Profile(&'a [[f64; 2]]),
    /// Distorted pixels (u, v).
    Pixels(&'a [[f64; 2]]),
    /// Points in the camera frame, m.
    Camera(&'a [[f64; 3]]),
}

impl Points<'_> {
    /// How many.
    #[must_use]
    pub fn len(&self) -> usize {
        match self {
            Self::Profile(points) | Self::Pixels(points) => points.len(),
            Self::Camera(points) => points.len(),
        }
    }

    /// Whether it is empty.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}
