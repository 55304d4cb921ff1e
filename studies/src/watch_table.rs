//! Delays of the detector: pieces until a change is found, how often it is named rightly, and how often nothing is found
//! without a change.
//!
//! One piece of each production is simulated as a recording and compressed. All further pieces are drawn from its sufficient
//! statistic, b = H x + N(0, H), with the place of the part and of its seams drawn anew each time. This is exact for a
//! linear model, and a thousand times faster. `tests/production.rs` of `trueline-watch` goes through recordings.
//!
//! `cargo run --release -p trueline-studies -- watch_table [RUNS [PIECES [LAYOUT [CHANGE]]]]`. A LAYOUT with `-swung` at
//! its end turns the camera about itself instead of the seam's point; one with `-stripes` has both plates' whole stripes.
//! CHANGE is the beginning of a row's name.

#[path = "../../crates/trueline-watch/tests/it/common/drawn.rs"]
mod drawn;

use crate::arguments::{number, word};
use drawn::Drawn;
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::collections::BTreeMap;
use trueline_dataset::Sensor;
use trueline_model::LaserSheet;
use trueline_sim::Plates;
use trueline_sim::production::{Layout, Production, piece};
use trueline_watch::detect::sensor_axes::SensorAxes;
use trueline_watch::detect::{Alarm, History, blindness, judge, scatter};
use trueline_watch::parameters::{CALIBRATION, Kind, TRANSLATION, UNITS};
use trueline_watch::{PieceInformation, Quadratic, Scatter, WeldStatistic};

/// Pieces before the change; the scatter is learnt from them.
const BEFORE: usize = 60;
/// Largest number of pieces after it, unless stated otherwise.
const AFTER: usize = 64;
/// One standard deviation of the stored calibration, in units: a good scan's.
const CALIBRATED: [f64; CALIBRATION] =
    [0.09, 0.08, 0.08, 0.08, 0.06, 0.06, 0.06, 0.03, 0.03, 0.06, 0.05, 0.04];

struct Line {
    drawn: Drawn,
    tool_from_axes: Matrix3<f64>,
    /// How deep in the sheet the welds lie, from the sensor, m.
    depth_m: f64,
}

impl Line {
    fn of(production: &Production) -> Self {
        let drawn = Drawn::of(production);
        let sensor = piece(production, 0, 1).sensor;
        let Sensor::CameraLaser { laser_plane_in_camera, .. } = &sensor else { unreachable!("a camera") };
        let sheet = LaserSheet::from_plane(*laser_plane_in_camera);
        let [across, depth] = [0, 1].map(|k| sheet.axes().column(k).into_owned());
        let tool_from_camera = drawn.reference.guess.tool_from_camera.rotation.to_rotation_matrix();
        let tool_from_axes = tool_from_camera * Matrix3::from_columns(&[across, across.cross(&depth), depth]);
        let depth_m = drawn.reference.shape_origin_m[1];
        Self { drawn, tool_from_axes, depth_m }
    }
}

/// A change of θ or of the fixture, in units.
struct Case {
    name: &'static str,
    kind: Kind,
    column: usize,
    units: f64,
    /// The word of `watch` for an invisible change, if there is one for exactly this.
    blindness: Option<&'static str>,
}

const fn case(name: &'static str, kind: Kind, column: usize, units: f64) -> Case {
    Case { name, kind, column, units, blindness: None }
}

const fn said(blindness: &'static str, case: Case) -> Case {
    Case { blindness: Some(blindness), ..case }
}

/// Depths that are wrong in proportion to the distance from the sensor; its column is that of a change about the welds.
const FROM_SENSOR: &str = "sensor depth 0.3 %, from the sensor";

const CASES: [Case; 16] = [
    said("timing", case("time offset 0.5 ms", Kind::Timing, 0, 5.0)),
    said("timing", case("time offset 0.1 ms", Kind::Timing, 0, 1.0)),
    case("bracket 0.1 mm, tool x", Kind::Bracket, 4, 1.0),
    case("bracket 0.1 mm, tool y", Kind::Bracket, 5, 1.0),
    case("bracket 0.1 mm, tool z", Kind::Bracket, 6, 1.0),
    case("bracket 0.05°, tool x", Kind::Bracket, 1, 1.0),
    case("bracket 0.05°, tool y", Kind::Bracket, 2, 1.0),
    case("bracket 0.05°, tool z (spin)", Kind::Bracket, 3, 1.0),
    said("sensor width", case("sensor width 0.3 %", Kind::Sensor, 7, 1.0)),
    said("sensor depth", case("sensor depth 0.3 %, about the welds", Kind::Sensor, 8, 1.0)),
    case(FROM_SENSOR, Kind::Sensor, 8, 1.0),
    said("sensor keystone across", case("sensor keystone 1e-4/mm", Kind::Sensor, 10, 1.0)),
    case("fixture 0.3 mm, base x", Kind::Seam, 12, 3.0),
    case("fixture 1 mm, base x", Kind::Seam, 12, 10.0),
    case("fixture 1 mm, base y", Kind::Seam, 13, 10.0),
    case("nothing", Kind::Seam, 12, 0.0),
];

impl Case {
    /// The calibration's error and the fixture's change once it has happened, SI.
    fn applied(&self, line: &Line, error: &DVector<f64>) -> (DVector<f64>, DVector<f64>) {
        let (mut theta, mut fixture) = (error.clone(), DVector::zeros(6));
        let change = self.units * UNITS[self.column];
        if self.column < CALIBRATION {
            theta[self.column] += change;
        } else {
            fixture[self.column - CALIBRATION] += change;
        }
        if self.name == FROM_SENSOR {
            let mut shift = theta.rows_mut(TRANSLATION, 3);
            shift += line.tool_from_axes.column(2) * (change * line.depth_m);
        }
        (theta, fixture)
    }
}

struct Outcome {
    delay: Option<usize>,
    named: bool,
    /// Or named as a possible alternative to the finding.
    rival: bool,
}

/// A production before any change, and the knowledge from it.
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
        let before: Vec<WeldStatistic> =
            (0..BEFORE).map(|_| line.drawn.piece(&error, &still, random)).collect();
        let scatters = [scatter::learnt(&before.iter().collect::<Vec<_>>(), &line.drawn.part)];
        let variances = DVector::from_fn(CALIBRATION, |k, _| CALIBRATED[k].powi(-2));
        let prior =
            Quadratic { matrix: DMatrix::from_diagonal(&variances), vector: DVector::zeros(CALIBRATION) };
        let pieces = before
            .iter()
            .map(|s| PieceInformation::of(s, 0, &line.drawn.part, scatters[0].as_ref()))
            .collect();
        Self { line, error, scatters, pieces, prior }
    }

    fn alarm(&self, pieces: &[PieceInformation]) -> Option<Alarm> {
        judge(&History { pieces, prior: &self.prior, scatters: &self.scatters, regimes: &[] }, None).alarm
    }

    /// Welds after a change until an alarm, at most this many pieces.
    fn after(&self, case: &Case, most: usize, random: &mut ChaCha8Rng) -> Outcome {
        let (theta, fixture) = case.applied(self.line, &self.error);
        let mut pieces = self.pieces.clone();
        for after in 1..=most {
            let drawn = self.line.drawn.piece(&theta, &fixture, random);
            pieces.push(PieceInformation::of(&drawn, 0, &self.line.drawn.part, self.scatters[0].as_ref()));
            if let Some(alarm) = self.alarm(&pieces) {
                let rival = alarm.not_told_apart.contains(&case.kind);
                return Outcome { delay: Some(after), named: alarm.change.kind == case.kind, rival };
            }
        }
        Outcome { delay: None, named: false, rival: false }
    }
}

/// Hidden changes, as a page about these welds would report them.
fn blind(line: &Line, taught: &Taught<'_>) -> Vec<String> {
    let sheet_axes = SensorAxes { tool_from_axes: line.tool_from_axes };
    blindness::blind_to(&taught.pieces, &sheet_axes)
}

fn table(line: &Line, runs: u64, most: usize, rows: &[(usize, &Case)]) {
    let mut outcomes: Vec<Vec<Outcome>> = rows.iter().map(|_| Vec::new()).collect();
    let mut said_blind = vec![0; rows.len()];
    let (mut early, mut blinds) = (0, BTreeMap::new());
    for seed in 0..runs {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let taught = Taught::by(line, &mut random);
        early += usize::from(taught.alarm(&taught.pieces).is_some());
        let words = blind(line, &taught);
        for (row, (k, case)) in rows.iter().enumerate() {
            let says = |word: &String| word == case.kind.name() || Some(word.as_str()) == case.blindness;
            said_blind[row] += usize::from(words.iter().any(says));
            let mut random = ChaCha8Rng::seed_from_u64(1_000_000 + 1000 * *k as u64 + seed);
            outcomes[row].push(taught.after(case, most, &mut random));
        }
        *blinds.entry(words.join(", ")).or_insert(0) += 1;
    }
    println!("| change | median | 95 % | found | named rightly | or not told apart | said to be blind |");
    println!("|---|---|---|---|---|---|---|");
    for (((_, case), outcomes), said) in rows.iter().zip(&outcomes).zip(&said_blind) {
        let mut delays: Vec<usize> = outcomes.iter().map(|o| o.delay.unwrap_or(usize::MAX)).collect();
        delays.sort_unstable();
        let at = |part: f64| match delays[((delays.len() - 1) as f64 * part).ceil() as usize] {
            usize::MAX => "–".to_owned(),
            delay => delay.to_string(),
        };
        let count = |of: fn(&Outcome) -> bool| outcomes.iter().filter(|o| of(o)).count();
        let (found, named, rival) = (count(|o| o.delay.is_some()), count(|o| o.named), count(|o| o.rival));
        println!("| {} | {} | {} | {found} | {named} | {rival} | {said} |", case.name, at(0.5), at(0.95));
    }
    println!("alarms before any change: {early} of {runs}; said to be blind to (productions): {blinds:?}");
}

/// The production of a name.
fn production(name: &str) -> Option<Production> {
    let (name, is_striped) = name.strip_suffix("-stripes").map_or((name, false), |name| (name, true));
    let (name, is_swung) = name.strip_suffix("-swung").map_or((name, false), |name| (name, true));
    let layout = Layout::ALL.into_iter().find(|layout| layout.name() == name)?;
    let pivot_m = is_swung.then(Vector3::zeros);
    let plates = is_striped.then(Plates::default);
    Some(Production { pivot_m, plates, ..layout.production() })
}

pub(crate) fn run(arguments: &[String]) -> Result<(), String> {
    let runs: u64 = number(arguments, 0, 10)?;
    let most: usize = number(arguments, 1, AFTER)?;
    let all = Layout::ALL.map(|layout| layout.name().to_owned()).to_vec();
    let names = arguments.get(2).map_or(all, |name| vec![name.clone()]);
    let wanted = word(arguments, 3);
    let rows: Vec<(usize, &Case)> =
        CASES.iter().enumerate().filter(|(_, case)| case.name.starts_with(wanted)).collect();
    for name in names {
        let Some(production) = production(&name) else {
            let all = Layout::ALL.map(Layout::name).join(", ");
            return Err(format!(
                "no layout `{name}`; the layouts are {all}, each also with -swung and with -stripes"
            ));
        };
        println!("\n{name} ({runs} runs a row; not found within {most} pieces: –)");
        table(&Line::of(&production), runs, most, &rows);
    }
    Ok(())
}
