//! Effect of each violation of the model on a calibration: is the answer right within its ±, warned of, or refused?
//!
//! `cargo run --release -p trueline-studies -- violations [SCANS PER ROW] [WORDS OF A ROW]` prints the table in the book's page `theory/validation.md`,
//! or the rows that contain the words.

use crate::arguments::{number, word};
use std::collections::BTreeMap;
use trueline_dataset::{Guess, Measured, Recording, Sensor};
use trueline_geometry::se3;
use trueline_method::order_statistics::median;
use trueline_method::{Calibration, Config, DrawnLine, SensorMode, Status, Warning, calibrate};
use trueline_model::LaserSheet;
use trueline_sim::capture::{SheetAxes, measure};
use trueline_sim::{Fault, Preset, Scenario, random_cell, simulate_with_faults};

/// Change of a scan of the preset `good` in a random cell.
enum Wrong {
    /// Faults, as `trueline simulate --fault` takes them.
    Faults(&'static [&'static str]),
    /// Faults on a scan with hardly any tilt.
    Weak(&'static [&'static str]),
    /// Faults on a scan with a seam that swings with one frequency.
    Swing(&'static [&'static str]),
    /// Another scan, timing or disturbance.
    Scenario(fn(&mut Scenario)),
    /// A guess that is wrong.
    Guess(fn(&mut Guess)),
    /// Faults on a scan with the sensor held as in its file.
    Held(&'static [&'static str]),
    /// A seam held where it was drawn, this many metres from its true place and stated to 0.1 mm.
    Drawn(f64),
}

use Wrong::{Drawn, Faults, Guess as Guessed, Held, Scenario as Changed, Swing, Weak};

/// Each row with its name.
const ROWS: [(&str, Wrong); 96] = [
    ("none", Faults(&[])),
    ("none, weak scan", Weak(&[])),
    ("none, one frequency", Swing(&[])),
    ("plane offset 0.05 mm", Faults(&["plane-offset=0.05"])),
    ("plane offset 0.1 mm", Faults(&["plane-offset=0.1"])),
    ("plane offset 0.25 mm", Faults(&["plane-offset=0.25"])),
    ("plane offset 0.5 mm", Faults(&["plane-offset=0.5"])),
    ("plane offset 1 mm", Faults(&["plane-offset=1"])),
    ("plane tilt 0.1° about the stripe", Faults(&["plane-tilt-stripe=0.1"])),
    ("plane tilt 0.1° along it", Faults(&["plane-tilt-range=0.1"])),
    ("plane tilt 0.5° about the stripe", Faults(&["plane-tilt-stripe=0.5"])),
    ("plane tilt 0.5° along it", Faults(&["plane-tilt-range=0.5"])),
    ("plane tilt 0.5° about the stripe, weak scan", Weak(&["plane-tilt-stripe=0.5"])),
    ("plane tilt 0.5° along it, weak scan", Weak(&["plane-tilt-range=0.5"])),
    ("plane tilt 0.5° about the stripe, one frequency", Swing(&["plane-tilt-stripe=0.5"])),
    ("focal +0.2 %", Faults(&["focal=0.2"])),
    ("focal +0.5 %", Faults(&["focal=0.5"])),
    ("principal point u +5 px", Faults(&["principal-point-u=5"])),
    ("principal point u +20 px", Faults(&["principal-point-u=20"])),
    ("principal point v +5 px", Faults(&["principal-point-v=5"])),
    ("principal point v +20 px", Faults(&["principal-point-v=20"])),
    ("distortion left out (k1)", Faults(&["distortion=-0.08"])),
    ("bow 0.2 mm, lateral", Faults(&["bow-across=0.2"])),
    ("bow 0.2 mm, height", Faults(&["bow-height=0.2"])),
    ("bow 0.5 mm", Faults(&["bow-across=0.5"])),
    ("bow 1 mm", Faults(&["bow-across=1"])),
    ("weld wobble 0.1 mm", Faults(&["wobble=0.1,5"])),
    ("weld wobble 0.3 mm", Faults(&["wobble=0.3,5"])),
    ("real weld: correlated 0.2 mm, bow 0.2 mm", Faults(&["correlated-noise=0.2", "bow-across=0.2"])),
    ("robot field 0.1 mm per 500 mm", Faults(&["robot-field=0.1,500"])),
    ("robot field 0.2 mm per 500 mm", Faults(&["robot-field=0.2,500"])),
    ("robot field 0.5 mm per 500 mm", Faults(&["robot-field=0.5,500"])),
    ("robot field 0.5 mm per 2000 mm", Faults(&["robot-field=0.5,2000"])),
    ("robot attitude 0.05°", Faults(&["robot-attitude=0.05,500"])),
    ("flex 0.05 mm per m/s²", Faults(&["flex=0.05"])),
    ("flex 0.2 mm per m/s²", Faults(&["flex=0.2"])),
    ("backlash 0.02 mm", Faults(&["backlash=0.02"])),
    ("backlash 0.1 mm", Faults(&["backlash=0.1"])),
    ("offset drifts 1 ms", Faults(&["offset-drift=1"])),
    ("offset drifts 5 ms", Faults(&["offset-drift=5"])),
    ("offset swings 1 ms", Faults(&["offset-swing=1"])),
    ("offset steps 1 ms", Faults(&["offset-step=1"])),
    ("offset steps 0.2 ms", Faults(&["offset-step=0.2"])),
    ("offset steps a frame", Faults(&["offset-step=30.3"])),
    ("bias 0.33 px per 10° of work angle", Faults(&["bias-work-angle=0.33"])),
    ("bias 1.3 px per 10° of work angle", Faults(&["bias-work-angle=1.3"])),
    ("bias 0.33 px per 10° of the other tilts", Faults(&["bias-travel-angle=0.33", "bias-spin=0.33"])),
    ("bias 0.5 px by side", Faults(&["bias-side=0.5"])),
    ("bias 2 px by side", Faults(&["bias-side=2"])),
    ("rolling shutter 10 ms", Faults(&["rolling-shutter=10"])),
    ("rolling shutter 25 ms", Faults(&["rolling-shutter=25"])),
    ("image stamps cut to 1 ms", Faults(&["image-grain=1"])),
    ("image stamps cut to 10 ms", Faults(&["image-grain=10"])),
    ("image stamps cut to 33 ms", Faults(&["image-grain=33"])),
    ("robot stamps cut to 1 ms", Faults(&["robot-grain=1"])),
    ("robot stamps cut to 10 ms", Faults(&["robot-grain=10"])),
    ("doubled frames 5 %", Faults(&["doubled-frames=5"])),
    ("doubled frames 20 %", Faults(&["doubled-frames=20"])),
    ("lost frames 5 %, not counted", Faults(&["uncounted-losses=5"])),
    ("features slip by a frame", Faults(&["frame-slip=1"])),
    ("late arrival 5 ms", Faults(&["late-arrival=5"])),
    ("command for the pose, lag 20 ms", Faults(&["command-lag=20"])),
    ("command for the pose, lag 20 ms, one frequency", Swing(&["command-lag=20"])),
    ("attitude 0.5 ms later than position", Faults(&["attitude-lag=0.5"])),
    ("attitude 2 ms later than position", Faults(&["attitude-lag=2"])),
    ("attitude 8 ms later than position", Faults(&["attitude-lag=8"])),
    ("parallel line 3 mm, 40 %", Faults(&["parallel-line=3,40"])),
    ("parallel line 0.3 mm, 40 %", Faults(&["parallel-line=0.3,40"])),
    ("parallel line 3 mm, 45 %", Faults(&["parallel-line=3,45"])),
    ("parallel line 3 mm, 55 %", Faults(&["parallel-line=3,55"])),
    ("last 40 % on a line 0.3 mm beside", Faults(&["parallel-line-at-end=0.3,40"])),
    ("last 55 % on a line 3 mm beside", Faults(&["parallel-line-at-end=3,55"])),
    ("gross outliers 40 %", Changed(|s| s.disturbance.outlier_fraction = 0.4)),
    ("gross outliers 50 %", Changed(|s| s.disturbance.outlier_fraction = 0.5)),
    ("gross outliers 60 %", Changed(|s| s.disturbance.outlier_fraction = 0.6)),
    ("gross outliers 70 %", Changed(|s| s.disturbance.outlier_fraction = 0.7)),
    ("30 frames in 1 s", Changed(|s| s.timing.duration_s = 30.0 / 33.0)),
    ("30 frames in 20 s", Changed(|s| s.timing.frame_period_s = 20.0 / 30.0)),
    (
        "camera of 1000 Hz, robot of 10 Hz",
        Changed(|s| (s.timing.frame_period_s, s.timing.robot_period_s) = (1e-3, 0.1)),
    ),
    ("seam of 20 mm", Changed(|s| s.scan.length_m = 0.020)),
    ("seam of 5 mm", Changed(|s| s.scan.length_m = 0.005)),
    ("guess 90° off", Guessed(|g| turn(g, 90.0))),
    ("guess 180° off", Guessed(|g| turn(g, 180.0))),
    ("guess 300 mm off", Guessed(|g| g.tool_from_camera.translation.vector.x += 0.3)),
    ("guess 0.4 s off", Guessed(|g| g.time_offset_s += 0.4)),
    ("guess 2 s off", Guessed(|g| g.time_offset_s += 2.0)),
    ("guess inverted", Guessed(|g| g.tool_from_camera = g.tool_from_camera.inverse())),
    (
        "guess with its rotation transposed",
        Guessed(|g| g.tool_from_camera.rotation = g.tool_from_camera.rotation.inverse()),
    ),
    ("sensor held, none", Held(&[])),
    ("sensor held, plane offset 0.25 mm", Held(&["plane-offset=0.25"])),
    ("sensor held, plane tilt 0.5° about the stripe", Held(&["plane-tilt-stripe=0.5"])),
    ("sensor held, robot arm 0.3 mm", Held(&["robot-arm=0.3"])),
    ("seam drawn where it is", Drawn(0.0)),
    ("seam drawn 0.1 mm beside, one sigma", Drawn(1e-4)),
    ("seam drawn 1 mm beside", Drawn(1e-3)),
    ("seam drawn 5 mm beside", Drawn(5e-3)),
];

const DRAWN_SIGMA_M: f64 = 1e-4;

/// The options of a row.
fn config(wrong: &Wrong, recording: &Recording) -> Option<Config> {
    let config = Config::default();
    Some(match wrong {
        Held(_) => Config { sensor: SensorMode::Fixed, ..config },
        Drawn(beside_m) => {
            let line = recording.truth.as_ref()?.lines.first()?;
            let amid = recording.robot.get(recording.robot.len() / 2)?.base_from_tool.translation.vector;
            let amid = line.anchored_near(&amid).anchor() + line.axes().column(1) * *beside_m;
            // Two points that are 200 mm apart.
            let ends = [-0.1, 0.1].map(|along| amid + line.direction() * along);
            Config { drawn_lines: vec![DrawnLine::through(0, ends, DRAWN_SIGMA_M)?], ..config }
        }
        Faults(_) | Weak(_) | Swing(_) | Changed(_) | Guessed(_) => config,
    })
}

/// Turned about an oblique axis.
fn turn(guess: &mut Guess, angle_deg: f64) {
    let axis = nalgebra::Vector3::new(1.0, 2.0, 3.0).normalize();
    guess.tool_from_camera.rotation *= trueline_geometry::so3::exp(&(axis * angle_deg.to_radians()));
}

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
    /// Its stated seam error, mm.
    claim_mm: f64,
    /// The part of it that is the scan's alone, mm.
    alone_mm: f64,
}

pub(crate) fn run(arguments: &[String]) -> Result<(), String> {
    let count: u64 = number(arguments, 0, 4)?;
    println!(
        "| violation | accepted | warned | nf | offset us | rot ° | trans mm | z | field mm | claim mm | scan alone mm | says |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|");
    let words = word(arguments, 1);
    for (name, wrong) in ROWS.iter().filter(|(name, _)| name.contains(words)) {
        let mut said: BTreeMap<String, usize> = BTreeMap::new();
        let accepted: Vec<Figures> = (0..count).filter_map(|seed| scan(wrong, seed, &mut said)).collect();
        print_row(name, &accepted, count, &said);
    }
    Ok(())
}

fn print_row(name: &str, accepted: &[Figures], count: u64, said: &BTreeMap<String, usize>) {
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

/// A scan with something wrong; `None` if it was not accepted.
fn scan(wrong: &Wrong, seed: u64, said: &mut BTreeMap<String, usize>) -> Option<Figures> {
    let preset = match wrong {
        Weak(_) => Preset::Weak,
        Swing(_) => Preset::Quick,
        _ => Preset::Good,
    };
    let mut scenario = random_cell(&preset.scenario(), seed, 0.1);
    let faults: Vec<Fault> = match wrong {
        Faults(faults) | Weak(faults) | Swing(faults) | Held(faults) => {
            faults.iter().filter_map(|fault| fault.parse().ok()).collect()
        }
        Changed(_) | Guessed(_) | Drawn(_) => Vec::new(),
    };
    if let Changed(change) = wrong {
        change(&mut scenario);
    }
    let recording = simulate_with_faults(&scenario, &faults, seed)?;
    let truth = recording.truth.as_ref()?.parameters;
    let guess = match wrong {
        Guessed(spoil) => {
            let mut guess = truth;
            spoil(&mut guess);
            Some(guess)
        }
        _ => None,
    };
    match calibrate(&recording, guess.as_ref(), &config(wrong, &recording)?) {
        Ok(result) => {
            let codes = result.reasons().iter().map(|reason| reason.code().to_owned());
            let codes = codes.chain(result.warnings().iter().map(code));
            codes.for_each(|code| *said.entry(code).or_insert(0) += 1);
            (result.status() == Status::Accepted).then(|| figures(&scenario, &recording, &truth, &result))
        }
        Err(error) => {
            *said.entry(error.to_string()).or_insert(0) += 1;
            None
        }
    }
}

/// The code of a warning, with its open alternative.
fn code(warning: &Warning) -> String {
    let instead = match warning {
        Warning::SensorOff { instead, .. } => instead.as_slice(),
        _ => &[],
    };
    let codes = [warning.code()].into_iter().chain(instead.iter().map(|cause| cause.kind.code()));
    codes.collect::<Vec<_>>().join(" or ")
}

fn figures(scenario: &Scenario, recording: &Recording, truth: &Guess, result: &Calibration) -> Figures {
    let (turn, shift) = se3::difference_decoupled(result.file_tool_from_camera(), &truth.tool_from_camera);
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
