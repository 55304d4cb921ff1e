//! Whole stripes against seam points on simulated cells: stated ± and errors, side by side; how often 95 % intervals
//! hold the truth; the ratio of the estimates' errors to the Cramér–Rao bound; and the effect of bowed plates.
//!
//! `cargo run --release -p trueline-studies -- stripes [CELLS [FILTER]]`. Only rows with the filter in their scan and use
//! are made: `"profiler, good 20 s"` for all of them, `"profiler, good 20 s | stripe"` for one. With `table` as filter:
//! information of each motion for seam points, both plates and one flat plate, predicted and achieved.

mod table;

use crate::arguments::{number, word};
use nalgebra::{DMatrix, SMatrix, SVector, Vector2, Vector3};
use rayon::prelude::*;
use trueline_dataset::{Recording, Sensor};
use trueline_geometry::so3;
use trueline_lsq::{Information, LeastSquares, NormalEquations};
use trueline_method::assess::observability::RANK_THRESHOLD;
use trueline_method::input::observations::{self, Observations};
use trueline_method::input::shape_knowledge::ShapeKnowledge;
use trueline_method::input::timestamps::Sampling;
use trueline_method::problem::usable::UsableObservations;
use trueline_method::solve::seam_chart::with_bows;
use trueline_method::stripe::frames::{Sight, StripeFrame, frames};
use trueline_method::stripe::problem::StripeProblem;
use trueline_method::stripe::start::start;
use trueline_method::stripe::weighed_frame::{PoseError, WeighedFrame};
use trueline_method::{Calibration, Config, Measurements, Parameters, SensorMode, calibrate};
use trueline_model::{LaserSheet, SheetShape};
use trueline_sim::noise::Noise;
use trueline_sim::{
    Between, Disturbance, PlateForm, PlatePair, Plates, Preset, ProfileLook, Scan, Scenario, SensorModel,
    Sine, random_cell, scan_plates, scan_profiles,
};
use trueline_vision::profile;

/// Half of the field over which a seam point's error is taken, m.
const HALF_FIELD_M: f64 = 0.030;
/// A normal number is within this many standard deviations in 95 of 100 cases.
const WITHIN_95: f64 = 1.96;
/// Offset, rotation, translation.
const UNKNOWNS: usize = 7;

/// Offset, rotation (norm), translation (norm) and seam error: squared.
#[derive(Clone, Copy, Default)]
struct Squares([f64; 4]);

/// One scan's outcome.
#[derive(Clone, Copy)]
struct Cell {
    said: Squares,
    error: Squares,
    /// Components within their 95 % interval.
    covered: u32,
    normalised: f64,
    /// Each component's error over its stated ±.
    over_said: SVector<f64, UNKNOWNS>,
    /// Each component's error over its Cramér–Rao bound, if known.
    over_bound: Option<SVector<f64, UNKNOWNS>>,
}

/// A row of the table: one kind of scan, and its evaluation.
struct Case {
    name: String,
    scenario: Scenario,
    plates: Plates,
    measurements: Measurements,
    sensor: SensorMode,
    /// Noise of the stripes alone, with a known bound.
    own_noise: bool,
}

impl Case {
    fn title(&self) -> String {
        format!("{} | {}", self.name, self.measurements.name())
    }
}

pub(crate) fn run(arguments: &[String]) -> Result<(), String> {
    let cells: u64 = number(arguments, 0, 20)?;
    let filter = word(arguments, 1);
    if filter == "table" {
        table::print(cells);
        return Ok(());
    }
    println!(
        "{cells} cells a row; rotation and translation: norms; seam: RMS over ±30 mm × ±30 mm of the sheet"
    );
    println!(
        "{:<52}{:<8}{:>17}{:>19}{:>19}{:>19}{:>8}{:>8}{:>7}{:>7}",
        "scan",
        "use",
        "offset µs",
        "rotation °",
        "translation mm",
        "seam mm",
        "95 %",
        "NEES/7",
        "/said",
        "/bound"
    );
    for case in cases().iter().chain(&bowed()).filter(|case| case.title().contains(filter)) {
        print_row(case, &row(cells, case), cells);
    }
    Ok(())
}

fn cases() -> Vec<Case> {
    let paper = Preset::Paper.scenario();
    let good = Preset::Good.scenario();
    let profiler = Preset::Profiler.scenario();
    let profiled = |scenario: &Scenario| Scenario { scan: scenario.scan.clone(), ..profiler.clone() };
    let profiled_paper = Scenario { timing: paper.timing.clone(), ..profiled(&paper) };
    let scans = [
        ("camera, S-scan 60 s", paper),
        ("camera, good 20 s", good.clone()),
        ("camera, mild 10 s", mild()),
        ("profiler, S-scan 60 s", profiled_paper),
        ("profiler, good 20 s", profiled(&good)),
    ];
    let mut cases = Vec::new();
    for (name, scenario) in &scans {
        for (suffix, sensor) in [("", SensorMode::Fixed), (" + h", SensorMode::Free)] {
            for (noise, own_noise) in [("", false), (", stripes' noise alone", true)] {
                for measurements in [Measurements::Seam, Measurements::Stripe] {
                    if own_noise && measurements == Measurements::Seam {
                        continue;
                    }
                    let (name, scenario) = (format!("{name}{suffix}{noise}"), scenario.clone());
                    let plates = Plates::default();
                    cases.push(Case { name, scenario, plates, measurements, sensor, own_noise });
                }
            }
        }
    }
    cases
}

/// 0.2 mm in each surface term of both plates, of a fillet, of laps of 3 and 1 mm and of one plate with its edge, in pictures and in profiles.
fn bowed() -> Vec<Case> {
    let terms = ["r²", "rs", "s²", "r³", "r²s", "rs²", "s³"];
    let [paper, good] = [Preset::Paper, Preset::Good].map(Preset::scenario);
    let profiled = |of: &Scenario| Scenario {
        scan: of.scan.clone(),
        timing: of.timing.clone(),
        ..Preset::Profiler.scenario()
    };
    let scans = [("", paper.clone()), (" of profiles", profiled(&paper))];
    let good_scans = [(", good", good.clone()), (" of profiles, good", profiled(&good))];
    let lap = |step_m| PlatePair::Lap { step_m };
    let pairs = [
        ("fillet", PlatePair::Meeting),
        ("lap", lap(3e-3)),
        ("low lap", lap(1e-3)),
        ("one plate", PlatePair::Edge),
    ];
    let kinds = pairs.into_iter().flat_map(|(kind, pair)| {
        let scans = scans.iter().chain(&good_scans);
        scans.map(move |(scan, scenario)| (format!("{kind}{scan}, bowed"), pair, scenario))
    });
    let mut cases = Vec::new();
    for (name, pair, scenario) in kinds {
        let case = |name: String, forms| Case {
            name,
            scenario: scenario.clone(),
            plates: Plates { pair, forms, ..Plates::default() },
            measurements: Measurements::Stripe,
            sensor: SensorMode::Fixed,
            own_noise: false,
        };
        cases.push(case(format!("{name} by nothing"), Default::default()));
        cases.extend((terms.iter().enumerate()).map(|(number, term)| {
            case(format!("{name} 0.2 mm in {term}"), [PlateForm::of_term(number, 2e-4); 2])
        }));
    }
    cases
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

/// No two cells weave alike. The place of an edge in a profiler's column is a saw-tooth of its position. For a sine in the
/// sensor's view, sampled evenly, it contains the odd harmonics alone. Weaves of 0.47 Hz at 33 profiles a second appear as
/// 0.13, 0.17 and 0.23 Hz, the tilts of the presets, and all cells would draw the same.
fn own_weave(scan: &Scan, seed: u64) -> Scan {
    let mut draw = Noise::new(seed, 9);
    let amplitude = scan.lateral.amplitude * draw.uniform(0.97, 1.03);
    let frequency_hz = scan.lateral.frequency_hz * draw.uniform(0.97, 1.03);
    Scan { lateral: Sine { amplitude, frequency_hz, ..scan.lateral }, ..scan.clone() }
}

fn row(cells: u64, case: &Case) -> Vec<Cell> {
    let one = |seed: u64| {
        let mut scenario = random_cell(&case.scenario, seed, 0.1);
        scenario.scan = own_weave(&scenario.scan, seed);
        if case.own_noise {
            scenario.disturbance = Disturbance::default();
            scenario.timing.between = Between::Straight;
        }
        let recording = recorded(&scenario, &case.plates, seed)?;
        let Case { measurements, sensor, .. } = *case;
        let config = Config { measurements, sensor, ..Config::noise_only() };
        let guess = recording.truth.as_ref()?.parameters;
        let bound = if case.own_noise { Some(bound(&recording, &config)?) } else { None };
        cell(&recording, &calibrate(&recording, Some(&guess), &config).ok()?, bound)
    };
    (1..=cells).into_par_iter().filter_map(one).collect()
}

/// Cramér–Rao bound of each standard deviation at the truth, for the stated noise of the support points alone.
fn bound(recording: &Recording, config: &Config) -> Option<SVector<f64, UNKNOWNS>> {
    let truth = recording.truth.as_ref()?;
    let sampling = Sampling::of(recording, observations::origin_ns(recording));
    let observed = observations::observe(recording, &sampling, config).ok()?;
    let straight = Parameters::straight(&truth.parameters, truth.lines.clone());
    let usable = UsableObservations::within(&observed, straight.time_offset_s, 0.0);
    let seam = with_bows(&observed, usable.of(&observed), straight);
    let frames = frames(recording, &observed, config.measurements, config).ok()?;
    let shape_prior = ShapeKnowledge::of(recording, &observed).prior(config);
    let shape = shape_prior.map(|_| SheetShape::exact_about(&observed.shape_origin_m.into()));
    let at = start(&observed, &frames, &seam, shape).ok()?;
    let weighed = frames.list.iter().filter_map(|frame| by_own_noise(&observed, frame)).collect();
    let problem =
        StripeProblem { observations: &observed, frames: weighed, unknowns: at.unknowns(), shape_prior };
    let mut equations = NormalEquations::zeros(problem.dimension());
    problem.linearize(&at, &mut equations);
    let covariance = Information::new(&equations.hessian, &[], RANK_THRESHOLD)?.covariance();
    Some(SVector::from_fn(|k, _| covariance[(k, k)].sqrt()))
}

/// A frame within the recording, whitened by the stated errors of each support point.
fn by_own_noise(observed: &Observations, frame: &StripeFrame) -> Option<WeighedFrame> {
    let Sight::Stripes(stripes) = &frame.sight else { return None };
    let mut whitener = SMatrix::zeros();
    let mut rows = 0;
    for (plate, supports) in stripes.iter().enumerate() {
        for (k, support) in supports.iter().flatten().enumerate() {
            let row = 2 * plate + k;
            whitener[(row, row)] = support.sigma_m.recip();
            rows += 1;
        }
    }
    let inside = observed.robot.trajectory.bracket(frame.stamp_s - 0.1).is_some();
    inside.then_some(WeighedFrame { frame: *frame, whitener, rows, pose_error: PoseError::NONE })
}

fn recorded(scenario: &Scenario, plates: &Plates, seed: u64) -> Option<Recording> {
    if !matches!(scenario.cell.sensor, SensorModel::Profiler { .. }) {
        return scan_plates(scenario, plates, seed);
    }
    let (mut recording, profiles) = scan_profiles(scenario, plates, &ProfileLook::default(), seed)?;
    let found = profile::seams(&profiles, None).found;
    (recording.features, recording.stripes) = (found.features, found.stripes);
    Some(recording)
}

fn cell(
    recording: &Recording,
    calibration: &Calibration,
    bound: Option<SVector<f64, UNKNOWNS>>,
) -> Option<Cell> {
    let truth = recording.truth.as_ref()?.parameters;
    let at = calibration.best_fit();
    let off: SVector<f64, UNKNOWNS> = at.minus(&truth);
    let covariance = calibration.best_fit_covariance();
    let variance = |k: usize| covariance[(k, k)];
    let covered = (0..UNKNOWNS).filter(|&k| off[k].abs() < WITHIN_95 * variance(k).sqrt()).count() as u32;
    let own = covariance.fixed_view::<7, 7>(0, 0).into_owned();
    let (seam_said, seam_error) = seam(recording, at, covariance)?;
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
        over_said: SVector::from_fn(|k, _| off[k] / variance(k).sqrt()),
        over_bound: bound.map(|bound| off.component_div(&bound)),
    })
}

/// Mean square over the field of a seam point's error in the tool frame: stated and true.
fn seam(recording: &Recording, at: &Parameters, covariance: &DMatrix<f64>) -> Option<(f64, f64)> {
    let (sheet, middle) = match &recording.sensor {
        Sensor::CameraLaser { laser_plane_in_camera: plane, .. } => {
            let sheet = LaserSheet::from_plane(*plane);
            (sheet, sheet.coordinates(&Vector3::new(0.0, 0.0, plane.offset() / plane.normal().z)))
        }
        _ => (LaserSheet::of_profiler(), Vector2::new(0.0, 0.13)),
    };
    let truth = recording.truth.as_ref()?.parameters.tool_from_camera;
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
    root_mean_of(row, of)
}

fn root_mean_of<T>(list: &[T], of: impl Fn(&T) -> f64) -> f64 {
    (list.iter().map(of).sum::<f64>() / list.len().max(1) as f64).sqrt()
}

fn print_row(case: &Case, row: &[Cell], cells: u64) {
    let pair = |k: usize, scale: f64, digits: usize| {
        let [error, said] =
            [root_mean(row, |c| c.error.0[k]) * scale, root_mean(row, |c| c.said.0[k]) * scale];
        format!("{error:.digits$} ({said:.digits$})")
    };
    let parts = (UNKNOWNS * row.len().max(1)) as f64;
    let covered = row.iter().map(|c| f64::from(c.covered)).sum::<f64>() / parts;
    let normalised = row.iter().map(|c| c.normalised).sum::<f64>() / parts;
    let over_said = root_mean(row, |c| c.over_said.norm_squared() / UNKNOWNS as f64);
    let over_bound =
        root_mean(row, |c| c.over_bound.map_or(f64::NAN, |over| over.norm_squared() / UNKNOWNS as f64));
    println!(
        "{:<52}{:<8}{:>17}{:>19}{:>19}{:>19}{:>7.1}%{normalised:>8.3}{over_said:>7.3}{over_bound:>7.3}",
        case.name,
        case.measurements.name(),
        pair(0, 1e6, 1),
        pair(1, 1_f64.to_degrees(), 4),
        pair(2, 1e3, 4),
        pair(3, 1e3, 4),
        100.0 * covered
    );
    let mean = row.iter().map(|c| c.over_said).sum::<SVector<f64, UNKNOWNS>>() / row.len().max(1) as f64;
    let bias: Vec<String> = mean.iter().map(|bias| format!("{bias:+.2}")).collect();
    println!("    mean error in its own sigmas, offset, rotation, translation: {}", bias.join(" "));
    let without = cells - row.len() as u64;
    if without > 0 {
        println!("    {without} of {cells} cells gave no answer and are in none of these figures");
    }
}
