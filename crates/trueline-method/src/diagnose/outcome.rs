//! How a recording calibrates, and when that is well.

use crate::diagnose::quick_fit::{LEAST_EXPLAINED, QuickFit};
use crate::{Calibration, Error, Reason};

/// How a recording calibrates.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// How much larger the residuals are than noise explains; `None` if there is no result at all.
    pub noise_factor: Option<f64>,
    /// Share of inliers among the features.
    pub explained: f64,
    /// Why it was not accepted, or why there is no result; empty if it was.
    pub said: Vec<String>,
    /// Whether the scan contradicts the sensor's own calibration.
    pub sensor_is_off: bool,
}

/// Residuals up to this many times the expected noise are of the right geometry.
const FITS: f64 = 5.0;
/// Residuals up to this many times the expected noise are noise: sensors differ more than this from what was
/// expected of them only if somebody stated another noise.
const NOISE: f64 = 1.2;
/// A mistake explains a bad fit if undoing it makes residuals so much smaller …
const EXPLAINS: f64 = 0.2;
/// … or a doubtful one, of residuals that are merely large, if it makes them so much smaller. Of 1500 features,
/// a fifth less is a likelihood e³³⁵ times larger: no accident.
const EXPLAINS_DOUBT: f64 = 0.8;
/// … or, of residuals that are noise while the sensor's own calibration seems off, if they are no larger: it must then leave
/// a sensor that is right.
const EXPLAINS_SENSOR: f64 = 1.0;

impl Outcome {
    /// Of a calibration.
    pub(super) fn of(result: &Result<Calibration, Error>) -> Self {
        match result {
            Ok(c) => Self {
                noise_factor: Some(c.findings.fit.noise_factor),
                explained: c.findings.fit.residuals.inlier_share(),
                said: c.reasons().iter().map(ToString::to_string).collect(),
                sensor_is_off: c.reasons().iter().any(|reason| matches!(reason, Reason::SensorOff { .. })),
            },
            Err(error) => Self { said: vec![error.to_string()], ..Self::nothing() },
        }
    }

    /// Of a quick fit.
    pub(super) fn quick(fit: Result<QuickFit, Error>) -> Self {
        match fit {
            Ok(fit) => {
                Self { noise_factor: Some(fit.noise_factor), explained: fit.explained, ..Self::nothing() }
            }
            Err(error) => Self::of(&Err(error)),
        }
    }

    fn nothing() -> Self {
        Self { noise_factor: None, explained: 0.0, said: Vec::new(), sensor_is_off: false }
    }

    /// Whether the geometry is right: residuals are noise and most features belong. What cannot be seen for
    /// want of motion is another matter.
    #[must_use]
    pub fn fits(&self) -> bool {
        self.noise_factor.is_some_and(|factor| factor < FITS) && self.explained > 0.5
    }

    /// Residuals in units of noise, increased if fewer features are explained.
    pub(super) fn left(&self) -> Option<f64> {
        Some(self.noise_factor? / self.explained.max(LEAST_EXPLAINED))
    }

    /// Whether nothing but noise is left, so that no mistake need be looked for.
    pub(super) fn is_noise(&self) -> bool {
        self.fits() && self.noise_factor.is_some_and(|factor| factor < NOISE)
    }

    /// Largest share of the recorded residuals that may remain once the explaining mistake is undone.
    pub(super) fn explained_below(&self) -> f64 {
        match (self.fits(), self.is_noise()) {
            (false, _) => EXPLAINS,
            (true, false) => EXPLAINS_DOUBT,
            (true, true) => EXPLAINS_SENSOR,
        }
    }
}
