//! A production and its stored calibration, for tests.
#![allow(dead_code, clippy::unwrap_used, reason = "each test uses a part of it, and fails by panicking")]

pub(crate) mod drawn;

use nalgebra::{DMatrix, DVector};
use trueline_sim::production::{Production, piece};
use trueline_watch::innovation::{Evidence, Weld, shape_origin_m};
use trueline_watch::parameters::CALIBRATION;
use trueline_watch::{Part, PieceInformation, Quadratic, Reference};

/// A calibration that is exactly right, and known to be.
pub(crate) fn exact(production: &Production) -> Reference {
    let first = piece(production, 0, 1);
    let guess = first.truth.as_ref().unwrap().parameters;
    let mut reference = Reference::of_value(guess, shape_origin_m(&first, &guess).unwrap());
    reference.prior = Quadratic {
        matrix: DMatrix::identity(CALIBRATION, CALIBRATION) * 1e6,
        vector: DVector::zeros(CALIBRATION),
    };
    reference
}

/// The part as its first piece shows it.
pub(crate) fn part(production: &Production, reference: &Reference) -> Part {
    Part { lines: Weld::of(&piece(production, 0, 1), reference).unwrap().seams() }
}

/// The evidence of a piece.
pub(crate) fn evidence(
    production: &Production,
    reference: &Reference,
    part: &Part,
    number: usize,
    seed: u64,
) -> Evidence {
    Weld::of(&piece(production, number, seed), reference).unwrap().evidence(part, reference).unwrap()
}

/// The same without anything known of scatter.
pub(crate) fn information(evidence: &Evidence, part: &Part) -> PieceInformation {
    PieceInformation::of(&evidence.statistic, 0, part, None)
}
