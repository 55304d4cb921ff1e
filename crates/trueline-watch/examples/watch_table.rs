//! The delays of the detector: pieces until a change is found, how often it is named rightly, and how often nothing is found
//! where nothing changed.
//!
//! One piece of each production is simulated as a recording and compressed; all further pieces are drawn from its
//! sufficient statistic, b = H x + N(0, H), with the place of the part and of its seams drawn anew each time. That is exact
//! where the model is linear, and a thousand times as fast. `tests/production.rs` goes through recordings.
//!
//! `cargo run -p trueline-watch --example watch_table -- RUNS PIECES [LAYOUT]`
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "an example prints, and fails by panicking")]

use nalgebra::{DMatrix, DVector, Matrix3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::collections::BTreeMap;
use trueline_dataset::Sensor;
use trueline_model::LaserSheet;
use trueline_sim::production::{Layout, PlacementScatter, piece};
use trueline_watch::detect::{Alarm, History, blindness, judge, scatter};
use trueline_watch::innovation::{Weld, shape_origin_m};
use trueline_watch::parameters::{CALIBRATION, Kind, UNITS};
use trueline_watch::{Part, PieceInformation, Quadratic, Reference, Scatter, WeldStatistic};

/// Pieces before the change; the scatter is learnt from them.
const BEFORE: usize = 60;
/// Pieces after it at most, unless said otherwise.
const AFTER: u64 = 64;
/// One standard deviation of the stored calibration, in units: a good scan's.
const CALIBRATED: [f64; CALIBRATION] =
    [0.09, 0.08, 0.08, 0.08, 0.06, 0.06, 0.06, 0.03, 0.03, 0.06, 0.05, 0.04];

struct Line {
    part: Part,
    statistic: WeldStatistic,
    root: DMatrix<f64>,
    scatter: PlacementScatter,
    tool_from_axes: Matrix3<f64>,
}

impl Line {
    fn of(layout: Layout) -> Self {
        let production = layout.production();
        let first = piece(&production, 0, 1);
        let guess = first.truth.as_ref().unwrap().parameters;
        let reference = Reference::of_value(guess, shape_origin_m(&first, &guess).unwrap());
        let weld = Weld::of(&first, &reference).unwrap();
        let part = Part { lines: weld.seams() };
        let statistic = weld.evidence(&part, &reference).unwrap().statistic;
        let eigen = statistic.evidence.matrix.clone().symmetric_eigen();
        let root = &eigen.eigenvectors
            * DMatrix::from_diagonal(&eigen.eigenvalues.map(|value| value.max(0.0).sqrt()));
        let Sensor::CameraLaser { laser_plane_in_camera, .. } = &first.sensor else {
            unreachable!("a camera")
        };
        let sheet = LaserSheet::from_plane(*laser_plane_in_camera);
        let [across, depth] = [0, 1].map(|k| sheet.axes().column(k).into_owned());
        let tool_from_camera = guess.tool_from_camera.rotation.to_rotation_matrix();
        let tool_from_axes = tool_from_camera * Matrix3::from_columns(&[across, across.cross(&depth), depth]);
        Self { part, statistic, root, scatter: production.scatter, tool_from_axes }
    }

    /// A piece at an error θ of the calibration and a change ψ of the fixture, SI.
    fn draw(&self, theta: &DVector<f64>, fixture: &DVector<f64>, random: &mut ChaCha8Rng) -> WeldStatistic {
        let mut normal = |sigma: f64| {
            let unit: f64 = StandardNormal.sample(random);
            unit * sigma
        };
        let place = DVector::from_fn(6, |k, _| {
            fixture[k] + normal(if k < 3 { self.scatter.translation_m } else { self.scatter.rotation_rad })
        });
        let mut seams = self.part.seams_from_placement() * place;
        for k in 0..seams.len() {
            seams[k] += if k % 4 >= 2 { normal(self.scatter.seam_m) } else { 0.0 };
        }
        let x = DVector::from_iterator(CALIBRATION + seams.len(), theta.iter().chain(seams.iter()).copied());
        let noise = DVector::from_fn(x.len(), |_, _| normal(1.0));
        let mut piece = self.statistic.clone();
        piece.evidence.vector = &piece.evidence.matrix * x + &self.root * noise;
        piece
    }
}

/// A change of θ or of the fixture, in units.
struct Case {
    name: &'static str,
    kind: Kind,
    column: usize,
    units: f64,
}

const fn case(name: &'static str, kind: Kind, column: usize, units: f64) -> Case {
    Case { name, kind, column, units }
}

const CASES: [Case; 13] = [
    case("time offset 0.5 ms", Kind::Timing, 0, 5.0),
    case("time offset 0.1 ms", Kind::Timing, 0, 1.0),
    case("bracket 0.1 mm, tool x", Kind::Bracket, 4, 1.0),
    case("bracket 0.1 mm, tool y", Kind::Bracket, 5, 1.0),
    case("bracket 0.1 mm, tool z", Kind::Bracket, 6, 1.0),
    case("bracket 0.05°, tool x", Kind::Bracket, 1, 1.0),
    case("bracket 0.05°, tool y", Kind::Bracket, 2, 1.0),
    case("bracket 0.05°, tool z (spin)", Kind::Bracket, 3, 1.0),
    case("sensor width 0.3 %", Kind::Sensor, 7, 1.0),
    case("sensor depth 0.3 %", Kind::Sensor, 8, 1.0),
    case("sensor keystone 1e-4/mm", Kind::Sensor, 10, 1.0),
    case("fixture 0.3 mm, base x", Kind::Seam, 12, 3.0),
    case("nothing", Kind::Seam, 12, 0.0),
];

struct Outcome {
    delay: Option<usize>,
    named: bool,
}

/// A production before anything changed, and what it has taught.
struct Taught<'a> {
    line: &'a Line,
    error: DVector<f64>,
    scatters: [Option<Scatter>; 1],
    pieces: Vec<PieceInformation>,
    prior: Quadratic,
}

impl<'a> Taught<'a> {
    fn by(line: &'a Line, random: &mut ChaCha8Rng) -> Self {
        let error = DVector::from_fn(CALIBRATION, |k, _| {
            let unit: f64 = StandardNormal.sample(random);
            unit * CALIBRATED[k] * UNITS[k]
        });
        let still = DVector::zeros(6);
        let before: Vec<WeldStatistic> = (0..BEFORE).map(|_| line.draw(&error, &still, random)).collect();
        let scatters = [scatter::learnt(&before.iter().collect::<Vec<_>>(), &line.part)];
        let variances = DVector::from_fn(CALIBRATION, |k, _| CALIBRATED[k].powi(-2));
        let prior =
            Quadratic { matrix: DMatrix::from_diagonal(&variances), vector: DVector::zeros(CALIBRATION) };
        let pieces =
            before.iter().map(|s| PieceInformation::of(s, 0, &line.part, scatters[0].as_ref())).collect();
        Self { line, error, scatters, pieces, prior }
    }

    fn alarm(&self, pieces: &[PieceInformation]) -> Option<Alarm> {
        judge(&History { pieces, prior: &self.prior, scatters: &self.scatters }, None).alarm
    }

    /// Welds on after a change until an alarm, at most so many pieces.
    fn after(&self, case: &Case, most: usize, random: &mut ChaCha8Rng) -> Outcome {
        let (mut theta, mut fixture) = (self.error.clone(), DVector::zeros(6));
        let change = case.units * UNITS[case.column];
        if case.column < CALIBRATION {
            theta[case.column] += change;
        } else {
            fixture[case.column - CALIBRATION] += change;
        }
        let mut pieces = self.pieces.clone();
        for after in 1..=most {
            let drawn = self.line.draw(&theta, &fixture, random);
            pieces.push(PieceInformation::of(&drawn, 0, &self.line.part, self.scatters[0].as_ref()));
            if let Some(alarm) = self.alarm(&pieces) {
                return Outcome { delay: Some(after), named: alarm.change.kind == case.kind };
            }
        }
        Outcome { delay: None, named: false }
    }
}

/// What a page about these welds would say they do not show.
fn blind(line: &Line, taught: &Taught<'_>) -> String {
    let sheet_axes = blindness::SensorAxes { tool_from_axes: line.tool_from_axes };
    let blind = blindness::blind_to(&taught.pieces, &sheet_axes);
    if blind.is_empty() { "nothing".to_owned() } else { blind.join(", ") }
}

fn table(line: &Line, runs: u64, most: usize) {
    let mut outcomes: Vec<Vec<Outcome>> = CASES.iter().map(|_| Vec::new()).collect();
    let (mut early, mut blinds) = (0, BTreeMap::new());
    for seed in 0..runs {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let taught = Taught::by(line, &mut random);
        early += usize::from(taught.alarm(&taught.pieces).is_some());
        *blinds.entry(blind(line, &taught)).or_insert(0) += 1;
        for (k, case) in CASES.iter().enumerate() {
            let mut random = ChaCha8Rng::seed_from_u64(1_000_000 + 1000 * k as u64 + seed);
            outcomes[k].push(taught.after(case, most, &mut random));
        }
    }
    println!("| change | median | 95 % | found | named rightly |\n|---|---|---|---|---|");
    for (case, outcomes) in CASES.iter().zip(&outcomes) {
        let mut delays: Vec<usize> = outcomes.iter().map(|o| o.delay.unwrap_or(usize::MAX)).collect();
        delays.sort_unstable();
        let at = |part: f64| match delays[((delays.len() - 1) as f64 * part).ceil() as usize] {
            usize::MAX => "–".to_owned(),
            delay => delay.to_string(),
        };
        let found = outcomes.iter().filter(|o| o.delay.is_some()).count();
        let named = outcomes.iter().filter(|o| o.named).count();
        println!("| {} | {} | {} | {found} | {named} |", case.name, at(0.5), at(0.95));
    }
    println!("alarms before any change: {early} of {runs}; said to be blind to (productions): {blinds:?}");
}

fn main() {
    let mut arguments = std::env::args().skip(1);
    let mut number = |default: u64| arguments.next().map_or(default, |text| text.parse().unwrap());
    let (runs, most) = (number(10), number(AFTER) as usize);
    let chosen = arguments.next();
    for layout in Layout::ALL.into_iter().filter(|l| chosen.as_ref().is_none_or(|name| l.name() == name)) {
        println!("\n{} ({runs} runs a row; not found within {most} pieces: –)", layout.name());
        table(&Line::of(layout), runs, most);
    }
}
