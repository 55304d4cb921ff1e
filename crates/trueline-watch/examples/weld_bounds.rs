//! What one piece shows by itself: the Cramér–Rao bound of each column of θ if only that had changed, for the layouts of
//! `watch_table` and for the single welds of the published table.
//!
//! `cargo run -p trueline-watch --example weld_bounds`
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "an example prints, and fails by panicking")]

use nalgebra::{DMatrix, DVector, Vector3};
use trueline_sim::production::{Layout, Production, piece};
use trueline_sim::scenario::Sine;
use trueline_watch::innovation::{Weld, shape_origin_m};
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
/// What a unit of a column is in the unit of the table.
const UNIT: [f64; 9] = [0.1, 0.1, 0.1, 0.1, 0.05, 0.05, 0.05, 0.3, 0.3];

fn bounds(name: &str, production: &Production) {
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
    print!("| {name} | {} | {:.2} ", statistic.used, statistic.noise_factor);
    for ((column, _), unit) in SHOWN.iter().zip(UNIT) {
        let of = |matrix: &DMatrix<f64>| unit * matrix[(*column, *column)].max(1e-12).sqrt().recip();
        print!("| {:.3} ({:.3}) ", of(&all.evidence.matrix), of(&all.within.matrix));
    }
    println!("|");
}

fn main() {
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
    for layout in Layout::ALL {
        bounds(layout.name(), &layout.production());
    }
}
