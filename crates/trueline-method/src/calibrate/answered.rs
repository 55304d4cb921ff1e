//! An answer as the unknowns of the findings: with what it says of the sensor.

use crate::assess::corrected_sensor::CorrectedSensor;
use crate::assess::file_frame::{FileFrame, HandEyeOfFile, StatedSensor};
use crate::assess::observability::Observability;
use crate::assess::sensor_shape::SensorShape;
use crate::calibrate::concluded::Concluded;
use crate::findings::Unknowns;
use crate::problem::parameters::{LINES, Parameters, ROTATION};
use nalgebra::DMatrix;

/// What is said of the sensor, beside the cause that explains its residuals.
pub(crate) fn beside_cause(from: &Concluded<'_>, unknowns: &Unknowns) -> Option<SensorShape> {
    let Unknowns { parameters, covariance, .. } = unknowns;
    unknowns.sensor.map(|shape| shape.beside(from.cause.as_ref(), parameters, covariance))
}

/// An answer without what it says of the sensor.
pub(crate) struct Answered {
    /// Where it is.
    pub parameters: Parameters,
    /// Covariance of the tangent by everything.
    pub covariance: DMatrix<f64>,
    /// The part of it that is noise.
    pub noise_covariance: DMatrix<f64>,
    /// What of it is seen.
    pub observability: Observability,
}

/// With what it says of the sensor; the transform is that of the stated file.
pub(crate) fn with_sensor(from: &Concluded<'_>, answered: Answered) -> Unknowns {
    let Answered { parameters, covariance, noise_covariance, observability } = answered;
    let observations = &from.assessed.drift_free.observations;
    let shows_hand_eye = observability.shows_hand_eye();
    // A transform that is held is what the user stated of his file.
    let is_held = from.settings.fixed.iter().any(|k| (ROTATION..LINES).contains(k));
    let stated = StatedSensor::of(observations, &parameters).filter(|_| shows_hand_eye && !is_held);
    let frame = stated.as_ref().map_or_else(FileFrame::of_estimate, |stated| stated.frame);
    Unknowns {
        estimated: (0..parameters.dimension()).map(|k| !from.settings.fixed.contains(&k)).collect(),
        sensor: SensorShape::of(from.recording, &parameters, &covariance, from.knowledge),
        corrected: CorrectedSensor::of(from.recording, observations, &parameters, &covariance)
            .filter(|_| shows_hand_eye),
        stated,
        written: None,
        of_file: HandEyeOfFile::of(frame, &parameters, &covariance, &noise_covariance),
        parameters,
        covariance,
        noise_covariance,
        observability,
        held_at_guess: false,
        has_time_offset: !from.settings.config.at_stops,
    }
}
