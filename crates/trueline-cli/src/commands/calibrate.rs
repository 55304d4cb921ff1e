//! `trueline calibrate`.

use super::features;
use crate::args::{AxisName, CalibrateArgs, FixName, LossName, ResidualName, StampsName};
use crate::failure::Failure;
use crate::hints;
use crate::opened_dataset::{self, OpenedDataset};
use crate::outlier_frames;
use crate::output;
use crate::requirement;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use trueline_dataset::sensor_setup::Mounted;
use trueline_dataset::{Error, Guess, Problem, known_toml};
use trueline_lsq::Loss;
use trueline_method::hypotheses::choice::{KnownOfCell, ToolAxis};
use trueline_method::{Calibration, Config, Hold, ResidualKind, Stamps, Status, Use};
use trueline_report::calibration_page::{self, Source};
use trueline_report::{result, summary};

/// Runs the command.
pub fn run(args: &CalibrateArgs) -> Result<ExitCode, Failure> {
    let config = config(args)?;
    let opened = opened_dataset::open_all(&args.datasets, features::joint(args.joint), args.quiet)?;
    let recording = &opened.recording;
    let initial = match &args.initial {
        Some(file) => Some(read_guess(file)?),
        None => recording.initial,
    };
    let calibration = trueline_method::calibrate(recording, initial.as_ref(), &config)?;
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

fn config(args: &CalibrateArgs) -> Result<Config, Failure> {
    let defaults = Config::default();
    Ok(Config {
        residual: match args.residual {
            ResidualName::Sheet => ResidualKind::Sheet,
            ResidualName::PointToLine => ResidualKind::PointToLine,
        },
        loss: args.loss.map(loss),
        hold: args.fix.iter().map(|fix| hold(*fix)).collect(),
        feature_sigma_px: positive("--feature-sigma-px", args.feature_sigma_px)?
            .unwrap_or(defaults.feature_sigma_px),
        feature_sigma_m: positive("--feature-sigma-mm", args.feature_sigma_mm)?
            .map_or(defaults.feature_sigma_m, |mm| mm * 1e-3),
        robot_sigma_m: positive("--robot-sigma-mm", args.robot_sigma_mm)?.map(|mm| mm * 1e-3),
        stamp_sigma_s: positive("--stamp-sigma-ms", args.stamp_sigma_ms)?.map(|ms| ms * 1e-3),
        stamps: match args.stamps {
            StampsName::Auto => Stamps::Auto,
            StampsName::Raw => Stamps::Raw,
            StampsName::Regular => Stamps::Regular,
        },
        accept_partial: args.accept_partial,
        require: args
            .require
            .as_deref()
            .map(|text| requirement::parse("--require", text))
            .transpose()?
            .unwrap_or_default(),
        known: KnownOfCell {
            offset_within_s: positive("--offset-within", args.offset_within)?,
            looks: args.looks.map(axis),
        },
        used_at: Use {
            speed_m_s: speed_mm_s(args.speed_mm_s)? * 1e-3,
            stand_off_m: positive("--stand-off-mm", args.stand_off_mm)?.map(|mm| mm * 1e-3),
        },
        threads: args.threads.get(),
        ..defaults
    })
}

/// A speed; standing still is one.
fn speed_mm_s(speed: f64) -> Result<f64, Failure> {
    if speed >= 0.0 && speed.is_finite() {
        return Ok(speed);
    }
    Err(Failure::new(
        format!("`--speed-mm-s`: expected a number of at least zero, found {speed}"),
        "leave it out for the default",
    ))
}

fn positive(option: &str, value: Option<f64>) -> Result<Option<f64>, Failure> {
    match value {
        Some(x) if !(x > 0.0 && x.is_finite()) => Err(Failure::new(
            format!("`{option}`: expected a number above zero, found {x}"),
            "leave it out for the default",
        )),
        _ => Ok(value),
    }
}

fn loss(name: LossName) -> Loss {
    match name {
        LossName::Squared => Loss::Squared,
        LossName::Huber => Loss::Huber { scale: 3.0 },
        LossName::Cauchy => Loss::Cauchy { scale: 3.0 },
        LossName::GemanMcClure => Loss::GemanMcClure { scale: 4.0 },
        LossName::Tukey => Loss::Tukey { scale: 8.0 },
    }
}

fn axis(name: AxisName) -> ToolAxis {
    match name {
        AxisName::PlusX => ToolAxis::PlusX,
        AxisName::MinusX => ToolAxis::MinusX,
        AxisName::PlusY => ToolAxis::PlusY,
        AxisName::MinusY => ToolAxis::MinusY,
        AxisName::PlusZ => ToolAxis::PlusZ,
        AxisName::MinusZ => ToolAxis::MinusZ,
    }
}

fn hold(name: FixName) -> Hold {
    match name {
        FixName::TimeOffset => Hold::TimeOffset,
        FixName::HandEye => Hold::HandEye,
    }
}

fn read_guess(file: &Path) -> Result<Guess, Failure> {
    let text = std::fs::read_to_string(file).map_err(|error| {
        let missing = error.kind() == std::io::ErrorKind::NotFound;
        Error::in_file(file, if missing { Problem::Missing } else { Problem::Io(error) })
    })?;
    Ok(known_toml::parse_guess(file, &text)?)
}
