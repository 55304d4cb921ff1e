//! The last k pieces against all before: evidence about a change at that place.
//!
//! Unknown are the error θ₀ of the stored calibration, the mean place ψ of each part, and the change δ of either. θ₀ has the
//! calibration's own covariance; ψ is free. Marginalising θ₀ and ψ leaves the generalised likelihood ratio of a change
//! whose level before is not known exactly: right from the first piece on, and with the usual one after many.

use super::piece::PieceInformation;
use crate::parameters::{ALL, CALIBRATION, Kind};
use crate::quadratic::Quadratic;
use nalgebra::DMatrix;
use std::ops::Range;

/// Lengths of the windows that are tried after each piece.
pub const WINDOWS: [usize; 9] = [1, 2, 4, 8, 16, 32, 64, 128, 256];

/// θ₀.
const LEVEL: Range<usize> = 0..CALIBRATION;
/// δ, columns as in [`crate::parameters`].
const CHANGE: usize = CALIBRATION;
const LEVEL_AND_CHANGE: usize = CHANGE + ALL;
/// And ψ of one part.
const WITH_PLACE: usize = LEVEL_AND_CHANGE + 6;

/// Sums over pieces of each part.
#[derive(Clone, Debug)]
pub struct Sums {
    evidence: Vec<Quadratic>,
    within: Quadratic,
    /// Degrees of freedom of the noise.
    pub freedom: f64,
    /// How many pieces.
    pub pieces: usize,
}

/// Evidence about a change: (θ₀, δ), and the part of it that does not depend on where seams lie: (θ₀, δ of θ).
#[derive(Clone, Debug)]
pub(crate) struct WindowEvidence {
    all: Quadratic,
    within: Quadratic,
    /// Degrees of freedom of the noise in the window.
    pub freedom: f64,
    /// Pieces in the window.
    pub pieces: usize,
}

impl Sums {
    /// Nothing of so many parts.
    #[must_use]
    pub fn nothing(parts: usize) -> Self {
        Self {
            evidence: vec![Quadratic::nothing(ALL); parts],
            within: Quadratic::nothing(CALIBRATION),
            freedom: 0.0,
            pieces: 0,
        }
    }

    /// Adds a piece.
    pub fn add(&mut self, piece: &PieceInformation) {
        if let Some(own) = self.evidence.get_mut(piece.part) {
            own.add(&piece.evidence);
        }
        self.within.add(&piece.within);
        self.freedom += piece.freedom;
        self.pieces += 1;
    }

    /// The rest of a sum when a part of it is taken away.
    #[must_use]
    pub fn without(&self, other: &Self) -> Self {
        Self {
            evidence: self.evidence.iter().zip(&other.evidence).map(|(a, b)| a.without(b)).collect(),
            within: self.within.without(&other.within),
            freedom: self.freedom - other.freedom,
            pieces: self.pieces - other.pieces,
        }
    }

    /// What these pieces say about θ₀, with its prior, wherever their parts lie.
    #[must_use]
    pub fn level(&self, prior: &Quadratic) -> Quadratic {
        let mut sum = prior.clone();
        self.evidence.iter().for_each(|own| sum.add(&own.marginal(CALIBRATION)));
        sum
    }
}

fn add_corner(sum: &mut Quadratic, other: &Quadratic) {
    let n = other.size();
    let mut corner = sum.matrix.view_mut((0, 0), (n, n));
    corner += &other.matrix;
    let mut rows = sum.vector.rows_mut(0, n);
    rows += &other.vector;
}

impl WindowEvidence {
    /// Evidence about a change between the pieces before and those inside of a window. The place of `part` may have changed;
    /// those of other parts have not.
    #[must_use]
    pub(crate) fn of(before: &Sums, inside: &Sums, part: usize, prior: &Quadratic) -> Self {
        let mut all = Quadratic::nothing(LEVEL_AND_CHANGE);
        add_corner(&mut all, prior);
        for (k, (old, new)) in before.evidence.iter().zip(&inside.evidence).enumerate() {
            let mut own = old.of_unknowns(&piece_from_unknowns(false, false));
            own.add(&new.of_unknowns(&piece_from_unknowns(true, k == part)));
            all.add(&own.marginal(LEVEL_AND_CHANGE));
        }
        let mut within = Quadratic::nothing(2 * CALIBRATION);
        add_corner(&mut within, prior);
        add_corner(&mut within, &before.within);
        let mut both = DMatrix::zeros(CALIBRATION, 2 * CALIBRATION);
        both.view_mut((0, 0), (CALIBRATION, CALIBRATION)).fill_with_identity();
        both.view_mut((0, CALIBRATION), (CALIBRATION, CALIBRATION)).fill_with_identity();
        within.add(&inside.within.of_unknowns(&both));
        Self { all, within, freedom: inside.freedom, pieces: inside.pieces }
    }

    /// Evidence about a change of one kind alone.
    #[must_use]
    pub(crate) fn about(&self, kind: Kind) -> Quadratic {
        alone(&self.all, kind)
    }

    /// The part of it that does not depend on where seams lie; `None` for a change of just that.
    #[must_use]
    pub(crate) fn within(&self, kind: Kind) -> Option<Quadratic> {
        (kind != Kind::Seam).then(|| alone(&self.within, kind))
    }
}

/// θ₀ marginalised, all other kinds held at no change.
fn alone(evidence: &Quadratic, kind: Kind) -> Quadratic {
    let columns = kind.columns();
    let own = CHANGE + columns.start..CHANGE + columns.end;
    let count = columns.len();
    evidence.restricted(&Quadratic::indices(&[own, LEVEL])).marginal(count)
}

/// (θ, ψ) of a piece from (θ₀, δ, ψ).
fn piece_from_unknowns(changed: bool, place_changed: bool) -> DMatrix<f64> {
    let mut map = DMatrix::zeros(ALL, WITH_PLACE);
    map.view_mut((0, 0), (CALIBRATION, CALIBRATION)).fill_with_identity();
    map.view_mut((CALIBRATION, LEVEL_AND_CHANGE), (6, 6)).fill_with_identity();
    if changed {
        map.view_mut((0, CHANGE), (CALIBRATION, CALIBRATION)).fill_with_identity();
    }
    if place_changed {
        map.view_mut((CALIBRATION, CHANGE + CALIBRATION), (6, 6)).fill_with_identity();
    }
    map
}
