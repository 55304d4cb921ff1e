//! `trueline sensor laser-plane`.

use crate::args::LaserPlaneArgs;
use crate::commands::{sensor_plane_pictures, sensor_plane_plate};
use crate::failure::Failure;
use crate::output;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use trueline_dataset::dialect::plain_file;
use trueline_dataset::{gray_picture, sensor_toml, stripe_points_csv};
use trueline_report::{sensor_json, sensor_text};
use trueline_sensor::board_files::sensor_file;
use trueline_sensor::laser_plane::{PlaneFit, fit_points, jackknife};
use trueline_sensor::verdict;

/// Runs the command.
pub(crate) fn run(args: &LaserPlaneArgs) -> Result<ExitCode, Failure> {
    let inputs: Vec<&Path> =
        args.input.iter().chain(&args.sensor).chain(&args.initial).map(PathBuf::as_path).collect();
    output::expect_files(&inputs, &[args.json.as_deref()])?;
    output::expect_new(args.out.as_deref(), &[args.json.as_deref()])?;
    if args.plate {
        return sensor_plane_plate::run(args);
    }
    match args.input.as_slice() {
        [file] if file.is_file() && !gray_picture::is_picture(file) => {
            if args.board.is_some() {
                return Err(Failure::new(
                    "--board belongs to pictures, not to a table of points",
                    "leave --board out, or name a folder of pictures",
                ));
            }
            from_points(file, args)
        }
        _ => sensor_plane_pictures::run(args),
    }
}

fn from_points(file: &Path, args: &LaserPlaneArgs) -> Result<ExitCode, Failure> {
    let table = stripe_points_csv::read(file, &plain_file(file)?)?;
    let names: Vec<u64> = table.keys().copied().collect();
    let boards: Vec<_> = table.into_values().collect();
    let fit = fit_points(&boards).map_err(|e| Failure::new(format!("{}: {e}", file.display()), e.hint()))?;
    let by_jackknife = jackknife(&boards, &fit.plane);
    let (reasons, warnings) = verdict::of_points(&fit);
    let remarks = (reasons.as_slice(), warnings.as_slice());
    if let Some(out) = &args.out {
        output::file(out, &sensor_text_of(args.sensor.as_deref(), &fit)?)?;
    } else if args.sensor.is_some() {
        return Err(Failure::new(
            "--sensor is the camera that --out is written with; points need none",
            "add --out FILE, or leave --sensor out",
        ));
    }
    if let Some(json) = &args.json {
        output::json(json, &format!("{:#}", sensor_json::plane(&fit, by_jackknife, &names, remarks)))?;
    }
    if !args.quiet {
        output::summary(args.json.as_deref(), &sensor_text::points_plane(&fit, remarks))?;
    }
    Ok(if reasons.is_empty() { ExitCode::SUCCESS } else { ExitCode::from(1) })
}

/// The sensor's file: with the camera of `sensor`, or for a sensor that measures points.
fn sensor_text_of(sensor: Option<&Path>, fit: &PlaneFit) -> Result<String, Failure> {
    Ok(match sensor {
        None => sensor_toml::format_file(&sensor_file::of_points(fit)),
        Some(file) => {
            let camera = sensor_toml::read_camera(file)?;
            sensor_toml::format_camera(&sensor_file::with_plane(camera, fit))
        }
    })
}
