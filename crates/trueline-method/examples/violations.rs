//! What each violation of the model does to a calibration: is the answer right within its ±, warned of, or refused?
//!
//! `cargo run --release --example violations [SCANS PER ROW] [WORDS OF A ROW]` prints the table in BENCHMARKS.md, or the rows
//! that contain the words.

#![allow(clippy::print_stdout, reason = "an example prints its table")]

use std::collections::BTreeMap;
use trueline_dataset::{Guess, Measured, Recording, Sensor};
use trueline_geometry::se3;
use trueline_method::order_statistics::median;
use trueline_method::{Calibration, Config, Reason, Status, Warning, calibrate};
use trueline_model::LaserSheet;
use trueline_sim::capture::{SheetAxes, measure};
use trueline_sim::{Fault, Preset, Scenario, random_cell, simulate_with_faults};

/// Each row: its name, and the faults as `trueline simulate --fault` takes them.
const ROWS: [(&str, &[&str]); 46] = [
    ("none", &[]),
    ("plane offset 0.05 mm", &["plane-offset=0.05"]),
    ("plane offset 0.1 mm", &["plane-offset=0.1"]),
    ("plane offset 0.25 mm", &["plane-offset=0.25"]),
    ("plane offset 1 mm", &["plane-offset=1"]),
    ("plane tilt 0.1° about the stripe", &["plane-tilt-stripe=0.1"]),
    ("plane tilt 0.1° along it", &["plane-tilt-range=0.1"]),
    ("plane tilt 0.5° about the stripe", &["plane-tilt-stripe=0.5"]),
    ("plane tilt 0.5° along it", &["plane-tilt-range=0.5"]),
    ("focal +0.2 %", &["focal=0.2"]),
    ("focal +0.5 %", &["focal=0.5"]),
    ("principal point u +20 px", &["principal-point-u=20"]),
    ("principal point v +5 px", &["principal-point-v=5"]),
    ("principal point v +20 px", &["principal-point-v=20"]),
    ("distortion left out (k1)", &["distortion=-0.08"]),
    ("bow 0.2 mm, lateral", &["bow-across=0.2"]),
    ("bow 0.2 mm, height", &["bow-height=0.2"]),
    ("bow 0.5 mm", &["bow-across=0.5"]),
    ("weld wobble 0.1 mm", &["wobble=0.1,5"]),
    ("weld wobble 0.3 mm", &["wobble=0.3,5"]),
    ("real weld: correlated 0.2 mm, bow 0.2 mm", &["correlated-noise=0.2", "bow-across=0.2"]),
    ("robot field 0.1 mm per 500 mm", &["robot-field=0.1,500"]),
    ("robot field 0.5 mm per 2000 mm", &["robot-field=0.5,2000"]),
    ("robot attitude 0.05°", &["robot-attitude=0.05,500"]),
    ("flex 0.05 mm per m/s²", &["flex=0.05"]),
    ("flex 0.2 mm per m/s²", &["flex=0.2"]),
    ("backlash 0.02 mm", &["backlash=0.02"]),
    ("backlash 0.1 mm", &["backlash=0.1"]),
    ("offset drifts 1 ms", &["offset-drift=1"]),
    ("offset swings 1 ms", &["offset-swing=1"]),
    ("offset steps 1 ms", &["offset-step=1"]),
    ("bias 0.33 px per 10° of work angle", &["bias-work-angle=0.33"]),
    ("bias 1.3 px per 10° of work angle", &["bias-work-angle=1.3"]),
    ("bias 0.33 px per 10° of the other tilts", &["bias-travel-angle=0.33", "bias-spin=0.33"]),
    ("bias 2 px by side", &["bias-side=2"]),
    ("rolling shutter 25 ms", &["rolling-shutter=25"]),
    ("image stamps cut to 1 ms", &["image-grain=1"]),
    ("image stamps cut to 10 ms", &["image-grain=10"]),
    ("robot stamps cut to 1 ms", &["robot-grain=1"]),
    ("doubled frames 20 %", &["doubled-frames=20"]),
    ("lost frames 5 %, not counted", &["uncounted-losses=5"]),
    ("features slip by a frame", &["frame-slip=1"]),
    ("late arrival 5 ms", &["late-arrival=5"]),
    ("attitude 2 ms later than position", &["attitude-lag=2"]),
    ("parallel line 3 mm, 40 %", &["parallel-line=3,40"]),
    ("last 55 % on a line 3 mm beside", &["parallel-line-at-end=3,55"]),
];

/// Figures of one accepted scan.
struct Figures {
    noise_factor: f64,
    warned: bool,
    offset_us: f64,
    rotation_deg: f64,
    translation_mm: f64,
    /// Largest error over its standard deviation.
    z: f64,
    /// RMS 3-D error in the tool frame over the field of view, mm.
    field_mm: f64,
    /// What is said of it: the seam error, mm.
    claim_mm: f64,
    /// The part of it that is the scan's alone, mm.
    alone_mm: f64,
}

fn main() {
    let count = std::env::args().nth(1).and_then(|text| text.parse().ok()).unwrap_or(4_u64);
    println!(
        "| violation | accepted | warned | nf | offset us | rot ° | trans mm | z | field mm | claim mm | scan alone mm | says |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|");
    let words = std::env::args().nth(2).unwrap_or_default();
    for (name, faults) in ROWS.into_iter().filter(|(name, _)| name.contains(&words)) {
        let faults: Vec<Fault> = faults.iter().filter_map(|fault| fault.parse().ok()).collect();
        let mut said: BTreeMap<&'static str, usize> = BTreeMap::new();
        let accepted: Vec<Figures> = (0..count).filter_map(|seed| scan(&faults, seed, &mut said)).collect();
        print_row(name, &accepted, count, &said);
    }
}

fn print_row(name: &str, accepted: &[Figures], count: u64, said: &BTreeMap<&'static str, usize>) {
    let of = |figure: fn(&Figures) -> f64, digits: usize| {
        median(accepted.iter().map(figure))
            .map_or_else(|| "–".to_owned(), |value| format!("{value:.digits$}"))
    };
    let said: Vec<String> = said.iter().map(|(code, count)| format!("{code} {count}")).collect();
    let said = said.join(", ");
    let warned = accepted.iter().filter(|figures| figures.warned).count();
    println!(
        "| {name} | {}/{count} | {warned} | {} | {} | {} | {} | {} | {} | {} | {} | {said} |",
        accepted.len(),
        of(|f| f.noise_factor, 2),
        of(|f| f.offset_us, 0),
        of(|f| f.rotation_deg, 3),
        of(|f| f.translation_mm, 3),
        of(|f| f.z, 1),
        of(|f| f.field_mm, 3),
        of(|f| f.claim_mm, 3),
        of(|f| f.alone_mm, 3)
    );
}

/// A good scan in a random cell with faults; `None` if it was not accepted.
fn scan(faults: &[Fault], seed: u64, said: &mut BTreeMap<&'static str, usize>) -> Option<Figures> {
    let scenario = random_cell(&Preset::Good.scenario(), seed, 0.1);
    let recording = simulate_with_faults(&scenario, faults, seed)?;
    let truth = recording.truth.as_ref()?.parameters;
    let Ok(result) = calibrate(&recording, None, &Config::default()) else {
        *said.entry("no result").or_insert(0) += 1;
        return None;
    };
    let codes = result.reasons().iter().map(Reason::code).chain(result.warnings().iter().map(Warning::code));
    codes.for_each(|code| *said.entry(code).or_insert(0) += 1);
    (result.status() == Status::Accepted).then(|| figures(&scenario, &recording, &truth, &result))
}

fn figures(scenario: &Scenario, recording: &Recording, truth: &Guess, result: &Calibration) -> Figures {
    let (turn, shift) =
        se3::difference_decoupled(&result.best_fit().tool_from_camera, &truth.tool_from_camera);
    let offset_s = result.best_fit().time_offset_s - truth.time_offset_s;
    let errors = [offset_s, turn.x, turn.y, turn.z, shift.x, shift.y, shift.z];
    let z = errors.iter().enumerate().filter_map(|(k, error)| Some(error.abs() / result.sigma(k)?));
    Figures {
        noise_factor: result.findings.fit.noise_factor,
        warned: !result.warnings().is_empty(),
        offset_us: offset_s.abs() * 1e6,
        rotation_deg: turn.norm().to_degrees(),
        translation_mm: shift.norm() * 1e3,
        z: z.fold(0.0, f64::max),
        field_mm: field_error_m(scenario, recording, truth, result).unwrap_or(f64::NAN) * 1e3,
        claim_mm: result.findings.checks.seam_error.map_or(f64::NAN, |error| error.rms_m * 1e3),
        alone_mm: result.findings.checks.seam_error.map_or(f64::NAN, |error| error.scan_alone_m() * 1e3),
    }
}

/// RMS over ±25 mm of the laser plane of the error, in the tool frame, of a point that the stated sensor measures, as the
/// result corrects it.
fn field_error_m(
    scenario: &Scenario,
    recording: &Recording,
    truth: &Guess,
    result: &Calibration,
) -> Option<f64> {
    let Sensor::CameraLaser { camera, laser_plane_in_camera: plane } = &recording.sensor else { return None };
    let axes = SheetAxes::of(&scenario.cell.sensor);
    let sheet = LaserSheet::from_plane(*plane);
    let (mut sum, mut count) = (0.0, 0.0);
    for (row, column) in (-5..=5).flat_map(|row| (-5..=5).map(move |column| (row, column))) {
        let point = axes.point(f64::from(column) * 0.005, f64::from(row) * 0.005);
        let Some(Measured::Pixel(pixel)) = measure(&scenario.cell.sensor, &point) else { continue };
        let Ok((ray, _)) = camera.ray(&pixel.into()) else { continue };
        let stated = ray * (plane.offset() / plane.normal().dot(&ray));
        let stated = result.best_fit().corrected(&sheet, &stated);
        let error = result.best_fit().tool_from_camera * nalgebra::Point3::from(stated)
            - truth.tool_from_camera * nalgebra::Point3::from(point);
        (sum, count) = (sum + error.norm_squared(), count + 1.0);
    }
    (count > 0.0).then(|| (sum / count).sqrt())
}
