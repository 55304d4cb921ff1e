//! Whole stripes against seam points on simulated cells: what is said and what is achieved, side by side; how often 95 %
//! intervals hold the truth; and what plates that are not flat do.
//!
//! `cargo run --release -p trueline-vision --example stripes [CELLS]`; 100 cells a row take some minutes.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a program for the terminal")]

use nalgebra::{DMatrix, SVector, Vector2, Vector3};
use rayon::prelude::*;
use trueline_dataset::{Recording, Sensor};
use trueline_geometry::so3;
use trueline_method::{Calibration, Config, Measurements, SensorMode, calibrate};
use trueline_model::LaserSheet;
use trueline_sim::{
    PlateForm, Plates, Preset, ProfileLook, Scenario, SensorModel, Sine, random_cell, scan_plates,
    scan_profiles,
};
use trueline_vision::profile;

/// Half of the field over which a seam point's error is taken, m.
const HALF_FIELD_M: f64 = 0.030;
/// A normal number is within so many standard deviations in 95 of 100 cases.
const WITHIN_95: f64 = 1.96;

/// Offset, rotation (norm), translation (norm) and seam error: squared.
#[derive(Clone, Copy, Default)]
struct Squares([f64; 4]);

/// One scan's outcome.
#[derive(Clone, Copy)]
struct Cell {
    said: Squares,
    error: Squares,
    /// Components within their 95 % interval, of seven.
    covered: u32,
    normalised: f64,
}

fn main() {
    let cells: u64 = std::env::args().nth(1).map_or(20, |text| text.parse().unwrap());
    println!(
        "{cells} cells a row; rotation and translation: norms; seam: RMS over ±30 mm × ±30 mm of the sheet"
    );
    println!(
        "{:<34}{:<8}{:>17}{:>19}{:>19}{:>19}{:>8}{:>8}",
        "scan", "use", "offset µs", "rotation °", "translation mm", "seam mm", "95 %", "NEES/7"
    );
    let paper = Preset::Paper.scenario();
    let good = Preset::Good.scenario();
    for (name, scenario) in [("S-scan 60 s", &paper), ("good 20 s", &good), ("mild 10 s", &mild())] {
        for (suffix, sensor) in [("", SensorMode::Fixed), (" + h", SensorMode::Free)] {
            for measurements in [Measurements::Seam, Measurements::Stripe] {
                let row = row(cells, scenario, &Plates::default(), (measurements, sensor));
                print_row(&format!("camera, {name}{suffix}"), measurements, &row);
            }
        }
    }
    let profiler = Scenario { scan: good.scan.clone(), ..Preset::Profiler.scenario() };
    for (suffix, sensor) in [("", SensorMode::Fixed), (" + h", SensorMode::Free)] {
        for measurements in [Measurements::Seam, Measurements::Stripe] {
            let row = row(cells, &profiler, &Plates::default(), (measurements, sensor));
            print_row(&format!("profiler, good 20 s{suffix}"), measurements, &row);
        }
    }
    println!("\n0.2 mm in each surface term of both plates, S-scan 60 s: seam achieved / said");
    for (term, name) in ["r²", "rs", "s²", "r³", "r²s", "rs²", "s³"].into_iter().enumerate() {
        let plates = Plates { forms: [PlateForm::of_term(term, 2e-4); 2], ..Plates::default() };
        let row = row(cells.div_ceil(2), &paper, &plates, (Measurements::Stripe, SensorMode::Fixed));
        let [said, error] = [|c: &Cell| c.said.0[3], |c: &Cell| c.error.0[3]].map(|of| root_mean(&row, of));
        println!("  {name:<4} {:.4} / {:.4} mm = {:.2}", error * 1e3, said * 1e3, error / said);
    }
}

/// ±5 mm, ±5 mm stand-off, ±5° in 10 s.
fn mild() -> Scenario {
    let mut scenario = Preset::Quick.scenario();
    scenario.timing.duration_s = 10.0;
    let amplitude = |sine: Sine, amplitude: f64| Sine { amplitude, ..sine };
    scenario.scan.lateral = amplitude(scenario.scan.lateral, 0.005);
    scenario.scan.range = amplitude(scenario.scan.range, 0.005);
    scenario.scan.tilts = scenario.scan.tilts.map(|tilt| amplitude(tilt, 5_f64.to_radians()));
    scenario
}

fn row(
    cells: u64,
    scenario: &Scenario,
    plates: &Plates,
    (measurements, sensor): (Measurements, SensorMode),
) -> Vec<Cell> {
    let one = |seed: u64| {
        let scenario = random_cell(scenario, seed, 0.1);
        let recording = recorded(&scenario, plates, seed)?;
        let config = Config { measurements, sensor, ..Config::noise_only() };
        let guess = recording.truth.as_ref()?.parameters;
        cell(&recording, &calibrate(&recording, Some(&guess), &config).ok()?)
    };
    (1..=cells).into_par_iter().filter_map(one).collect()
}

fn recorded(scenario: &Scenario, plates: &Plates, seed: u64) -> Option<Recording> {
    if !matches!(scenario.cell.sensor, SensorModel::Profiler { .. }) {
        return scan_plates(scenario, plates, seed);
    }
    let (mut recording, profiles) = scan_profiles(scenario, plates, &ProfileLook::default(), seed)?;
    let found = profile::seams(&profiles).found;
    (recording.features, recording.stripes) = (found.features, found.stripes);
    Some(recording)
}

fn cell(recording: &Recording, calibration: &Calibration) -> Option<Cell> {
    let truth = recording.truth.as_ref()?.parameters;
    let at = calibration.best_fit();
    let off: SVector<f64, 7> = at.minus(&truth);
    let covariance = calibration.best_fit_covariance();
    let variance = |k: usize| covariance[(k, k)];
    let covered = (0..7).filter(|&k| off[k].abs() < WITHIN_95 * variance(k).sqrt()).count() as u32;
    let own = covariance.fixed_view::<7, 7>(0, 0).into_owned();
    let (seam_said, seam_error) = seam(recording, calibration)?;
    let sum = |first: usize, of: &dyn Fn(usize) -> f64| (first..first + 3).map(of).sum::<f64>();
    Some(Cell {
        said: Squares([variance(0), sum(1, &variance), sum(4, &variance), seam_said]),
        error: Squares([
            off[0].powi(2),
            sum(1, &|k| off[k].powi(2)),
            sum(4, &|k| off[k].powi(2)),
            seam_error,
        ]),
        covered,
        normalised: off.dot(&own.cholesky()?.solve(&off)),
    })
}

/// Mean square over the field of a seam point's error in the tool frame: said and true.
fn seam(recording: &Recording, calibration: &Calibration) -> Option<(f64, f64)> {
    let (sheet, middle) = match &recording.sensor {
        Sensor::CameraLaser { laser_plane_in_camera: plane, .. } => {
            let sheet = LaserSheet::from_plane(*plane);
            (sheet, sheet.coordinates(&Vector3::new(0.0, 0.0, plane.offset() / plane.normal().z)))
        }
        _ => (LaserSheet::of_profiler(), Vector2::new(0.0, 0.13)),
    };
    let truth = recording.truth.as_ref()?.parameters.tool_from_camera;
    let at = calibration.best_fit();
    let covariance = calibration.best_fit_covariance();
    let shape = at.unknowns().shape();
    let (mut said, mut error) = (0.0, 0.0);
    for k in 0..25 {
        let on = |k: usize| HALF_FIELD_M * (k as f64 / 2.0 - 1.0);
        let reported = sheet.point(&(middle + Vector2::new(on(k % 5), on(k / 5))));
        let there = at.corrected(&sheet, &reported);
        let placed = at.tool_from_camera * nalgebra::Point3::from(there);
        error += (placed - truth * nalgebra::Point3::from(reported)).norm_squared() / 25.0;
        let mut slope = DMatrix::zeros(3, covariance.nrows());
        let turned = at.tool_from_camera.rotation * there;
        slope.view_mut((0, 1), (3, 3)).copy_from(&-so3::hat(&turned));
        slope.view_mut((0, 4), (3, 3)).fill_with_identity();
        for (number, column) in shape.clone().enumerate() {
            let mut moved = at.clone();
            if let Some(shape) = &mut moved.shape {
                shape.h[number] += 1e-6;
            }
            let by = (moved.corrected(&sheet, &reported) - there) / 1e-6;
            slope.view_mut((0, column), (3, 1)).copy_from(&(at.tool_from_camera.rotation * by));
        }
        said += (&slope * covariance * slope.transpose()).trace() / 25.0;
    }
    Some((said, error))
}

fn root_mean(row: &[Cell], of: impl Fn(&Cell) -> f64) -> f64 {
    (row.iter().map(of).sum::<f64>() / row.len().max(1) as f64).sqrt()
}

fn print_row(name: &str, measurements: Measurements, row: &[Cell]) {
    let pair = |k: usize, scale: f64, digits: usize| {
        let [error, said] =
            [root_mean(row, |c| c.error.0[k]) * scale, root_mean(row, |c| c.said.0[k]) * scale];
        format!("{error:.digits$} ({said:.digits$})")
    };
    let covered = row.iter().map(|c| f64::from(c.covered)).sum::<f64>() / (7.0 * row.len().max(1) as f64);
    let normalised = row.iter().map(|c| c.normalised).sum::<f64>() / (7.0 * row.len().max(1) as f64);
    println!(
        "{name:<34}{:<8}{:>17}{:>19}{:>19}{:>19}{:>7.1}%{normalised:>8.2}",
        measurements.name(),
        pair(0, 1e6, 1),
        pair(1, 1_f64.to_degrees(), 4),
        pair(2, 1e3, 4),
        pair(3, 1e3, 4),
        100.0 * covered
    );
}
