//! Some pieces against all others: evidence about a change between them.
//!
//! Unknown are the error θ₀ of the stored calibration, the mean place ψ of each part, and the change δ of
//! either. θ₀ has the calibration's own covariance; ψ is free. Marginalising θ₀ and ψ leaves the generalised
//! likelihood ratio of a change from a level that is not known exactly. It is right from the first piece on,
//! and becomes the usual one after many. If a change stands already, its amount is one more unknown, shared
//! by the pieces since then.

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
/// The change that stands already, the same columns.
const STANDING: usize = CHANGE + ALL;

/// Sums over pieces of each part.
#[derive(Clone, Debug)]
pub struct Sums {
    evidence: Vec<Quadratic>,
    within: Quadratic,
    /// Degrees of freedom of the noise.
    pub freedom: f64,
    /// Number of pieces.
    pub pieces: usize,
}

/// A standing change: the pieces since then, the changed quantities, and the part that may have moved.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Standing<'a> {
    /// The pieces since then that are not in the window.
    pub sums: &'a Sums,
    /// Cause of a change, in words.
    pub kind: Kind,
    /// The part that may be at another place.
    pub part: usize,
}

/// Evidence about a change: (θ₀, δ, standing changes), and the part of it that does not depend on where seams
/// lie: the same of θ alone.
#[derive(Clone, Debug)]
pub(crate) struct WindowEvidence {
    all: Quadratic,
    within: Quadratic,
    standing: Option<Kind>,
    /// Degrees of freedom of the noise in the window.
    pub freedom: f64,
    /// Pieces in the window.
    pub pieces: usize,
}

impl Sums {
    /// Zeros for a number of parts.
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

    /// These pieces and others.
    #[must_use]
    pub(crate) fn with(&self, other: &Self) -> Self {
        let mut evidence = self.evidence.clone();
        evidence.iter_mut().zip(&other.evidence).for_each(|(a, b)| a.add(b));
        let mut within = self.within.clone();
        within.add(&other.within);
        Self { evidence, within, freedom: self.freedom + other.freedom, pieces: self.pieces + other.pieces }
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

    /// Evidence of these pieces about θ₀, with its prior, wherever their parts lie.
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
    /// Evidence about a change between the pieces before and those inside of a window. `part` may be at another place; other
    /// parts are not.
    #[must_use]
    pub(crate) fn of(before: &Sums, inside: &Sums, part: usize, prior: &Quadratic) -> Self {
        Self::beyond(None, before, inside, part, prior)
    }

    /// The same on top of a standing change: the change since then.
    #[must_use]
    pub(crate) fn beyond(
        standing: Option<Standing<'_>>,
        before: &Sums,
        inside: &Sums,
        part: usize,
        prior: &Quadratic,
    ) -> Self {
        let shared = if standing.is_some() { STANDING + ALL } else { STANDING };
        let mut all = Quadratic::nothing(shared);
        add_corner(&mut all, prior);
        for (k, (old, new)) in before.evidence.iter().zip(&inside.evidence).enumerate() {
            let map =
                |changed: Option<bool>, stands: Option<bool>| piece_from_unknowns(shared, changed, stands);
            let mut own = old.of_unknowns(&map(None, None));
            let stands = standing.map(|change| change.part == k);
            own.add(&new.of_unknowns(&map(Some(k == part), stands)));
            if let Some(middle) = standing.and_then(|change| change.sums.evidence.get(k)) {
                own.add(&middle.of_unknowns(&map(None, stands)));
            }
            all.add(&own.marginal(shared));
        }
        Self {
            all,
            within: within(standing.map(|change| change.sums), before, inside, prior),
            standing: standing.map(|change| change.kind),
            freedom: inside.freedom,
            pieces: inside.pieces,
        }
    }

    /// Evidence about a change of one kind alone.
    #[must_use]
    pub(crate) fn about(&self, kind: Kind) -> Quadratic {
        self.alone(&self.all, kind, STANDING)
    }

    /// The part of it that does not depend on where seams lie; `None` for a change of just that.
    #[must_use]
    pub(crate) fn within(&self, kind: Kind) -> Option<Quadratic> {
        (kind != Kind::Seam).then(|| self.alone(&self.within, kind, 2 * CALIBRATION))
    }

    /// θ₀ and the amount of the standing change marginalised, all other kinds held at no change.
    fn alone(&self, evidence: &Quadratic, kind: Kind, standing_at: usize) -> Quadratic {
        let from = |at: usize, columns: Range<usize>| at + columns.start..at + columns.end;
        let own = from(CHANGE, kind.columns());
        let stands = self.standing.map_or(0..0, |kind| from(standing_at, kind.columns()));
        // A part's place is not information that a piece gives independently of its seams.
        let stands = if stands.end <= evidence.size() { stands } else { 0..0 };
        evidence.restricted(&Quadratic::indices(&[own, LEVEL, stands])).marginal(kind.columns().len())
    }
}

/// (θ₀, δ of θ, standing change of θ), independent of the seams' places.
fn within(standing: Option<&Sums>, before: &Sums, inside: &Sums, prior: &Quadratic) -> Quadratic {
    let blocks = if standing.is_some() { 3 } else { 2 };
    let map = |own: &[usize]| {
        let mut map = DMatrix::zeros(CALIBRATION, blocks * CALIBRATION);
        for block in own {
            map.view_mut((0, block * CALIBRATION), (CALIBRATION, CALIBRATION)).fill_with_identity();
        }
        map
    };
    let mut sum = Quadratic::nothing(blocks * CALIBRATION);
    add_corner(&mut sum, prior);
    add_corner(&mut sum, &before.within);
    match standing {
        Some(middle) => {
            sum.add(&middle.within.of_unknowns(&map(&[0, 2])));
            sum.add(&inside.within.of_unknowns(&map(&[0, 1, 2])));
        }
        None => sum.add(&inside.within.of_unknowns(&map(&[0, 1]))),
    }
    sum
}

/// (θ, ψ) of a piece from (`shared` unknowns, ψ): its place after the change or after the standing one, and
/// whether that is a place of its own.
fn piece_from_unknowns(shared: usize, changed: Option<bool>, stands: Option<bool>) -> DMatrix<f64> {
    let mut map = DMatrix::zeros(ALL, shared + 6);
    map.view_mut((0, 0), (CALIBRATION, CALIBRATION)).fill_with_identity();
    map.view_mut((CALIBRATION, shared), (6, 6)).fill_with_identity();
    for (at, place) in [(CHANGE, changed), (STANDING, stands)] {
        let Some(place) = place else { continue };
        map.view_mut((0, at), (CALIBRATION, CALIBRATION)).fill_with_identity();
        if place {
            map.view_mut((CALIBRATION, at + CALIBRATION), (6, 6)).fill_with_identity();
        }
    }
    map
}
