//! The delays of the detector: pieces until a change is found, how often it is named rightly, and how often nothing is found
//! where nothing changed.
//!
//! One piece of each production is simulated as a recording and compressed; all further pieces are drawn from its
//! sufficient statistic, b = H x + N(0, H), with the place of the part and of its seams drawn anew each time. That is exact
//! where the model is linear, and a thousand times as fast. `tests/production.rs` goes through recordings.
//!
//! `cargo run -p trueline-watch --example watch_table -- RUNS [LAYOUT]`
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "an example prints, and fails by panicking")]

use nalgebra::{DMatrix, DVector};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use trueline_sim::production::{Layout, PlacementScatter, piece};
use trueline_watch::detect::{History, judge, scatter};
use trueline_watch::innovation::{Weld, shape_origin_m};
use trueline_watch::parameters::{CALIBRATION, Kind, UNITS};
use trueline_watch::{Part, PieceInformation, Quadratic, Reference, Scatter, WeldStatistic};

/// Pieces before the change; the scatter is learnt from them.
const BEFORE: usize = 60;
/// Pieces after it at most.
const AFTER: usize = 64;
/// One standard deviation of the stored calibration, in units: a good scan's.
const CALIBRATED: [f64; CALIBRATION] =
    [0.09, 0.08, 0.08, 0.08, 0.06, 0.06, 0.06, 0.03, 0.03, 0.06, 0.05, 0.04];

struct Line {
    part: Part,
    statistic: WeldStatistic,
    root: DMatrix<f64>,
    scatter: PlacementScatter,
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
        Self { part, statistic, root, scatter: production.scatter }
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
    early: bool,
}

fn run(line: &Line, case: &Case, seed: u64) -> Outcome {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let error = DVector::from_fn(CALIBRATION, |k, _| {
        let unit: f64 = StandardNormal.sample(&mut random);
        unit * CALIBRATED[k] * UNITS[k]
    });
    let still = DVector::zeros(6);
    let before: Vec<WeldStatistic> = (0..BEFORE).map(|_| line.draw(&error, &still, &mut random)).collect();
    let learnt = scatter::learnt(&before.iter().collect::<Vec<_>>(), &line.part);
    let scatters: [Option<Scatter>; 1] = [learnt];
    let information =
        |statistic: &WeldStatistic| PieceInformation::of(statistic, 0, &line.part, scatters[0].as_ref());
    let mut pieces: Vec<PieceInformation> = before.iter().map(information).collect();
    let variances = DVector::from_fn(CALIBRATION, |k, _| CALIBRATED[k].powi(-2));
    let prior = Quadratic { matrix: DMatrix::from_diagonal(&variances), vector: DVector::zeros(CALIBRATION) };
    let judged = |pieces: &[PieceInformation]| {
        judge(&History { pieces, prior: &prior, scatters: &scatters }, None).alarm
    };
    let early = judged(&pieces).is_some();
    let (mut theta, mut fixture) = (error, still);
    let change = case.units * UNITS[case.column];
    if case.column < CALIBRATION {
        theta[case.column] += change;
    } else {
        fixture[case.column - CALIBRATION] += change;
    }
    for after in 1..=AFTER {
        pieces.push(information(&line.draw(&theta, &fixture, &mut random)));
        if let Some(alarm) = judged(&pieces) {
            return Outcome { delay: Some(after), named: alarm.change.kind == case.kind, early };
        }
    }
    Outcome { delay: None, named: false, early }
}

fn main() {
    let mut arguments = std::env::args().skip(1);
    let runs: u64 = arguments.next().map_or(10, |text| text.parse().unwrap());
    let chosen = arguments.next();
    for layout in Layout::ALL.into_iter().filter(|l| chosen.as_ref().is_none_or(|name| l.name() == name)) {
        let line = Line::of(layout);
        println!("\n{} ({runs} runs a row; not found within {AFTER}: –)", layout.name());
        println!("| change | median | 95 % | found | named rightly |\n|---|---|---|---|---|");
        for (k, case) in CASES.iter().enumerate() {
            let outcomes: Vec<Outcome> =
                (0..runs).map(|seed| run(&line, case, 1000 * k as u64 + seed)).collect();
            let mut delays: Vec<usize> = outcomes.iter().map(|o| o.delay.unwrap_or(usize::MAX)).collect();
            delays.sort_unstable();
            let at = |part: f64| match delays[((delays.len() - 1) as f64 * part).round() as usize] {
                usize::MAX => "–".to_owned(),
                delay => delay.to_string(),
            };
            let found = outcomes.iter().filter(|o| o.delay.is_some()).count();
            let named = outcomes.iter().filter(|o| o.named).count();
            let early = outcomes.iter().filter(|o| o.early).count();
            println!("| {} | {} | {} | {found} | {named} ({early} early) |", case.name, at(0.5), at(0.95));
        }
    }
}
