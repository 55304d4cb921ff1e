//! `trueline sensor intrinsics`.

use crate::args::IntrinsicsArgs;
use crate::failure::Failure;
use crate::output;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use trueline_dataset::sensor_toml::format_camera;
use trueline_report::sensor_json::{self, CameraReport};
use trueline_report::{sensor_page, sensor_text};
use trueline_sensor::board_files::pictures::{self, Looked};
use trueline_sensor::board_files::sensor_file;
use trueline_sensor::intrinsics::{Sensitivity, cross_validation, fit, next_picture};
use trueline_sensor::{View, verdict};

/// Runs the command.
pub(crate) fn run(args: &IntrinsicsArgs) -> Result<ExitCode, Failure> {
    let inputs: Vec<&Path> = args.pictures.iter().map(PathBuf::as_path).collect();
    output::expect_files(&inputs, &[args.json.as_deref(), args.report.as_deref()])?;
    output::expect_new(args.out.as_deref(), &[args.json.as_deref(), args.report.as_deref()])?;
    let files = pictures::files(&args.pictures)?;
    let looked = pictures::look(&files, &args.board)?;
    let views: Vec<View> = looked.iter().filter_map(|l| l.view.as_ref().ok().cloned()).collect();
    let size = looked.first().map_or([0, 0], |l| l.size_px);
    let fitted = fit(size, &args.board, &views, args.distortion)
        .map_err(|error| Failure::new(format!("{error}{}", pictures::why_not(&looked)), error.hint()))?;
    let halves = cross_validation::halves(size, &args.board, &views, fitted.model);
    let uncertainty = Sensitivity::of(&fitted.state.camera).uncertainty(&fitted.covariance);
    let next = next_picture::best(&fitted, &args.board);
    let (reasons, mut warnings) = verdict::of_camera(&fitted, halves.as_ref());
    warnings.extend(verdict::never_whole(&views, &args.board));
    let report = CameraReport {
        fit: &fitted,
        uncertainty: &uncertainty,
        halves: halves.as_ref(),
        next: next.as_ref(),
        reasons: &reasons,
        warnings: &warnings,
        files: looked.iter().map(Looked::stated).collect(),
    };
    if let Some(out) = &args.out {
        output::file(out, &format_camera(&sensor_file::of_camera(&fitted)))?;
    }
    if let Some(file) = &args.json {
        output::json(file, &format!("{:#}", sensor_json::camera(&report)))?;
    }
    if let Some(file) = &args.report {
        output::file(file, &sensor_page::html(&report, &views, &output::command_line()))?;
    }
    if !args.quiet {
        output::summary(args.json.as_deref(), &sensor_text::camera(&report))?;
    }
    Ok(if reasons.is_empty() { ExitCode::SUCCESS } else { ExitCode::from(1) })
}
