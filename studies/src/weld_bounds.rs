//! Information of one piece: the Cramér–Rao bound of each column of θ if only this column changed, for the layouts of
//! `watch_table` and for the single welds of the published table; and the earliest possible alarm by these numbers.
//!
//! `cargo run --release -p trueline-studies -- weld_bounds`
#![allow(clippy::unwrap_used, reason = "a study fails by panicking")]

use nalgebra::{DMatrix, DVector, Vector3};
use trueline_sim::Plates;
use trueline_sim::production::{Layout, Production, piece};
use trueline_sim::scenario::Sine;
use trueline_watch::detect::change::VISIBLE;
use trueline_watch::detect::history::ALARM_P_LOG10;
use trueline_watch::detect::tail::log10_probability;
use trueline_watch::innovation::{Weld, shape_origin_m};
use trueline_watch::parameters::Kind;
use trueline_watch::{Part, PieceInformation, Reference, Scatter};

/// Columns of θ that are shown, with the unit of the table.
const SHOWN: [(usize, &str); 9] = [
    (0, "td ms"),
    (4, "tx mm"),
    (5, "ty mm"),
    (6, "tz mm"),
    (1, "rx °"),
    (2, "ry °"),
    (3, "rz °"),
    (7, "width %"),
    (8, "depth %"),
];
/// Unit of a column in the unit of the table.
const UNIT: [f64; 9] = [0.1, 0.1, 0.1, 0.1, 0.05, 0.05, 0.05, 0.3, 0.3];

fn bounds(name: &str, production: &Production) {
    let (features, noise, all) = shown(production);
    print!("| {name} | {features} | {noise:.2} ");
    for ((column, _), unit) in SHOWN.iter().zip(UNIT) {
        let of = |matrix: &DMatrix<f64>| unit * matrix[(*column, *column)].max(1e-12).sqrt().recip();
        print!("| {:.3} ({:.3}) ", of(&all.evidence.matrix), of(&all.within.matrix));
    }
    println!("|");
}

/// Information of a piece, with its number of features and its noise.
fn shown(production: &Production) -> (usize, f64, PieceInformation) {
    let first = piece(production, 0, 1);
    let guess = first.truth.as_ref().unwrap().parameters;
    let reference = Reference::of_value(guess, shape_origin_m(&first, &guess).unwrap());
    let weld = Weld::of(&first, &reference).unwrap();
    let part = Part { lines: weld.seams() };
    let statistic = weld.evidence(&part, &reference).unwrap().statistic;
    let scatter = production.scatter;
    let place =
        DVector::from_fn(
            6,
            |k, _| {
                if k < 3 { scatter.translation_m.powi(2) } else { scatter.rotation_rad.powi(2) }
            },
        );
    let map = part.seams_from_placement();
    let mut covariance = &map * DMatrix::from_diagonal(&place) * map.transpose();
    for k in 0..covariance.nrows() {
        covariance[(k, k)] += if k % 4 >= 2 { scatter.seam_m.powi(2) } else { 1e-10 };
    }
    let known = Scatter { covariance, pieces: 1_000_000, dispersion: [1.0; 4] };
    let all = PieceInformation::of(&statistic, 0, &part, Some(&known));
    (statistic.used, statistic.noise_factor, all)
}

/// Pieces before a change that have taught the level, as in `watch_table`.
const BEFORE: f64 = 60.0;
/// Pieces after it at most.
const MOST: usize = 1000;

/// Changes of a tenth of a millimetre and a twentieth of a degree, with their columns.
const CHANGES: [(usize, &str); 7] = [
    (0, "0.1 ms"),
    (4, "0.1 mm x"),
    (5, "0.1 mm y"),
    (6, "0.1 mm z"),
    (1, "0.05° x"),
    (2, "0.05° y"),
    (3, "0.05° z (spin)"),
];

/// Number of pieces after which the statistic of all pieces since a change exceeds the limit of an alarm with a probability,
/// for a known scatter. A detector that asks after each piece may find slow ones somewhat sooner, by luck.
fn pieces_until(squared_a_piece: f64, dimensions: usize, probability: f64) -> Option<usize> {
    if dimensions == 0 {
        return None;
    }
    let limit = limit(dimensions);
    (1..=MOST).find(|pieces| {
        let pieces = *pieces as f64;
        let squared = squared_a_piece / (1.0 / pieces + 1.0 / BEFORE);
        beyond(limit, dimensions, squared) >= probability
    })
}

/// The sum of squares at which an alarm is raised.
fn limit(dimensions: usize) -> f64 {
    let (mut low, mut high) = (0.0, 1000.0);
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        let is_alarm = log10_probability(middle, dimensions, f64::INFINITY) <= ALARM_P_LOG10;
        if is_alarm { high = middle } else { low = middle }
    }
    high
}

/// P(χ² > q) where the mean's square is `squared`: a Poisson mixture of central distributions \[Abramowitz1964, 26.4.25\].
fn beyond(q: f64, dimensions: usize, squared: f64) -> f64 {
    if squared > 1000.0 {
        // Twenty standard deviations beyond any limit; the sum below would begin at less than the smallest number.
        return 1.0;
    }
    let half = 0.5 * squared;
    let mut weight = (-half).exp();
    let mut sum = 0.0;
    for j in 0..2000 {
        sum += weight * 10f64.powf(log10_probability(q, dimensions + 2 * j, f64::INFINITY));
        weight *= half / (j + 1) as f64;
    }
    sum
}

fn quickest(name: &str, all: &PieceInformation) {
    print!("| {name} ");
    for (column, _) in CHANGES {
        let kind = Kind::ALL.into_iter().find(|kind| kind.columns().contains(&column)).unwrap();
        let shown =
            all.evidence.restricted(&kind.columns().collect::<Vec<_>>()).matrix.symmetric_eigenvalues();
        let dimensions = shown.iter().filter(|value| **value > VISIBLE).count();
        let squared = all.evidence.matrix[(column, column)];
        let [half, most] = [0.5, 0.95].map(|part| {
            pieces_until(squared, dimensions, part)
                .map_or_else(|| "–".to_owned(), |pieces| pieces.to_string())
        });
        print!("| {half} ({most}) ");
    }
    println!("|");
}

pub(crate) fn run(_: &[String]) -> Result<(), String> {
    print!("| weld | features | noise ");
    SHOWN.iter().for_each(|(_, name)| print!("| {name} "));
    println!("|\n|{}", "---|".repeat(SHOWN.len() + 3));
    let one = Layout::OneSeam.production();
    let sine = |amplitude, frequency_hz, phase_rad| Sine { amplitude, frequency_hz, phase_rad };
    let three = 3f64.to_radians();
    let none = [Sine::default(); 3];
    let tilted = [sine(three, 0.23, 0.5), sine(three, 0.17, 2.0), sine(three, 0.13, 4.0)];
    bounds("straight", &Production { tilts: none, ..one.clone() });
    bounds("3° of tilt", &Production { tilts: tilted, ..one.clone() });
    let about_camera = Production { tilts: tilted, pivot_m: Some(Vector3::zeros()), ..one.clone() };
    bounds("3° of tilt about the camera", &about_camera);
    bounds("weave", &Production { tilts: none, weave: sine(0.003, 2.0, 0.0), ..one });
    let striped = |layout: Layout| Production { plates: Some(Plates::default()), ..layout.production() };
    for layout in Layout::ALL {
        bounds(layout.name(), &layout.production());
        bounds(&format!("{}, stripes", layout.name()), &striped(layout));
    }
    println!(
        "\nPieces until the sum of all since a change is beyond the limit, scatter known: in half of all cases (in 95 %)"
    );
    print!("| layout ");
    CHANGES.iter().for_each(|(_, name)| print!("| {name} "));
    println!("|\n|{}", "---|".repeat(CHANGES.len() + 1));
    for layout in Layout::ALL {
        quickest(layout.name(), &shown(&layout.production()).2);
        quickest(&format!("{}, stripes", layout.name()), &shown(&striped(layout)).2);
    }
    Ok(())
}
