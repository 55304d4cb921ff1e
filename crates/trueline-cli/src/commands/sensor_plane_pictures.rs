//! `trueline sensor laser-plane` from pictures.

use crate::args::LaserPlaneArgs;
use crate::failure::Failure;
use crate::output;
use std::process::ExitCode;
use trueline_dataset::sensor_toml::{self, CameraFile, format_camera};
use trueline_report::{sensor_json, sensor_text};
use trueline_sensor::board_files::{pictures, sensor_file, striped};
use trueline_sensor::laser_plane::{BoardPicture, JointFit, PicturesFit, fit_pictures};
use trueline_sensor::verdict;

/// Runs the command.
pub(crate) fn run(args: &LaserPlaneArgs) -> Result<ExitCode, Failure> {
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
    let files = pictures::files(&args.input)?;
    let ground = (board, args.stripe_on);
    let mut found = striped::look(&files, args.without_laser.as_deref(), &camera, ground)?;
    let seen: Vec<BoardPicture> = found.iter().filter_map(|f| f.as_ref().ok().cloned()).collect();
    let PicturesFit { fit, pictures, .. } = fit_pictures(&striped::known(&camera), board, &seen)
        .map_err(|e| Failure::new(format!("{e}{}", striped::why_not(&files, &found)), e.hint()))?;
    striped::conclude(&mut found, pictures);
    conclude(args, &camera, &fit, &striped::why_not(&files, &found))
}

fn conclude(
    args: &LaserPlaneArgs,
    camera: &CameraFile,
    fit: &JointFit,
    missing: &str,
) -> Result<ExitCode, Failure> {
    let covariance = fit.covariance.fixed_view::<3, 3>(9, 9).into();
    let reasons = verdict::of_plane(&covariance, fit.middle_sigma_m());
    let warnings = verdict::stripes_left_out(fit);
    let remarks = (reasons.as_slice(), warnings.as_slice());
    let text = sensor_text::joint_plane(fit, remarks)
        .ok_or_else(|| Failure::new("no plane was found", "use more boards"))?;
    if let Some(out) = &args.out {
        output::file(out, &format_camera(&sensor_file::with_joint_plane(camera, fit)))?;
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
