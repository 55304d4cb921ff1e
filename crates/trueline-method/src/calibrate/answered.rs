//! Takes an answer into the findings: its unknowns with the estimated sensor shape, and the errors that follow from them.

use crate::assess::corrected_sensor::CorrectedSensor;
use crate::assess::file_frame::{FileFrame, HandEyeOfFile, StatedSensor};
use crate::assess::observability::Observability;
use crate::assess::robot_field::OfRobot;
use crate::assess::seam_error::SeamError;
use crate::assess::seam_point_error;
use crate::assess::sensor_shape::SensorShape;
use crate::calibrate::concluded::Concluded;
use crate::findings::{Findings, Unknowns};
use crate::hypotheses::clock_drift::DriftFree;
use crate::problem::parameters::{LINES, Parameters, ROTATION};
use nalgebra::DMatrix;

/// The estimated sensor shape beside the cause that explains the residuals.
pub(crate) fn beside_cause(from: &Concluded<'_>, unknowns: &Unknowns) -> Option<SensorShape> {
    let Unknowns { parameters, covariance, .. } = unknowns;
    unknowns.sensor.map(|shape| shape.beside(from.cause.as_ref(), parameters, covariance))
}

/// Takes an adjusted answer, of whichever measurements, with the predicted error of a later seam point.
pub(crate) fn take(
    from: &Concluded<'_>,
    findings: &mut Findings,
    answered: Answered,
    seam_error: Option<SeamError>,
) {
    let DriftFree { fit, observations, .. } = &from.assessed.drift_free;
    let (list, used_at) = (fit.placed.of(observations), &from.settings.config.used_at);
    let Answered { parameters, covariance, .. } = &answered;
    let torch = || seam_point_error::predict(observations, list, parameters, covariance, used_at);
    let shows_all = answered.observability.shows_all();
    findings.checks.seam_point_error = shows_all.then(torch).flatten();
    findings.checks.seam_error = seam_error.filter(|_| shows_all);
    findings.unknowns = with_sensor(from, answered);
    findings.unknowns.sensor = beside_cause(from, &findings.unknowns);
    if !findings.unknowns.sensor.is_some_and(|shape| shape.is_off()) {
        findings.checks.confounded_causes.clear();
    }
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
