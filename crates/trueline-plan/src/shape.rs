//! How the scan progresses along the seam.

/// The kind of path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// Once along the seam, weaving.
    S,
    /// Once along the seam in one bow.
    C,
    /// There and back.
    TwoPasses,
    /// There, back, and there again.
    ThreePasses,
    /// There, then back with the sensor spun by half a turn about its view: this shows a feature's bias with the tilt.
    Spun,
}

impl Shape {
    /// All shapes that do not spin the sensor.
    pub const ALL: [Self; 4] = [Self::S, Self::C, Self::TwoPasses, Self::ThreePasses];

    /// The name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::S => "s",
            Self::C => "c",
            Self::TwoPasses => "two-passes",
            Self::ThreePasses => "three-passes",
            Self::Spun => "spun",
        }
    }

    /// Place along the seam, −½ to ½, when a part (0 to 1) of the scan is done.
    #[must_use]
    pub fn progress(self, done: f64) -> f64 {
        let there_and_back = |passes: f64| -0.5 * (std::f64::consts::PI * passes * done).cos();
        match self {
            Self::S | Self::C => done - 0.5,
            Self::TwoPasses | Self::Spun => there_and_back(2.0),
            Self::ThreePasses => there_and_back(3.0),
        }
    }
}
