//! Something that swings over time.

/// One harmonic of a sweep.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Swing {
    /// Amplitude, in the unit of the swing.
    pub amplitude: f64,
    /// Frequency, Hz.
    pub frequency_hz: f64,
    /// Phase, rad.
    pub phase_rad: f64,
}

/// Something that swings about a mean over time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sweep {
    /// Mean, in the unit of the swing.
    pub mean: f64,
    /// Two harmonics: one alone leaves the distances between its turning points unused.
    pub swings: [Swing; 2],
}

impl Sweep {
    /// Value at a time, s.
    #[must_use]
    pub fn at(&self, time_s: f64) -> f64 {
        let swung = self.swings.iter().map(|swing| {
            swing.amplitude * (std::f64::consts::TAU * swing.frequency_hz * time_s + swing.phase_rad).sin()
        });
        self.mean + swung.sum::<f64>()
    }

    /// The same, slower by this factor.
    #[must_use]
    pub(crate) fn slowed(mut self, times: f64) -> Self {
        for swing in &mut self.swings {
            swing.frequency_hz /= times;
        }
        self
    }
}
