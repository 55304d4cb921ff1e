//! Outcome of calibrating a recording, and criteria of a good one.

use crate::diagnose::quick_fit::{LEAST_EXPLAINED, QuickFit};
use crate::{Calibration, Error, Reason};

/// Outcome of calibrating a recording.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// Noise factor. `None` if there is no result at all.
    pub noise_factor: Option<f64>,
    /// Share of inliers among the features.
    pub explained: f64,
    /// Reasons against acceptance, or for the missing result. Empty if it was accepted.
    pub said: Vec<String>,
    /// Whether the scan contradicts the sensor's own calibration.
    pub sensor_is_off: bool,
}

/// Noise factor up to which the geometry is correct.
const FITS: f64 = 5.0;
/// Noise factor up to which residuals are noise. Sensors differ more from their expected noise only if somebody stated another one.
const NOISE: f64 = 1.2;
/// A mistake explains a bad fit if undoing it reduces the residuals to this fraction …
const EXPLAINS: f64 = 0.2;
/// … or a doubtful fit, with residuals that are merely large, if it reduces them to this fraction. With 1500 features, a fifth less is a likelihood
/// ratio of e³³⁵ and no chance.
const EXPLAINS_DOUBT: f64 = 0.8;
/// … or a fit with residuals of noise and an apparent sensor error, if they are no larger and the sensor is then correct.
const EXPLAINS_SENSOR: f64 = 1.0;

impl Outcome {
    /// From a calibration.
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

    /// From a quick fit.
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

    /// Whether the geometry is correct: the residuals are noise and most features are inliers. Unobservable directions do not matter here.
    #[must_use]
    pub fn fits(&self) -> bool {
        self.noise_factor.is_some_and(|factor| factor < FITS) && self.explained > 0.5
    }

    /// Residuals in units of noise, increased if fewer features are explained.
    pub(super) fn left(&self) -> Option<f64> {
        Some(self.noise_factor? / self.explained.max(LEAST_EXPLAINED))
    }

    /// Whether the residuals are pure noise, so that no mistake is searched.
    pub(super) fn is_noise(&self) -> bool {
        self.fits() && self.noise_factor.is_some_and(|factor| factor < NOISE)
    }

    /// Largest fraction of the recorded residuals that may remain after undoing the explaining mistake.
    pub(super) fn explained_below(&self) -> f64 {
        match (self.fits(), self.is_noise()) {
            (false, _) => EXPLAINS,
            (true, false) => EXPLAINS_DOUBT,
            (true, true) => EXPLAINS_SENSOR,
        }
    }
}
