//! Calibrates with a corrected lens if the residuals contradict the stated one.
//!
//! [`crate::assess::misfit_cause`] finds k1 and k2 as a linear pattern in the residuals. The scan is recalibrated with the found lens until the
//! pattern vanishes. The answer stays that of the stated sensor, which every user of the answer has. The corrected sensor file has the lens.

use crate::assess::cause_kind::CauseKind;
use crate::assess::lens::{self, LensCorrection};
use crate::assess::misfit_cause::MisfitCause;
use crate::calibration::Calibration;
use crate::error::Error;
use crate::models::{Because, beside};
use crate::verdict;
use trueline_dataset::{Guess, Recording, Sensor};

/// Rounds. Each reduces the error to about a tenth.
const ROUNDS: usize = 4;
/// A number that moves by less than this fraction of its uncertainty has converged.
const SETTLED: f64 = 0.3;
/// Adds the lens correction to a calibration, or returns it unchanged if there is none. `calibrate` calibrates a recording from a guess.
///
/// # Errors
/// Those of `calibrate`.
pub(crate) fn corrected(
    mut first: Calibration,
    recording: &Recording,
    calibrate: impl Fn(&Recording, &Guess) -> Result<Calibration, Error>,
) -> Result<Calibration, Error> {
    let Some(mut step) = first.findings.checks.cause.as_ref().and_then(of_cause) else { return Ok(first) };
    let mut found = LensCorrection { distortion: [0.0; 2], ..step };
    for _ in 0..ROUNDS {
        (0..2).for_each(|k| found.distortion[k] += step.distortion[k]);
        let mut with_lens = recording.clone();
        let Sensor::CameraLaser { camera, .. } = &mut with_lens.sensor else { return Ok(first) };
        *camera = lens::with(camera, found.distortion);
        let at = first.best_fit();
        let guess = Guess { time_offset_s: at.time_offset_s, tool_from_camera: at.tool_from_camera };
        let again = calibrate(&with_lens, &guess)?;
        first.findings.models_tried.extend(beside(&again.findings.models_tried, Because::ResidualsShowLens));
        first.findings.unknowns.corrected = again.findings.unknowns.corrected.clone().map(|mut corrected| {
            let from_other = first.best_fit().tool_from_camera.inverse() * again.best_fit().tool_from_camera;
            corrected.frame.camera_from_file = from_other * corrected.frame.camera_from_file;
            corrected
        });
        let Some(next) = again.findings.checks.cause.as_ref().and_then(of_cause) else { break };
        step = next;
        if (0..2).all(|k| step.distortion[k].abs() <= SETTLED * step.sigma[k]) {
            break;
        }
    }
    first.findings.checks.lens = Some(found);
    first.verdict = verdict::of(&first.findings);
    Ok(first)
}

fn of_cause(cause: &MisfitCause) -> Option<LensCorrection> {
    let [(k1, sigma_k1), (k2, sigma_k2)] = cause.numbers.as_slice() else { return None };
    (cause.kind == CauseKind::Lens)
        .then_some(LensCorrection { distortion: [*k1, *k2], sigma: [*sigma_k1, *sigma_k2] })
}
