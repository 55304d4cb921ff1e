//! `trueline calibrate`.

use crate::args::CalibrateArgs;
use crate::failure::Failure;
use crate::hints;
use crate::opened_dataset::{self, OpenedDataset};
use crate::outlier_frames;
use crate::output;
use std::path::PathBuf;
use std::process::ExitCode;
use trueline_dataset::known_toml;
use trueline_dataset::sensor_setup::Mounted;
use trueline_method::hypotheses::choice::KnownOfCell;
use trueline_method::{Calibration, Config, Status, Use};
use trueline_report::calibration_page::{self, Source};
use trueline_report::{result, summary};

/// Runs the command.
pub fn run(args: &CalibrateArgs) -> Result<ExitCode, Failure> {
    let opened = opened_dataset::open_all(&args.datasets, args.joint, args.quiet)?;
    let recording = &opened.recording;
    let initial = match &args.initial {
        Some(file) => Some(known_toml::read_guess(file)?),
        None => recording.initial,
    };
    let calibration = trueline_method::calibrate(recording, initial.as_ref(), &config(args))?;
    write_results(args, &opened, &calibration)?;
    Ok(exit_code(&calibration))
}

fn names(datasets: &[PathBuf]) -> String {
    datasets.iter().map(|dataset| dataset.display().to_string()).collect::<Vec<_>>().join(", ")
}

/// 0 if accepted, else 1.
pub fn exit_code(calibration: &Calibration) -> ExitCode {
    match calibration.status() {
        Status::Accepted => ExitCode::SUCCESS,
        Status::NotAccepted => ExitCode::from(1),
    }
}

fn write_results(
    args: &CalibrateArgs,
    opened: &OpenedDataset,
    calibration: &Calibration,
) -> Result<(), Failure> {
    if let Some(file) = &args.json {
        let mut result = result::of(calibration);
        result.stamps.meaning = opened.stamp_meaning.clone();
        if opened.recording.setup.mounted == Mounted::Fixed {
            result.mounted = Some("fixed".to_owned());
        }
        output::result(file, &result)?;
    }
    let source = Source {
        calibration,
        recording: &opened.recording,
        title: &format!("Calibration of {}", names(&args.datasets)),
        command: &output::command_line(),
        frames: &match args.report {
            Some(_) => outlier_frames::pictures(opened, calibration)?,
            None => Vec::new(),
        },
    };
    if let Some(file) = &args.report {
        output::file(file, &calibration_page::html(&source))?;
    }
    #[cfg(feature = "rerun")]
    if let Some(file) = &args.rerun {
        trueline_report::rerun_recording::write(file, &source).map_err(|error| {
            Failure::new(
                format!("{}: cannot be written: {error}", file.display()),
                "check the path and its permissions",
            )
        })?;
    }
    if !args.quiet {
        output::summary(args.json.as_deref(), &summary::text(calibration))?;
        hints::of(calibration).iter().for_each(|hint| output::words(&format!("hint: {hint}")));
    }
    Ok(())
}

fn config(args: &CalibrateArgs) -> Config {
    let defaults = Config::default();
    Config {
        residual: args.residual,
        loss: args.loss,
        hold: args.fix.clone(),
        feature_sigma_px: args.feature_sigma_px.unwrap_or(defaults.feature_sigma_px),
        feature_sigma_m: args.feature_sigma_mm.map_or(defaults.feature_sigma_m, |mm| mm * 1e-3),
        robot_sigma_m: args.robot_sigma_mm.map(|mm| mm * 1e-3),
        stamp_sigma_s: args.stamp_sigma_ms.map(|ms| ms * 1e-3),
        stamps: args.stamps,
        accept_partial: args.accept_partial,
        require: args.require.unwrap_or_default(),
        known: KnownOfCell { offset_within_s: args.offset_within, looks: args.looks },
        used_at: Use {
            speed_m_s: args.speed_mm_s * 1e-3,
            stand_off_m: args.stand_off_mm.map(|mm| mm * 1e-3),
        },
        threads: args.threads.get(),
        ..defaults
    }
}
