//! Converts an answer into the unknowns of the findings, with the estimated sensor shape.

use crate::assess::corrected_sensor::CorrectedSensor;
use crate::assess::file_frame::{FileFrame, HandEyeOfFile, StatedSensor};
use crate::assess::observability::Observability;
use crate::assess::robot_field::OfRobot;
use crate::assess::sensor_shape::SensorShape;
use crate::calibrate::concluded::Concluded;
use crate::findings::Unknowns;
use crate::problem::parameters::{LINES, Parameters, ROTATION};
use nalgebra::DMatrix;

/// The estimated sensor shape beside the cause that explains the residuals.
pub(crate) fn beside_cause(from: &Concluded<'_>, unknowns: &Unknowns) -> Option<SensorShape> {
    let Unknowns { parameters, covariance, .. } = unknowns;
    unknowns.sensor.map(|shape| shape.beside(from.cause.as_ref(), parameters, covariance))
}

/// An answer without its sensor shape.
pub(crate) struct Answered {
    /// The unknowns.
    pub parameters: Parameters,
    /// Total covariance of the tangent.
    pub covariance: DMatrix<f64>,
    /// Its random part.
    pub noise_covariance: DMatrix<f64>,
    /// Its observability.
    pub observability: Observability,
    /// The part of the robot's errors in it; `None` of an ideal robot.
    pub of_robot: Option<OfRobot>,
}

/// Adds the sensor shape. The transform belongs to the stated sensor file.
pub(crate) fn with_sensor(from: &Concluded<'_>, answered: Answered) -> Unknowns {
    let Answered { parameters, covariance, noise_covariance, observability, of_robot } = answered;
    let observations = &from.assessed.drift_free.observations;
    let shows_hand_eye = observability.shows_hand_eye();
    // A held transform belongs to the sensor file that the user stated.
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
        of_robot,
        held_at_guess: false,
        has_time_offset: !from.settings.config.at_stops,
    }
}
