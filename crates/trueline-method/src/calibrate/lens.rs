//! A calibration whose residuals are those of another lens than the file states.
//!
//! k1 and k2 are found as a pattern in the residuals, by [`crate::assess::misfit_cause`], which is linear; so the scan is calibrated
//! again with the lens that was found, until nothing is left of the pattern. The answer stays that of the stated sensor, which
//! everything that uses the answer has; the corrected sensor's file has the lens.

use crate::assess::cause_kind::CauseKind;
use crate::assess::lens::{self, LensCorrection};
use crate::assess::misfit_cause::MisfitCause;
use crate::calibration::Calibration;
use crate::error::Error;
use crate::models::{Because, beside};
use crate::verdict;
use trueline_dataset::{Guess, Recording, Sensor};

/// Rounds; each leaves about a tenth of the error of the one before.
const ROUNDS: usize = 4;
/// A number that moves by less than this part of its ± is settled.
const SETTLED: f64 = 0.3;
/// A calibration with what is found of the lens, `calibrate` being how a recording is calibrated from a guess; as it was where
/// nothing is found.
///
/// # Errors
/// As `calibrate`.
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
