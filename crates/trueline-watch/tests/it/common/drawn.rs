//! Pieces of a production that are drawn from the information of one: exact where the model is linear, and a thousand times as fast as
//! recordings.
#![allow(dead_code, clippy::unwrap_used, reason = "each user needs a part of it, and fails by panicking")]

use nalgebra::{DMatrix, DVector};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use trueline_sim::production::{PlacementScatter, Production, piece};
use trueline_watch::innovation::{Weld, shape_origin_m};
use trueline_watch::parameters::CALIBRATION;
use trueline_watch::{Part, Reference, WeldStatistic};

/// A part, and what one piece of it says.
pub(crate) struct Drawn {
    pub part: Part,
    pub reference: Reference,
    statistic: WeldStatistic,
    root: DMatrix<f64>,
    scatter: PlacementScatter,
}

impl Drawn {
    pub(crate) fn of(production: &Production) -> Self {
        let first = piece(production, 0, 1);
        let guess = first.truth.as_ref().unwrap().parameters;
        let reference = Reference::of_value(guess, shape_origin_m(&first, &guess).unwrap());
        let weld = Weld::of(&first, &reference).unwrap();
        let part = Part { lines: weld.seams() };
        let statistic = weld.evidence(&part, &reference).unwrap().statistic;
        let eigen = statistic.evidence.matrix.clone().symmetric_eigen();
        let root = &eigen.eigenvectors
            * DMatrix::from_diagonal(&eigen.eigenvalues.map(|value| value.max(0.0).sqrt()));
        Self { part, reference, statistic, root, scatter: production.scatter }
    }

    /// A piece at an error θ of the calibration and a change ψ of the fixture, SI.
    pub(crate) fn piece(
        &self,
        theta: &DVector<f64>,
        fixture: &DVector<f64>,
        random: &mut ChaCha8Rng,
    ) -> WeldStatistic {
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
