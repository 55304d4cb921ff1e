//! `trueline sensor laser-plane`.

use crate::args::LaserPlaneArgs;
use crate::commands::sensor_plane_pictures;
use crate::failure::Failure;
use crate::output;
use nalgebra::{DMatrix, Matrix3, Vector3};
use std::path::Path;
use std::process::ExitCode;
use trueline_dataset::sensor_setup::{SensorCovariance, SensorParameter, SensorSetup, SensorUncertainty};
use trueline_dataset::sensor_toml::{self, CameraFile, SensorFile};
use trueline_dataset::unit::MM_PER_M;
use trueline_dataset::{Sensor, gray_picture, stripe_points_csv};
use trueline_report::{sensor_json, sensor_text};
use trueline_sensor::laser_plane::{DOUBTFUL, PlaneFit, fit_points, jackknife};
use trueline_sensor::verdict::{self, Remark};

/// Runs the command.
pub fn run(args: &LaserPlaneArgs) -> Result<ExitCode, Failure> {
    if let Some(out) = &args.out {
        output::must_not_exist(out)?;
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
    let bytes = gray_picture::bytes(file)?;
    let table = stripe_points_csv::read(file, bytes.as_slice())?;
    let names: Vec<u64> = table.keys().copied().collect();
    let boards: Vec<Vec<Vector3<f64>>> = table.into_values().collect();
    let fit = fit_points(&boards).map_err(|e| Failure::new(format!("{}: {e}", file.display()), e.hint()))?;
    let by_jackknife = jackknife(&boards, &fit.plane);
    let reasons = verdict::of_plane(&fit.covariance, fit.middle_sigma_m);
    let warnings = doubtful(&fit);
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
        let text = sensor_text::plane(&fit.plane, &fit.covariance, &facts(&fit), remarks);
        output::summary(args.json.as_deref(), &text)?;
    }
    Ok(if reasons.is_empty() { ExitCode::SUCCESS } else { ExitCode::from(1) })
}

fn doubtful(fit: &PlaneFit) -> Vec<Remark> {
    let worst = |z: [f64; 2]| if z[0].abs() > z[1].abs() { z[0] } else { z[1] };
    let boards = fit.boards.iter().enumerate().map(|(index, board)| (index, worst(board.z)));
    boards.filter(|(_, z)| z.abs() > DOUBTFUL).map(|(index, z)| Remark::BoardDoubtful { index, z }).collect()
}

fn facts(fit: &PlaneFit) -> Vec<(&'static str, String)> {
    let m = fit.middle * MM_PER_M;
    vec![
        (
            "offset, middle",
            format!(
                "± {:.4} mm at [{:.1}, {:.1}, {:.1}] mm, the middle of the points",
                fit.middle_sigma_m * MM_PER_M,
                m.x,
                m.y,
                m.z
            ),
        ),
        ("boards", format!("{}", fit.boards.len())),
        (
            "boards differ by",
            format!(
                "{:.4} mm in offset, {:.4} degrees in slope",
                fit.offset_spread_m * MM_PER_M,
                fit.slope_spread_rad.to_degrees()
            ),
        ),
        ("points", format!("{:.4} mm rms from the plane", fit.rms_m * MM_PER_M)),
    ]
}

/// The sensor's file: with the camera of `sensor`, or for a sensor that measures points.
fn sensor_text_of(sensor: Option<&Path>, fit: &PlaneFit) -> Result<String, Failure> {
    let Some(file) = sensor else {
        let uncertainty = with_plane(SensorUncertainty::default(), &fit.covariance);
        let sensor = Sensor::Points { laser_plane_in_camera: Some(fit.plane) };
        let setup = SensorSetup { uncertainty: Some(uncertainty), ..SensorSetup::default() };
        return Ok(sensor_toml::format_file(&SensorFile { sensor, setup }));
    };
    let camera = sensor_toml::read_camera(file)?;
    let before = camera.setup.uncertainty.clone().unwrap_or_default();
    let setup = SensorSetup { uncertainty: Some(with_plane(before, &fit.covariance)), ..camera.setup };
    let written = CameraFile { laser_plane_in_camera: Some(fit.plane), setup, ..camera };
    Ok(sensor_toml::format_camera(&written))
}

/// An uncertainty with that of a plane added, independent of the camera's.
fn with_plane(before: SensorUncertainty, covariance: &Matrix3<f64>) -> SensorUncertainty {
    let mut order = vec![SensorParameter::NormalE1, SensorParameter::NormalE2, SensorParameter::Offset];
    let mut matrix = DMatrix::from_fn(3, 3, |i, j| covariance[(i, j)]);
    if let Some(camera) = before.covariance {
        let kept: Vec<usize> =
            (0..camera.order.len()).filter(|k| camera.order[*k] < SensorParameter::NormalE1).collect();
        let count = kept.len();
        let mut joined = DMatrix::zeros(count + 3, count + 3);
        for (i, &a) in kept.iter().enumerate() {
            for (j, &b) in kept.iter().enumerate() {
                joined[(i, j)] = camera.matrix[(a, b)];
            }
        }
        joined.view_mut((count, count), (3, 3)).copy_from(&matrix);
        order = kept.iter().map(|k| camera.order[*k]).chain(order).collect();
        matrix = joined;
    }
    plane_numbers(before.focal, before.principal_point_px, (order, matrix))
}

/// The single numbers beside a joint covariance whose last three rows are the plane's.
pub fn plane_numbers(
    focal: Option<f64>,
    principal_point_px: Option<f64>,
    (order, matrix): (Vec<SensorParameter>, DMatrix<f64>),
) -> SensorUncertainty {
    let last = matrix.nrows() - 3;
    let sigma = |k: usize| matrix[(last + k, last + k)].max(0.0).sqrt();
    SensorUncertainty {
        plane_offset_m: Some(sigma(2)),
        plane_normal_rad: Some(sigma(0).max(sigma(1))),
        focal,
        principal_point_px,
        covariance: Some(SensorCovariance { order, matrix }),
        ..SensorUncertainty::default()
    }
}
