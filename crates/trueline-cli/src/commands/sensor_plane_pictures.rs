//! `trueline sensor laser-plane` from pictures.

use crate::args::LaserPlaneArgs;
use crate::board_pictures;

use crate::failure::Failure;
use crate::output;
use nalgebra::SMatrix;
use rayon::prelude::*;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use trueline_dataset::sensor_setup::{SensorCovariance, SensorSetup};
use trueline_dataset::sensor_toml::{self, CameraFile, format_camera};
use trueline_report::{sensor_json, sensor_text};
use trueline_sensor::laser_plane::{JointFit, KnownCamera, StripedView, fit_joint, striped_picture};
use trueline_sensor::{Board, verdict};

/// What one picture gave.
type Found = Result<StripedView, striped_picture::NoStripe>;

/// Runs the command.
pub fn run(args: &LaserPlaneArgs) -> Result<ExitCode, Failure> {
    let Some(board) = &args.board else {
        return Err(Failure::new(
            "pictures need --board",
            "--board chessboard:COLUMNSxROWS:SQUARE_MM, or give a CSV of points: board,x_mm,y_mm,z_mm",
        ));
    };
    let Some(sensor) = &args.sensor else {
        return Err(Failure::new(
            "pictures need the camera: --sensor FILE",
            "`trueline sensor intrinsics PICTURES --board … --out camera.toml` writes one",
        ));
    };
    let camera = sensor_toml::read_camera(sensor)?;
    let known = known(&camera);
    let files = board_pictures::files(&args.input)?;
    let found: Vec<Found> = files
        .par_iter()
        .map(|file| look(file, args.without_laser.as_deref(), &camera, board))
        .collect::<Result<_, Failure>>()?;
    let views: Vec<StripedView> = found.iter().filter_map(|f| f.as_ref().ok().cloned()).collect();
    let fit = fit_joint(&known, board, &views)
        .map_err(|e| Failure::new(format!("{e}{}", missing(&files, &found)), e.hint()))?;
    conclude(args, &camera, &fit, &missing(&files, &found))
}

/// The camera as its file knows it.
pub fn known(file: &CameraFile) -> KnownCamera {
    let stated = file.setup.uncertainty.as_ref().and_then(|u| u.covariance.as_ref());
    KnownCamera {
        camera: file.camera,
        covariance: stated.map_or_else(SMatrix::zeros, SensorCovariance::of_camera),
    }
}

fn look(file: &Path, without: Option<&Path>, camera: &CameraFile, board: &Board) -> Result<Found, Failure> {
    let (lit, _) = board_pictures::read(file)?;
    if [lit.width() as u32, lit.height() as u32] != camera.camera.size {
        return Err(Failure::new(
            format!(
                "{}: {} x {} pixels, unlike the camera's file",
                file.display(),
                lit.width(),
                lit.height()
            ),
            "is this the camera of --sensor, at the same setting?",
        ));
    }
    let dark = match (without, file.file_name()) {
        (Some(folder), Some(name)) => Some(board_pictures::read(&folder.join(name))?.0),
        _ => None,
    };
    Ok(striped_picture::look(&lit, dark.as_ref(), &camera.camera, board))
}

fn missing(files: &[PathBuf], found: &[Found]) -> String {
    let reasons = files
        .iter()
        .zip(found)
        .filter_map(|(file, found)| found.as_ref().err().map(|why| format!("\n  {}: {why}", file.display())));
    reasons.collect()
}

fn conclude(
    args: &LaserPlaneArgs,
    camera: &CameraFile,
    fit: &JointFit,
    missing: &str,
) -> Result<ExitCode, Failure> {
    let covariance = fit.covariance.fixed_view::<3, 3>(9, 9).into();
    let reasons = verdict::of_plane(&covariance, fit.middle_sigma_m());
    let remarks = (reasons.as_slice(), [].as_slice());
    let text = sensor_text::joint_plane(fit, remarks)
        .ok_or_else(|| Failure::new("no plane was found", "use more boards"))?;
    if let Some(out) = &args.out {
        output::file(out, &format_camera(&written(camera, fit)))?;
    }
    if let (Some(file), Some(json)) = (&args.json, sensor_json::joint_plane(fit, remarks)) {
        output::json(file, &format!("{json:#}"))?;
    }
    if !args.quiet {
        output::summary(args.json.as_deref(), &text)?;
        if !missing.is_empty() {
            output::words(&format!("not used:{missing}"));
        }
    }
    Ok(if reasons.is_empty() { ExitCode::SUCCESS } else { ExitCode::from(1) })
}

/// The sensor's file with camera, plane and their joint covariance.
fn written(before: &CameraFile, fit: &JointFit) -> CameraFile {
    let stated = before.setup.uncertainty.clone().unwrap_or_default();
    let uncertainty = stated.with_joint(SensorCovariance::of_free(&fit.covariance));
    CameraFile {
        camera: fit.state.camera,
        laser_plane_in_camera: fit.plane(),
        setup: SensorSetup { uncertainty: Some(uncertainty), ..before.setup.clone() },
    }
}
