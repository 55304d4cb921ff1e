//! Second-order uncertainty of a scan that hardly determines a rotation: width and bend of the valley.
//!
//! A covariance is a first-order result. If a rotation is known only to a few degrees, the correlated translation follows a curve. The worst
//! rotation is therefore moved by ± its standard deviation, and everything else is re-estimated. The cost gives the width of the valley. The other
//! unknowns give its bend.

use crate::adjustment::adjust::Adjustment;
use crate::adjustment::sights::{Frame, Sights, State};
use crate::adjustment::table::Table;
use crate::problem::parameters::{ROTATION, TRANSLATION};
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

/// A rotation known better than this adds less than a tenth of the uncertainty in second order, rad: 1.5°.
const WELL_KNOWN_RAD: f64 = 0.026;
/// Steps of the other unknowns at a moved rotation.
const STEPS: usize = 3;
/// The cost grows by one over a standard deviation. Below this growth the valley is wider than three standard deviations and its width is undefined.
const LEAST_GROWTH: f64 = 1.0 / 9.0;
/// Mean square of s² for a standard normal s.
const MEAN_FOURTH_POWER: f64 = 3.0;

/// Second-order contributions to the covariance of the tangent.
pub(crate) struct BeyondLinear {
    /// Along the valley, a column over the tangent's components.
    pub wider: DVector<f64>,
    /// Bend of the valley over a standard deviation, likewise. It affects single unknowns and no seam point, because seam points are constant along
    /// the valley.
    pub bends: DVector<f64>,
}

/// The least certain rotation.
struct Worst {
    /// Its axis, in the tool's axes.
    axis: Vector3<f64>,
    /// Motion of the free columns with it, for one standard deviation.
    along: DVector<f64>,
}

/// One side of the valley.
struct Side {
    /// Growth of the cost.
    growth: f64,
    /// Motion of the free columns with the rotation, beyond that from the covariance.
    beyond: DVector<f64>,
}

impl<S: Sights<ROWS, LOCAL>, const ROWS: usize, const LOCAL: usize> Adjustment<S, ROWS, LOCAL> {
    /// The second order about an answer, from the covariance of its columns. `None` if every rotation is well known or held.
    #[must_use]
    pub(crate) fn beyond_linear(&mut self, covariance: &DMatrix<f64>) -> Option<BeyondLinear> {
        let worst = self.worst_rotation(covariance)?;
        let (at, frames) = (self.at.clone(), self.scan.frames(&self.at));
        let mut table = self.table(&frames);
        let sides = [1.0, -1.0].map(|sign| {
            let side = self.side(&mut table, &frames, &worst, sign);
            self.at.clone_from(&at);
            self.set_residuals(&mut table, &frames);
            side
        });
        let [Some(up), Some(down)] = sides else { return None };
        let growth = (0.5 * (up.growth + down.growth)).clamp(LEAST_GROWTH, 1.0);
        Some(BeyondLinear {
            wider: self.of_unknowns(&(worst.along * (growth.recip() - 1.0).sqrt())),
            bends: self.of_unknowns(&((up.beyond + down.beyond) * (0.5 * MEAN_FOURTH_POWER.sqrt()))),
        })
    }

    fn worst_rotation(&self, covariance: &DMatrix<f64>) -> Option<Worst> {
        let free = &self.columns.free;
        let first = free.binary_search(&ROTATION).ok()?;
        let is_free = (ROTATION..TRANSLATION).all(|component| free.binary_search(&component).is_ok());
        let own: Matrix3<f64> = is_free.then(|| covariance.fixed_view::<3, 3>(first, first).into())?;
        let eigen = own.symmetric_eigen();
        let sigma_rad = eigen.eigenvalues.max().sqrt();
        let axis = eigen.eigenvectors.column(eigen.eigenvalues.imax()).into_owned();
        let along = covariance.view((0, first), (free.len(), 3)) * axis / sigma_rad;
        (sigma_rad > WELL_KNOWN_RAD).then_some(Worst { axis, along })
    }

    /// Moves the rotation by its standard deviation to one side and re-estimates everything else with the columns held.
    fn side(
        &mut self,
        table: &mut Table<ROWS>,
        frames: &[Option<Frame<ROWS, LOCAL>>],
        worst: &Worst,
        sign: f64,
    ) -> Option<Side> {
        let whitened = self.whitened(table);
        let sums = |table: &Table<ROWS>, residual: usize| {
            std::array::from_fn(|direction| table.sums(&whitened[direction], direction, residual))
        };
        let residual = self.columns.estimated();
        let begun = self.equations(&sums(table, residual));
        let factors = begun.factors(&self.prior(), self.columns.free.len())?;
        let least = begun.square_of_blocks(&factors, &self.prior());
        let rotation = self.columns.free.binary_search(&ROTATION).ok()?;
        let turned = |step: &DVector<f64>| worst.axis.dot(&step.fixed_rows::<3>(rotation));
        let of_worst = turned(&worst.along);
        let mut beyond = DVector::zeros(worst.along.len());
        self.at = self.at.retract(&self.of_unknowns(&(&worst.along * sign)));
        self.set_residuals(table, frames);
        for _ in 0..STEPS {
            let solved = self.equations(&sums(table, residual)).solve_with(&factors, &self.prior());
            let free = solved.step.rows(0, worst.along.len()).into_owned();
            let beside = &free - &worst.along * (turned(&free) / of_worst);
            self.at = self.at.retract(&self.of_unknowns(&beside));
            self.set_residuals(table, frames);
            beyond += beside;
        }
        let there = self.equations(&sums(table, residual)).square_of_blocks(&factors, &self.prior());
        Some(Side { growth: there - least, beyond })
    }
}
