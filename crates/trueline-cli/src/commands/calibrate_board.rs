//! `trueline calibrate --target board`: the reference with a board that the moving robot looks at.

use crate::failure::Failure;
use crate::output;
use std::collections::BTreeMap;
use std::process::ExitCode;
use trueline_args::{CalibrateArgs, TargetName};
use trueline_board::{BoardError, moving_scan};
use trueline_report::board_result::{self, BoardReport};
use trueline_sensor::{Board, verdict};

/// Runs the command.
pub(crate) fn run(args: &CalibrateArgs, board: &Board) -> Result<ExitCode, Failure> {
    if args.target != TargetName::Board {
        return Err(Failure::new(
            "--board belongs to --target board",
            "add --target board, or leave --board out",
        ));
    }
    #[cfg(feature = "rerun")]
    if args.rerun.is_some() {
        return Err(Failure::new("--target board writes no recording for Rerun", "leave --rerun out"));
    }
    let [dataset] = args.datasets.as_slice() else {
        return Err(Failure::new(
            "--target board takes one dataset",
            "calibrate one scan of the board at a time",
        ));
    };
    let scan = moving_scan::calibrate(dataset, board)?;
    let (reasons, warnings) = verdict::of_board(&scan.fit, &scan.covariance);
    let report = BoardReport {
        fit: &scan.fit,
        covariance: scan.covariance,
        reasons: &reasons,
        warnings: &warnings,
        corner_sigma_px: scan.corner_sigma_px,
        robot_noise_m: scan.robot_noise_m,
        skipped: &scan.skipped,
        inputs: &BTreeMap::from([("robot.csv".to_owned(), scan.robot_sha256.clone())]),
    };
    if let Some(file) = &args.json {
        output::result(file, &board_result::of(&report))?;
    }
    if !args.quiet {
        output::summary(args.json.as_deref(), &board_result::text(&report))?;
    }
    Ok(if reasons.is_empty() { ExitCode::SUCCESS } else { ExitCode::from(1) })
}

impl From<BoardError> for Failure {
    fn from(error: BoardError) -> Self {
        Self::new(error.to_string(), error.hint())
    }
}
