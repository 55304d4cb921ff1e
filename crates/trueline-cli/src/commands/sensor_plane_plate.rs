//! `trueline sensor laser-plane --plate`.

use crate::args::LaserPlaneArgs;
use crate::failure::Failure;
use crate::output;
use std::process::ExitCode;
use trueline_dataset::calibration_file;
use trueline_dataset::sensor_toml::{self, format_camera};
use trueline_report::{sensor_json, sensor_text};
use trueline_sensor::board_files::{plate_stops, sensor_file, striped};
use trueline_sensor::laser_plane::plate::{PlateStop, fit_plate};
use trueline_sensor::verdict;

/// Runs the command.
pub(crate) fn run(args: &LaserPlaneArgs) -> Result<ExitCode, Failure> {
    let ([table], Some(sensor), Some(initial)) = (args.input.as_slice(), &args.sensor, &args.initial) else {
        return Err(Failure::new(
            "--plate takes one table of pictures and poses",
            "a CSV with the columns picture,x_mm,y_mm,z_mm,qw,qx,qy,qz, the pictures beside it",
        ));
    };
    let camera = sensor_toml::read_camera(sensor)?;
    let rough = calibration_file::read_guess(initial)?.tool_from_camera;
    let looked = plate_stops::look(table, &camera)?;
    let stops: Vec<PlateStop> = looked.iter().filter_map(|(_, stop)| stop.as_ref().ok().cloned()).collect();
    let names: Vec<&str> =
        looked.iter().filter(|(_, stop)| stop.is_ok()).map(|(name, _)| name.as_str()).collect();
    let fit = fit_plate(&striped::known(&camera), &rough, &stops)
        .map_err(|e| Failure::new(format!("{e}{}", plate_stops::why_not(&looked)), e.hint()))?;
    let (reasons, warnings) = verdict::of_plate(&fit);
    let remarks = (reasons.as_slice(), warnings.as_slice());
    if let Some(out) = &args.out {
        output::file(out, &format_camera(&sensor_file::with_plate_plane(&camera, &fit)))?;
    }
    if let Some(file) = &args.json {
        output::json(file, &format!("{:#}", sensor_json::plate_plane(&fit, &names, remarks)))?;
    }
    if !args.quiet {
        output::summary(args.json.as_deref(), &sensor_text::plate_plane(&fit, &names, remarks))?;
        let missing = plate_stops::why_not(&looked);
        if !missing.is_empty() {
            output::words(&format!("not used:{missing}"));
        }
    }
    Ok(if reasons.is_empty() { ExitCode::SUCCESS } else { ExitCode::from(1) })
}
