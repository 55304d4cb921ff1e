//! The calibrations that are compared.

use crate::block_by_block::TimeJacobian;
use crate::convergence::{blocks, papers_start};
use crate::published::{TIME_OFFSET_ERROR_S, TRANSLATION_ERROR_M};
use crate::settings::Settings;
use nalgebra::Vector3;
use trueline_dataset::Guess;
use trueline_method::{Config, Error, Hold, ResidualKind, calibrate};
use trueline_sim::{Scenario, simulate};

/// A calibration and how it came about.
#[derive(Clone, Debug)]
pub struct Calibrated {
    /// What was done.
    pub name: &'static str,
    /// Time offset and hand-eye.
    pub result: Guess,
}

/// Every way to calibrate, over the same simulated scan.
///
/// # Errors
/// What calibrating says.
pub fn all(settings: &Settings, scenario: &Scenario, seed: u64) -> Result<Vec<Calibrated>, Error> {
    let recording = simulate(scenario, seed).ok_or(Error::NoStart)?;
    let truth = recording.truth.as_ref().ok_or(Error::NoStart)?.parameters;
    let joint = |residual: ResidualKind, guess: Option<&Guess>, hold: &[Hold]| -> Result<Guess, Error> {
        let config = Config { residual, hold: hold.to_vec(), ..Config::default() };
        let calibration = calibrate(&recording, guess, &config)?;
        let found = calibration.best_fit();
        Ok(Guess { time_offset_s: found.time_offset_s, tool_from_camera: found.tool_from_camera })
    };
    let without_offset = |of: Guess| Guess { time_offset_s: 0.0, ..of };
    let start = papers_start(&truth);
    let sheet = joint(ResidualKind::Sheet, None, &[])?;
    let point_to_line = joint(ResidualKind::PointToLine, Some(&start), &[])?;
    let held = joint(ResidualKind::Sheet, Some(&start), &[Hold::TimeOffset])?;
    let walked = |rule| -> Result<Option<Guess>, Error> {
        let track = blocks(&recording, &start, rule, settings.iterations)?;
        let last = track.steps.last();
        Ok(last.map(|s| Guess { time_offset_s: s.time_offset_s, tool_from_camera: s.tool_from_camera }))
    };
    let mut all = vec![
        Calibrated { name: "trueline (joint, sheet residual, no guess)", result: sheet },
        Calibrated { name: "joint, the paper's residual", result: point_to_line },
        Calibrated {
            name: "errors as large as the paper's: 0.20 mm, 1 ms",
            result: as_wrong_as_the_paper(&truth, seed),
        },
        Calibrated { name: "trueline, its time offset left out", result: without_offset(sheet) },
        Calibrated {
            name: "joint, the paper's residual, its time offset left out",
            result: without_offset(point_to_line),
        },
        Calibrated { name: "no temporal calibration at all: offset held at 0", result: held },
    ];
    let corrected = walked(TimeJacobian::Corrected)?;
    let published = walked(TimeJacobian::Published)?;
    all.extend(corrected.map(|result| Calibrated { name: "block by block, signs corrected", result }));
    all.extend(published.map(|result| Calibrated { name: "block by block, as published", result }));
    Ok(all)
}

/// The truth with a hand-eye translation and an offset as far off as the paper says that its own may be, the
/// translation in a direction that depends on the seed.
fn as_wrong_as_the_paper(truth: &Guess, seed: u64) -> Guess {
    // Directions spread evenly over the sphere by the golden angle.
    let turn = 2.399_963 * seed as f64;
    let height = 1.0 - 2.0 * ((seed as f64 * 0.618_034).fract());
    let across = (1.0 - height * height).sqrt();
    let direction = Vector3::new(across * turn.cos(), across * turn.sin(), height);
    let mut wrong = *truth;
    wrong.tool_from_camera.translation.vector += direction * TRANSLATION_ERROR_M;
    wrong.time_offset_s += if seed.is_multiple_of(2) { TIME_OFFSET_ERROR_S } else { -TIME_OFFSET_ERROR_S };
    wrong
}
