//! How the seams of a part scatter from piece to piece, learnt from the pieces.
//!
//! Piece i has its seams at ℓ_i = μ + A ψ_i + e_i. Its place varies, ψ ~ N(0, Ω) with any 6×6 Ω. Each seam
//! varies independently, e ~ N(0, T) with one variance for turns and one for offsets. Measured is ℓ̂_i ~
//! N(ℓ_i, R_i). Ω and T by expectation and maximisation; P = A Ω Aᵀ + T.
//!
//! It also includes the scatter of single pieces beyond their evidence. Effects that are constant within a weld and
//! different in the next (the form of a seam, a warm robot) contain no information about the calibration. It is
//! learnt as one factor for each kind of change, never below one.

use super::change::VISIBLE;
use crate::innovation::WeldStatistic;
use crate::parameters::{CALIBRATION, Kind, UNITS};
use crate::quadratic::Quadratic;
use crate::reference::Part;
use nalgebra::{DMatrix, DVector};

/// Scatter of one part, learnt from its pieces.
#[derive(Clone, Debug, PartialEq)]
pub struct Scatter {
    /// P: covariance of the seams' (θ₂, θ₃, δ₂, δ₃) from piece to piece, SI.
    pub covariance: DMatrix<f64>,
    /// Number of pieces that it was learnt from.
    pub pieces: usize,
    /// Variance of single pieces relative to their evidence, by kind, in the order of [`Kind::ALL`]; at least one.
    pub dispersion: [f64; 4],
}

/// Numbers of pieces after which scatter is learnt again: doubled each time.
pub(crate) const LESSONS: [usize; 5] = [30, 60, 120, 240, 480];

/// Scatter below this part of a unit (5 µm, 0.0025°) is treated as none.
const FLOOR: f64 = 0.05;
const ROUNDS: usize = 80;
const SETTLED: f64 = 1e-3;

/// Number of pieces the scatter is learnt from; `None` if there are too few.
#[must_use]
pub(crate) fn lesson(pieces: usize) -> Option<usize> {
    LESSONS.into_iter().rev().find(|lesson| *lesson <= pieces)
}

/// Learns from pieces of one part between which nothing changed.
#[must_use]
pub fn learnt(pieces: &[&WeldStatistic], part: &Part) -> Option<Scatter> {
    let measured: Vec<Measured> = pieces.iter().filter_map(|piece| Measured::of(piece)).collect();
    if measured.len() < LESSONS[0] {
        return None;
    }
    let units = seam_units(part.lines.len());
    let map = DMatrix::from_fn(units.len(), 6, |i, j| {
        part.seams_from_placement()[(i, j)] * UNITS[CALIBRATION + j] / units[i]
    });
    let mut model = Model::first(&measured, map);
    for _ in 0..ROUNDS {
        let next = model.improved(&measured)?;
        let moved = (&next.covariance() - &model.covariance()).norm() / model.covariance().norm();
        model = next;
        if moved < SETTLED {
            break;
        }
    }
    let scale = DMatrix::from_diagonal(&DVector::from_vec(units));
    Some(Scatter {
        covariance: &scale * model.covariance() * &scale,
        pieces: measured.len(),
        dispersion: dispersion(pieces),
    })
}

/// Units of the seams' unknowns.
fn seam_units(seams: usize) -> Vec<f64> {
    let (length, angle) = (UNITS[CALIBRATION], UNITS[CALIBRATION + 3]);
    [angle, angle, length, length].repeat(seams)
}

/// Place of a piece's seams by the stored calibration, in units, and its uncertainty.
struct Measured {
    place: DVector<f64>,
    information: DMatrix<f64>,
}

impl Measured {
    fn of(piece: &WeldStatistic) -> Option<Self> {
        let seams = piece.seams();
        let own: Vec<usize> = (CALIBRATION..CALIBRATION + 4 * seams).collect();
        let evidence = piece.evidence.restricted(&own).in_units(&seam_units(seams));
        let place = evidence.matrix.clone().cholesky()?.solve(&evidence.vector);
        Some(Self { place, information: evidence.matrix })
    }
}

struct Model {
    map: DMatrix<f64>,
    mean: DVector<f64>,
    part: DMatrix<f64>,
    /// Variances of turns and offsets.
    seam: [f64; 2],
}

impl Model {
    fn first(measured: &[Measured], map: DMatrix<f64>) -> Self {
        let n = measured.len() as f64;
        let mean = measured.iter().fold(DVector::zeros(map.nrows()), |sum, m| sum + &m.place) / n;
        let variance =
            measured.iter().map(|m| (&m.place - &mean).norm_squared()).sum::<f64>() / n / mean.len() as f64;
        let start = (0.5 * variance).max(FLOOR * FLOOR);
        Self { part: DMatrix::identity(6, 6) * start, map, mean, seam: [start; 2] }
    }

    fn own(&self) -> DMatrix<f64> {
        DMatrix::from_fn(self.map.nrows(), self.map.nrows(), |i, j| {
            if i == j { self.seam[usize::from(i % 4 >= 2)] } else { 0.0 }
        })
    }

    fn covariance(&self) -> DMatrix<f64> {
        &self.map * &self.part * self.map.transpose() + self.own()
    }

    /// One round of expectation and maximisation.
    fn improved(&self, measured: &[Measured]) -> Option<Self> {
        let n = measured.len() as f64;
        let precision = self.covariance().cholesky()?.inverse();
        let mut places = Vec::with_capacity(measured.len());
        let mut spread = DMatrix::zeros(self.map.nrows(), self.map.nrows());
        for m in measured {
            let covariance = (&m.information + &precision).cholesky()?.inverse();
            places.push(&covariance * (&m.information * &m.place + &precision * &self.mean));
            spread += covariance;
        }
        let mean = places.iter().fold(DVector::zeros(self.map.nrows()), |sum, place| sum + place) / n;
        // One of n degrees of freedom went into the mean.
        spread *= (n - 1.0) / n;
        for place in &places {
            let off = place - &mean;
            spread.ger(1.0, &off, &off, 1.0);
        }
        spread /= n - 1.0;
        let gain = &self.part * self.map.transpose() * &precision;
        let unexplained = &self.part - &gain * &self.map * &self.part;
        let part = &gain * &spread * gain.transpose() + &unexplained;
        let rest = DMatrix::identity(self.map.nrows(), self.map.nrows()) - &self.map * &gain;
        let own = &rest * &spread * rest.transpose() + &self.map * &unexplained * self.map.transpose();
        let mean_of = |offset: bool| {
            let of_kind = (0..own.nrows()).filter(|i| (i % 4 >= 2) == offset);
            of_kind.map(|i| own[(i, i)]).sum::<f64>() * 2.0 / own.nrows() as f64
        };
        let seam = [mean_of(false), mean_of(true)].map(|variance| variance.max(FLOOR * FLOOR));
        Some(Self { map: self.map.clone(), mean, part: (&part + part.transpose()) * 0.5, seam })
    }
}

/// Scatter of the estimates of single pieces, relative to the expected one.
fn dispersion(pieces: &[&WeldStatistic]) -> [f64; 4] {
    let within: Vec<Quadratic> =
        pieces.iter().map(|p| p.evidence.marginal(CALIBRATION).in_units(&UNITS[..CALIBRATION])).collect();
    Kind::ALL.map(|kind| {
        if kind == Kind::Seam {
            return 1.0;
        }
        let columns: Vec<usize> = kind.columns().collect();
        let own: Vec<Quadratic> = within.iter().map(|q| q.restricted(&columns)).collect();
        let mut sum = Quadratic::nothing(columns.len());
        own.iter().for_each(|q| sum.add(q));
        let mean = pseudo_solved(&sum.matrix, &sum.vector).0;
        let (mut squares, mut dimensions) = (0.0, 0);
        for q in &own {
            let off = &q.vector - &q.matrix * &mean;
            let (solved, rank) = pseudo_solved(&q.matrix, &off);
            squares += off.dot(&solved);
            dimensions += rank;
        }
        if dimensions == 0 {
            return 1.0;
        }
        let freedom = dimensions as f64 * (own.len() - 1) as f64 / own.len() as f64;
        let factor = squares / freedom;
        // χ² of f degrees of freedom strays from f by √(2f): less than three times that is chance.
        if factor > 1.0 + 3.0 * (2.0 / freedom).sqrt() { factor } else { 1.0 }
    })
}

/// H⁺ b and the rank, in the directions visible in a single piece: [`VISIBLE`] or more.
fn pseudo_solved(matrix: &DMatrix<f64>, vector: &DVector<f64>) -> (DVector<f64>, usize) {
    let eigen = matrix.clone().symmetric_eigen();
    let shown = |value: f64| value > VISIBLE;
    let inverse = eigen.eigenvalues.map(|value| if shown(value) { value.recip() } else { 0.0 });
    let along = (eigen.eigenvectors.transpose() * vector).component_mul(&inverse);
    (&eigen.eigenvectors * along, eigen.eigenvalues.iter().filter(|value| shown(**value)).count())
}
