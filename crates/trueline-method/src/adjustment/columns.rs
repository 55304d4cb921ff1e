//! The columns of the adjustment: free unknowns, blocks, the residual, and consider parameters.

use crate::adjustment::blocks::Block;
use crate::adjustment::sights::{FORMS, Frame, State};
use crate::input::shape_knowledge::ShapeCovariance;
use crate::problem::layout::Layout;
use nalgebra::{DVector, SMatrix, SVector, Vector3};

/// A consider parameter: known with a covariance that the scan does not improve.
#[derive(Clone, Debug)]
pub(crate) enum Considered {
    /// A held component of the tangent, with its standard deviation, SI.
    Held(usize, f64),
    /// The shape of a held sensor: five columns.
    Shape(ShapeCovariance),
    /// The radius of an edge whose outermost point the detector measures, m, and the mean view of each seam. A sensor nearer by the radius measures
    /// the same points. The scan therefore has no information on the radius.
    EdgeRadius { sigma_m: f64, mean_view: Vec<Vector3<f64>> },
    /// The square of a lag of the robot behind its recorded poses, s², with its unit. It is tested only and not part of the uncertainty. Beyond its
    /// delay τ a lag moves by τ² ÿ / 2: 1/(1 + sτ) = e^(−sτ) (1 + s²τ²/2 + …).
    SquaredLag(f64),
}

impl Considered {
    /// Its number of columns.
    pub(crate) fn columns(&self) -> usize {
        match self {
            Self::Held(..) | Self::EdgeRadius { .. } | Self::SquaredLag(_) => 1,
            Self::Shape(_) => 5,
        }
    }
}

/// The order of the columns.
#[derive(Clone)]
pub(crate) struct Columns<P: State> {
    layout: P::Layout,
    /// Components of the tangent that are estimated.
    pub free: Vec<usize>,
    /// The blocks, after the free components.
    pub blocks: Vec<Block>,
    /// The consider parameters, after the residual.
    pub considered: Vec<Considered>,
}

impl<P: State> Columns<P> {
    /// The columns of a state with held components.
    #[must_use]
    pub(crate) fn of(at: &P, fixed: &[usize], considered: Vec<Considered>) -> Self {
        let free = (0..at.dimension()).filter(|k| !fixed.contains(k)).collect();
        Self { layout: at.layout(), free, blocks: Vec::new(), considered }
    }

    /// Number of estimated columns. The residual follows them.
    #[must_use]
    pub(crate) fn estimated(&self) -> usize {
        self.blocks.last().map_or(self.free.len(), |block| block.columns.end)
    }

    /// All columns.
    #[must_use]
    pub(crate) fn width(&self) -> usize {
        self.estimated() + 1 + self.considered.iter().map(Considered::columns).sum::<usize>()
    }

    /// Fills the row of each residual of a frame, with the slope of the forms at these coefficients.
    pub(crate) fn fill<const ROWS: usize, const LOCAL: usize>(
        &self,
        frame: &Frame<ROWS, LOCAL>,
        coefficients: &DVector<f64>,
        rows: &mut [Vec<f64>; ROWS],
    ) {
        let by_unknowns = self.with_slopes(frame, coefficients);
        let estimated = self.estimated();
        for (row, numbers) in rows.iter_mut().enumerate() {
            numbers.fill(0.0);
            for (local, index) in self.layout.indices(frame.target) {
                if let Ok(column) = self.free.binary_search(&index) {
                    numbers[column] = by_unknowns[(row, local)];
                }
            }
            numbers[estimated] = frame.residual[row];
            self.fill_considered(frame, &by_unknowns, row, &mut numbers[estimated + 1..]);
        }
        for block in &self.blocks {
            block.fill(frame, rows);
        }
    }

    fn fill_considered<const ROWS: usize, const LOCAL: usize>(
        &self,
        frame: &Frame<ROWS, LOCAL>,
        by_unknowns: &SMatrix<f64, ROWS, LOCAL>,
        row: usize,
        numbers: &mut [f64],
    ) {
        let mut next = 0;
        for considered in &self.considered {
            match considered {
                Considered::Held(component, sigma) => {
                    let mut places = self.layout.indices(frame.target);
                    let local = places.find(|(_, index)| index == component).map(|(local, _)| local);
                    numbers[next] = local.map_or(0.0, |local| by_unknowns[(row, local)] * sigma);
                }
                Considered::EdgeRadius { sigma_m, mean_view } => {
                    let view = frame.towards_sensor - mean_view[frame.target];
                    numbers[next] = frame.by_shift.row(row).dot(&view.transpose()) * sigma_m;
                }
                Considered::SquaredLag(unit_s2) => {
                    numbers[next] = 0.5 * frame.by_lag[row] * unit_s2;
                }
                Considered::Shape(covariance) => {
                    let Some(root) = covariance.cholesky() else { continue };
                    let by_shape = by_unknowns.fixed_columns::<5>(P::LOCAL_SHAPE) * root.l();
                    for k in 0..5 {
                        numbers[next + k] = by_shape[(row, k)];
                    }
                }
            }
            next += considered.columns();
        }
    }

    /// The Jacobian by the unknowns, including the form's slope: a point that slides along the seam beyond its neighbours meets another form.
    fn with_slopes<const ROWS: usize, const LOCAL: usize>(
        &self,
        frame: &Frame<ROWS, LOCAL>,
        coefficients: &DVector<f64>,
    ) -> SMatrix<f64, ROWS, LOCAL> {
        let by_along = by_along(frame, self.slopes(frame, coefficients));
        frame.by_unknowns + by_along * frame.apart_by_unknowns.transpose()
    }

    /// Slope of the target's form at a frame, in each direction, dimensionless.
    #[must_use]
    pub(crate) fn slopes<const ROWS: usize, const LOCAL: usize>(
        &self,
        frame: &Frame<ROWS, LOCAL>,
        coefficients: &DVector<f64>,
    ) -> [f64; FORMS] {
        let mut steep = [0.0; FORMS];
        for block in &self.blocks {
            steep.iter_mut().zip(block.slope(frame, coefficients)).for_each(|(sum, own)| *sum += own);
        }
        steep.map(|slope| slope.clamp(-STEEPEST, STEEPEST))
    }
}

/// Residuals by a shift of the first place along a form of these slopes, 1/m.
#[must_use]
pub(crate) fn by_along<const ROWS: usize, const LOCAL: usize>(
    frame: &Frame<ROWS, LOCAL>,
    slopes: [f64; FORMS],
) -> SVector<f64, ROWS> {
    frame.by_form.iter().zip(slopes).map(|(by_form, slope)| by_form.column(0) * slope).sum()
}

/// Largest slope of a form that is used. The flank of a tack is steeper, but a straight line does not describe the motion along it.
const STEEPEST: f64 = 0.3;
