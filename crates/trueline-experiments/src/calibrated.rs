//! The calibrations that are compared.

use crate::block_by_block::TimeJacobian;
use crate::convergence::{blocks, papers_start};
use crate::published::{TIME_OFFSET_ERROR_S, TRANSLATION_ERROR_M};
use crate::settings::Settings;
use crate::static_board;
use nalgebra::Vector3;
use trueline_dataset::Guess;
use trueline_method::{Config, Error, Hold, ResidualKind, calibrate};
use trueline_sim::{Scenario, simulate};

/// A calibration and how it came about.
#[derive(Clone, Debug)]
pub struct Calibrated {
    /// The method.
    pub name: &'static str,
    /// Remark on it; empty for most.
    pub remark: String,
    /// Time to record its data, s; `None` if it needs no recording.
    pub takes_s: Option<f64>,
    /// Time offset and hand-eye.
    pub result: Guess,
}

/// Every way to calibrate, over the same simulated scan.
///
/// # Errors
/// Error of a calibration.
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
    let scan_s = scenario.timing.duration_s;
    let row = |name, result| Calibrated { name, remark: String::new(), takes_s: Some(scan_s), result };
    let mut all = vec![
        row("trueline (joint, sheet residual, no guess)", sheet),
        row("joint, the paper's residual", point_to_line),
        Calibrated {
            takes_s: None,
            ..row("errors as large as the paper's: 0.20 mm, 1 ms", as_wrong_as_the_paper(&truth, seed))
        },
        row("trueline, its time offset left out", without_offset(sheet)),
        row("joint, the paper's residual, its time offset left out", without_offset(point_to_line)),
        row("no temporal calibration at all: offset held at 0", held),
    ];
    let remark =
        format!("the public program's way, stopped after {} steps, begun 3.7 mm off", settings.iterations);
    let corrected = walked(TimeJacobian::Corrected)?;
    let published = walked(TimeJacobian::Published)?;
    let blocks =
        [("block by block, signs corrected", corrected), ("block by block, as published", published)];
    all.extend(
        blocks
            .into_iter()
            .filter_map(|(name, result)| Some(Calibrated { remark: remark.clone(), ..row(name, result?) })),
    );
    all.extend(static_board(scenario, &truth, seed).into_iter().flatten());
    Ok(all)
}

/// The static checkerboard at rest and in motion: it shows no time offset.
fn static_board(scenario: &Scenario, truth: &Guess, seed: u64) -> Option<[Calibrated; 2]> {
    let plan = static_board::PLANS[1];
    let tool_from_camera = static_board::calibrated(scenario, plan, seed)?;
    let row = |name, remark: &str, time_offset_s| Calibrated {
        name,
        remark: format!("{} stops; {remark}", plan.stops),
        takes_s: Some(plan.lasts_s()),
        result: Guess { time_offset_s, tool_from_camera },
    };
    Some([
        row(
            "static checkerboard, points measured at standstill",
            "a stand-in for [34], which cannot be identified",
            truth.time_offset_s,
        ),
        row("static checkerboard, on the moving robot", "it shows no time offset", 0.0),
    ])
}

/// The truth with the hand-eye translation and the offset wrong by the amounts that the paper states for its own; the
/// direction of the translation depends on the seed.
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
