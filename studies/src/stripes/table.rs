//! Information of each motion, for seam points, both plates and one flat plate: the bounds of the study behind whole
//! stripes, the stated ±, and the errors.

use super::{Squares, UNKNOWNS, cell, mild, root_mean_of, seam};
use nalgebra::{DMatrix, SVector};
use rayon::prelude::*;
use trueline_dataset::Recording;
use trueline_geometry::{Pose, se3, so3};
use trueline_lsq::{Information, SolveOptions, solve};
use trueline_method::assess::observability::RANK_THRESHOLD;
use trueline_method::input::noise_levels::NoiseLevels;
use trueline_method::input::observations;
use trueline_method::input::shape_knowledge::ShapeKnowledge;
use trueline_method::input::timestamps::Sampling;
use trueline_method::problem::usable::UsableObservations;
use trueline_method::solve::seam_chart::with_bows;
use trueline_method::stripe::frames::{Sight, frames};
use trueline_method::stripe::problem::StripeProblem;
use trueline_method::stripe::start::{held, start};
use trueline_method::stripe::whitening::{SharedNoise, weigh};
use trueline_method::{Config, Measurements, Parameters, SensorMode, calibrate};
use trueline_model::SheetShape;
use trueline_sim::motion::Motion;
use trueline_sim::{Plates, Preset, Scenario, Sine, random_cell, scan_plates_along};

/// A motion, and the study's bounds as it prints them: of seam points, both plates and one plate.
struct Row {
    name: &'static str,
    scenario: Scenario,
    sensor: SensorMode,
    /// Rotation of the sensor about the seam halfway, rad.
    turned_rad: f64,
    studied: [&'static str; 3],
}

/// Information of one scan on a target.
#[derive(Clone, Copy)]
struct Shown {
    rank: usize,
    size: usize,
    /// Squares of the stated ± and of the error, if everything is determined.
    squares: Option<(Squares, Squares)>,
}

const USES: [&str; 3] = ["seam point", "both plates", "one plate"];

pub(crate) fn print(cells: u64) {
    println!("Rotation ° / translation mm / seam mm; {cells} random cells a row.\n");
    println!("| motion | of it | study's bound | said | achieved | rank |\n|---|---|---|---|---|---|");
    for row in rows() {
        let shown: Vec<[Option<Shown>; 3]> =
            (1..=cells).into_par_iter().map(|seed| of_cell(&row, seed)).collect();
        for (k, of) in USES.into_iter().enumerate() {
            let of_use: Vec<Shown> = shown.iter().filter_map(|shown| shown[k]).collect();
            print_line(row.name, of, row.studied[k], &of_use);
        }
    }
}

fn print_line(name: &str, of: &str, studied: &str, shown: &[Shown]) {
    let squares: Vec<(Squares, Squares)> = shown.iter().filter_map(|shown| shown.squares).collect();
    let figures = |of: &dyn Fn(&(Squares, Squares)) -> Squares| {
        if squares.len() < shown.len() || squares.is_empty() {
            return "–".to_owned();
        }
        let root = |k: usize| root_mean_of(&squares, |both| of(both).0[k]);
        format!("{:.4} / {:.4} / {:.4}", root(1).to_degrees(), root(2) * 1e3, root(3) * 1e3)
    };
    let mut ranks: Vec<(usize, usize)> = shown.iter().map(|shown| (shown.rank, shown.size)).collect();
    ranks.sort_unstable();
    ranks.dedup();
    let ranks: Vec<String> = ranks.iter().map(|(rank, size)| format!("{rank}/{size}")).collect();
    let (said, achieved) = (figures(&|both| both.0), figures(&|both| both.1));
    println!("| {name} | {of} | {studied} | {said} | {achieved} | {} |", ranks.join(", "));
}

fn rows() -> Vec<Row> {
    let row = |name, scenario: &Scenario, sensor, studied| Row {
        name,
        scenario: scenario.clone(),
        sensor,
        turned_rad: 0.0,
        studied,
    };
    let (fixed, free) = (SensorMode::Fixed, SensorMode::Free);
    let (paper, good) = (Preset::Paper.scenario(), Preset::Good.scenario());
    let constant = Preset::ConstantAttitude.scenario();
    let tilted = |deg: [f64; 3]| {
        let mut scenario = constant.clone();
        let tilts = scenario.scan.tilts.iter_mut().zip(deg);
        tilts.for_each(|(tilt, deg)| *tilt = Sine { amplitude: f64::to_radians(deg), ..*tilt });
        scenario
    };
    let two = row("two attitudes", &constant, fixed, ["10/11", "12/13", "8/10"]);
    vec![
        row(
            "S-scan 60 s",
            &paper,
            fixed,
            [".160 / .349 / .064", ".0086 / .022 / .0151", ".0062 / .288 / .287"],
        ),
        row("S-scan 60 s + h", &paper, free, [".69 / 1.57 / .346", ".0099 / .024 / .0175", "13/15"]),
        row("mild 10 s", &mild(), fixed, [".083 / .125 / .052", ".023 / .062 / .043", ".028 / .70 / .70"]),
        row("mild 10 s + h", &mild(), free, [".36 / .54 / .174", ".029 / .071 / .045", ""]),
        row(
            "about line and across, ±10°, 20 s",
            &tilted([10.0, 10.0, 0.0]),
            fixed,
            [".017 / .025 / .0102", ".0054 / .013 / .0084", ".0049 / .073 / .072"],
        ),
        row(
            "good 20 s",
            &good,
            fixed,
            [".0099 / .0154 / .0066", ".0031 / .0083 / .0055", ".0026 / .023 / .022"],
        ),
        row(
            "good 20 s + h",
            &good,
            free,
            [".0145 / .020 / .0088", ".0036 / .0090 / .0059", ".0037 / .024 / .023"],
        ),
        row("constant attitude, S", &constant, fixed, ["8/11", "10/13", "7/10"]),
        row(
            "along the line, constant attitude",
            &Preset::AlongLine.scenario(),
            fixed,
            ["5/11", "7/13", "5/10"],
        ),
        row("rotation about one axis", &tilted([0.0, 10.0, 0.0]), fixed, ["10/11", "12/13", "9/10"]),
        Row { turned_rad: 15_f64.to_radians(), ..two },
    ]
}

fn of_cell(row: &Row, seed: u64) -> [Option<Shown>; 3] {
    let scenario = random_cell(&row.scenario, seed, 0.1);
    let Some(recording) = recorded(row, &scenario, seed) else { return [None; 3] };
    let config = |measurements| Config { measurements, sensor: row.sensor, ..Config::noise_only() };
    let by_use = |measurements| calibrated(&recording, &config(measurements));
    let one = one_plate(&recording, &scenario, &config(Measurements::Stripe));
    [by_use(Measurements::Seam), by_use(Measurements::Stripe), one]
}

/// The scan, without the pictures that were taken while the sensor was turned.
fn recorded(row: &Row, scenario: &Scenario, seed: u64) -> Option<Recording> {
    let motion = Motion::new(scenario)?;
    let half_s = 0.5 * scenario.timing.duration_s;
    let line = *scenario.cell.lines.first()?;
    let turn = so3::exp(&(line.direction() * row.turned_rad));
    let turn = se3::from_parts(turn, line.anchor() - turn * line.anchor());
    let base_from_tool = |time_s: f64| -> Pose {
        let pose = motion.base_from_tool(time_s);
        if time_s > half_s { turn * pose } else { pose }
    };
    let mut recording = scan_plates_along(scenario, &Plates::default(), &base_from_tool, seed)?;
    if row.turned_rad != 0.0 {
        let half_ns = scenario.timing.start_ns + (half_s * 1e9) as i64;
        let still = |stamp_ns: i64| (stamp_ns - half_ns).abs() > 100_000_000;
        recording.features.retain(|feature| still(feature.stamp_ns));
        recording.stripes.retain(|stripe| still(stripe.stamp_ns));
    }
    Some(recording)
}

fn calibrated(recording: &Recording, config: &Config) -> Option<Shown> {
    let guess = recording.truth.as_ref()?.parameters;
    let calibration = calibrate(recording, Some(&guess), config).ok()?;
    let observability = &calibration.findings.unknowns.observability;
    let (rank, size) = (observability.rank, observability.size);
    let all_seen = observability.unobservable.is_empty();
    let squares =
        cell(recording, &calibration, None).filter(|_| all_seen).map(|cell| (cell.said, cell.error));
    Some(Shown { rank, size, squares })
}

/// The support points of plate 0 alone, without an edge: the same problem with plate 1 held.
fn one_plate(recording: &Recording, scenario: &Scenario, config: &Config) -> Option<Shown> {
    let truth = recording.truth.as_ref()?;
    let sampling = Sampling::of(recording, observations::origin_ns(recording));
    let observed = observations::observe(recording, &sampling, config).ok()?;
    let straight = Parameters::straight(&truth.parameters, truth.lines.clone());
    let usable = UsableObservations::within(&observed, straight.time_offset_s, 0.0);
    let line = with_bows(&observed, usable.of(&observed), straight);
    let shape_prior = ShapeKnowledge::of(recording, &observed).prior(config);
    let shape = shape_prior.map(|_| SheetShape::exact_about(&observed.shape_origin_m.into()));
    let mut frames = frames(recording, &observed, config.measurements, config).ok()?;
    let mut at = start(&observed, &frames, &line, shape).ok()?;
    at.joints[0].seen = [true, false];
    for frame in &mut frames.list {
        frame.edge = None;
        if let Sight::Stripes([_, other]) = &mut frame.sight {
            *other = None;
        }
    }
    let left = observed.robot.noise_m / scenario.disturbance.robot_position_noise_m;
    let levels = NoiseLevels {
        robot_sigma_m: observed.robot.noise_m,
        stamp_sigma_s: scenario.disturbance.frame_jitter_s,
        factor: 1.0,
    };
    let robot_sigma_rad = scenario.disturbance.robot_rotation_noise_rad * left;
    let weighed =
        weigh(&observed, &frames.list, &at, &SharedNoise { levels, robot_sigma_rad }, &config.final_loss());
    let unknowns = at.unknowns();
    let fixed = held(&at, &[]);
    let problem = StripeProblem { observations: &observed, frames: weighed.frames, unknowns, shape_prior };
    let solution = solve(&problem, at, &fixed, &SolveOptions::default()).ok()?;
    let known = unknowns.surface(0, 0).start..unknowns.dimension();
    let information =
        Information::beside(&solution.equations.hessian, &fixed, known.clone(), RANK_THRESHOLD)?;
    let (rank, size) = (information.rank() - known.len(), information.size() - known.len());
    let all_seen = rank == size;
    let squares = || {
        let covariance = information.covariance();
        let found = Parameters {
            time_offset_s: solution.state.time_offset_s,
            tool_from_camera: solution.state.tool_from_camera,
            lines: Vec::new(),
            curvatures: Vec::new(),
            shape: solution.state.shape,
        };
        let off: SVector<f64, UNKNOWNS> = found.minus(&truth.parameters);
        let kept: Vec<usize> = (0..UNKNOWNS).chain(unknowns.shape()).collect();
        let kept = DMatrix::from_fn(kept.len(), kept.len(), |i, j| covariance[(kept[i], kept[j])]);
        let sum = |first: usize, of: &dyn Fn(usize) -> f64| (first..first + 3).map(of).sum::<f64>();
        let squares = |of: &dyn Fn(usize) -> f64, seam| Squares([of(0), sum(1, of), sum(4, of), seam]);
        let (said, error) = seam(recording, &found, &kept)?;
        Some((squares(&|k| kept[(k, k)], said), squares(&|k| off[k].powi(2), error)))
    };
    Some(Shown { rank, size, squares: all_seen.then(squares).flatten() })
}
