//! `trueline sensor laser-plane` from pictures.

use crate::args::LaserPlaneArgs;
use crate::board_pictures;
use crate::commands::sensor_laser_plane::plane_numbers;

use crate::failure::Failure;
use crate::output;
use nalgebra::{DMatrix, SMatrix};
use rayon::prelude::*;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use trueline_dataset::sensor_setup::{SensorParameter, SensorSetup};
use trueline_dataset::sensor_toml::{self, CameraFile, format_camera};
use trueline_dataset::unit::MM_PER_M;
use trueline_report::{sensor_json, sensor_text};
use trueline_sensor::laser_plane::next_board;
use trueline_sensor::laser_plane::{JointFit, KnownCamera, StripedView, fit_joint, joint, stripe};
use trueline_sensor::{Board, Gray, chessboard, verdict};

/// What one picture gave.
type Found = Result<StripedView, String>;

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
    let mut covariance = SMatrix::<f64, 9, 9>::zeros();
    let Some(stated) = stated else { return KnownCamera { camera: file.camera, covariance } };
    let place = |p: SensorParameter| SensorParameter::ALL.iter().position(|q| *q == p).filter(|k| *k < 9);
    for (i, a) in stated.order.iter().enumerate() {
        for (j, b) in stated.order.iter().enumerate() {
            if let (Some(row), Some(column)) = (place(*a), place(*b)) {
                covariance[(row, column)] = stated.matrix[(i, j)];
            }
        }
    }
    KnownCamera { camera: file.camera, covariance }
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
    Ok(striped(&lit, dark.as_ref(), camera, board))
}

fn striped(lit: &Gray, dark: Option<&Gray>, camera: &CameraFile, board: &Board) -> Found {
    let view = chessboard::find(dark.unwrap_or(lit), board).map_err(|why| why.to_string())?;
    let pose = joint::pose_of(&camera.camera, board, &view).ok_or("the board's pose cannot be found")?;
    let outline = joint::outline(&camera.camera, board, &pose);
    let shown = match dark {
        Some(dark) => lit.less(dark).ok_or("the picture without laser has another size")?,
        None => lit.clone(),
    };
    let stripe = stripe::find(&shown, &camera.camera, &outline);
    if stripe.is_empty() {
        Err("no stripe on the board".to_owned())
    } else {
        Ok(StripedView { view, stripe })
    }
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
    let plane = fit.plane().ok_or_else(|| Failure::new("no plane was found", "use more boards"))?;
    let covariance = fit.covariance.fixed_view::<3, 3>(9, 9).into();
    let reasons = verdict::of_plane(&covariance, fit.middle_sigma_m());
    let remarks = (reasons.as_slice(), [].as_slice());
    if let Some(out) = &args.out {
        output::file(out, &format_camera(&written(camera, fit)))?;
    }
    if let (Some(file), Some(json)) = (&args.json, sensor_json::joint_plane(fit, remarks)) {
        output::json(file, &format!("{json:#}"))?;
    }
    if !args.quiet {
        let mut facts = vec![
            ("boards", format!("{}", fit.points.len())),
            (
                "stripe",
                format!("{:.3} px across, corners {:.3} px", fit.stripe_sigma_px, fit.corner_sigma_px),
            ),
            ("points", format!("{:.4} mm rms from the plane", fit.rms_m * MM_PER_M)),
            ("boards are flat to", format!("{:.4} mm", fit.flatness_m * MM_PER_M)),
            (
                "offset, middle",
                format!("± {:.4} mm in the middle of the points", fit.middle_sigma_m() * MM_PER_M),
            ),
        ];
        facts.extend(next_board::best(fit).map(|next| ("board to add", sensor_text::next_board(&next))));
        let text = sensor_text::plane(&plane, &covariance, &facts, remarks);
        output::summary(args.json.as_deref(), &text)?;
        if !missing.is_empty() {
            output::words(&format!("not used:{missing}"));
        }
    }
    Ok(if reasons.is_empty() { ExitCode::SUCCESS } else { ExitCode::from(1) })
}

/// The sensor's file with camera, plane and their joint covariance.
fn written(before: &CameraFile, fit: &JointFit) -> CameraFile {
    let free: Vec<usize> =
        (0..SensorParameter::ALL.len()).filter(|k| fit.covariance[(*k, *k)] > 0.0).collect();
    let order: Vec<SensorParameter> = free.iter().map(|k| SensorParameter::ALL[*k]).collect();
    let matrix = DMatrix::from_fn(free.len(), free.len(), |i, j| fit.covariance[(free[i], free[j])]);
    let stated = before.setup.uncertainty.clone().unwrap_or_default();
    let uncertainty = plane_numbers(stated.focal, stated.principal_point_px, (order, matrix));
    CameraFile {
        camera: fit.state.camera,
        laser_plane_in_camera: fit.plane(),
        setup: SensorSetup { uncertainty: Some(uncertainty), ..before.setup.clone() },
    }
}
