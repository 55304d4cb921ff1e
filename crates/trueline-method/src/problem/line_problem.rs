//! Observations → problem: one whitened residual for each observation, with its Jacobian by the chain rule.

use crate::config::ResidualKind;
use crate::input::noise_levels::{NoiseLevels, Whitener};
use crate::input::observations::{Observation, Observations};
use crate::input::shape_prior::ShapePrior;
use crate::problem::packing::Packing;
use crate::problem::parameters::Parameters;
use crate::problem::placement::placement;
use crate::problem::prior::Prior;
use crate::problem::simd::{Cost, Equations, Mounting, Scan, Squared, Visit, Whitening, sweep, sweep_chunks};
use crate::problem::unknowns::{
    LINES, LOCAL_ALL, LOCAL_BOWED, LOCAL_STRAIGHT, Model, TIME_OFFSET, TRANSLATION, Unknowns,
};
use nalgebra::{DVector, Matrix2x3, SMatrix, Vector2};
use trueline_lsq::{LeastSquares, Loss, NormalEquations};
use trueline_model::point_to_line::{self, ResidualJacobian};
use trueline_model::{Placement, SeamInSheet, sheet_residual};

/// Initial standard deviation of the point-to-line residual, m, until its spread is estimated.
pub(crate) const POINT_TO_LINE_SIGMA_M: f64 = 5e-5;

/// The least-squares problem of a scan.
pub struct LineProblem<'a> {
    /// Trajectory and sheet.
    pub observations: &'a Observations,
    /// The observations used, by rising stamp.
    pub list: &'a [Observation],
    /// The whitener of each.
    pub whiteners: Vec<Whitener>,
    /// The residual.
    pub residual: ResidualKind,
    /// Robust loss.
    pub loss: Loss,
    /// Its unknowns.
    pub unknowns: Unknowns,
    /// Directions held at a guess.
    pub prior: Option<Prior>,
    /// Prior of the sensor's shape.
    pub shape_prior: Option<ShapePrior>,
    /// Threads that share large scans; the result does not depend on it.
    pub threads: usize,
    /// Samples shared by sweeps at nearly the same time offset.
    pub(crate) packing: Packing,
}

/// The minimised criterion: the residual and its robust loss.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Criterion {
    /// The residual.
    pub residual: ResidualKind,
    /// Robust loss on the whitened residual.
    pub loss: Loss,
}

impl<'a> LineProblem<'a> {
    /// A problem over `list`, whitened for the noise expected at the parameters `at`.
    #[must_use]
    pub fn new(
        observations: &'a Observations,
        list: &'a [Observation],
        criterion: Criterion,
        noise: &NoiseLevels,
        at: &Parameters,
    ) -> Self {
        let whiteners = match criterion.residual {
            ResidualKind::PointToLine => {
                vec![Whitener::isotropic(POINT_TO_LINE_SIGMA_M * noise.factor); list.len()]
            }
            ResidualKind::Sheet => {
                let mut whitening = Whitening::new(list, noise);
                sweep(&Scan { observations, list, at, residual: ResidualKind::Sheet }, &mut whitening);
                whitening.whiteners
            }
        };
        Self {
            observations,
            list,
            whiteners,
            residual: criterion.residual,
            loss: criterion.loss,
            unknowns: unknowns_of(criterion.residual, at),
            prior: None,
            shape_prior: None,
            threads: 1,
            packing: Packing::beside(at.time_offset_s),
        }
    }

    /// A problem for a search far from the solution, where speeds across the sheet are meaningless. It is whitened for the noise of feature and
    /// robot alone.
    #[must_use]
    pub fn coarse(
        observations: &'a Observations,
        list: &'a [Observation],
        loss: Loss,
        noise: &NoiseLevels,
        unknowns: Unknowns,
    ) -> Self {
        let whiteners = list.iter().map(|o| noise.coarse_whitener(o.covariance)).collect();
        Self {
            observations,
            list,
            whiteners,
            residual: ResidualKind::Sheet,
            loss,
            unknowns,
            prior: None,
            shape_prior: None,
            threads: 1,
            packing: Packing::default(),
        }
    }

    /// The same problem with a prior of the sensor's shape.
    #[must_use]
    pub fn with_shape_prior(self, shape_prior: Option<ShapePrior>) -> Self {
        Self { shape_prior, ..self }
    }

    /// The same problem with directions held at a guess.
    #[must_use]
    pub(crate) fn with_prior(self, prior: Option<Prior>) -> Self {
        Self { prior, ..self }
    }

    /// The same problem over some of its observations, with their whiteners.
    #[must_use]
    pub(crate) fn of_some<'b>(&self, list: &'b [Observation], whiteners: &[Whitener]) -> LineProblem<'b>
    where
        'a: 'b,
    {
        LineProblem {
            list,
            whiteners: whiteners.to_vec(),
            prior: self.prior.clone(),
            packing: Packing::default(),
            ..*self
        }
    }

    /// The same problem with another loss.
    #[must_use]
    pub fn with_loss(&self, loss: Loss) -> LineProblem<'a> {
        LineProblem { loss, ..self.of_some(self.list, &self.whiteners) }
    }

    /// The observations used, each with its whitener.
    pub fn selected(&self) -> impl Iterator<Item = (&Observation, &Whitener)> {
        self.list.iter().zip(&self.whiteners)
    }

    fn scan<'s>(&'s self, at: &'s Parameters) -> Scan<'s> {
        Scan { observations: self.observations, list: self.list, at, residual: self.residual }
    }

    /// The same problem, shared by a number of threads if it is large.
    #[must_use]
    pub fn with_threads(self, threads: usize) -> Self {
        Self { threads, ..self }
    }

    /// Squared whitened residuals of all observations that can be evaluated.
    #[must_use]
    pub fn squared_residuals(&self, at: &Parameters) -> Vec<f64> {
        let mut squared = self.squared_residual_of_each(at);
        squared.retain(|value| !value.is_nan());
        squared
    }

    /// The same for each observation in turn. NaN where it cannot be evaluated.
    #[must_use]
    pub(crate) fn squared_residual_of_each(&self, at: &Parameters) -> Vec<f64> {
        let mut squared = Squared::new(&self.whiteners);
        sweep(&self.scan(at), &mut squared);
        squared.values
    }

    /// Pose of the sensor at the exposure of an observation. `None` outside the recording or in a gap.
    #[must_use]
    pub fn placement(&self, o: &Observation, at: &Parameters) -> Option<Placement> {
        placement(self.observations, o, at)
    }

    /// Residual of an observation in m, not whitened.
    #[must_use]
    pub fn residual(&self, o: &Observation, at: &Parameters) -> Option<Vector2<f64>> {
        let placement = self.placement(o, at)?;
        let line = &at.lines[o.line as usize];
        match (self.residual, at.curvatures.get(o.line as usize)) {
            (ResidualKind::PointToLine, _) => {
                Some(point_to_line::residual(&placement, &o.point_in_camera, line))
            }
            (ResidualKind::Sheet, None) => {
                sheet_residual::residual(&placement, &self.observations.sheet, &o.point_in_camera, line)
            }
            (ResidualKind::Sheet, Some(_)) => Some(self.linearized(o, at, &placement)?.residual),
        }
    }

    /// The residual and its Jacobian, not whitened.
    fn linearized(&self, o: &Observation, at: &Parameters, placement: &Placement) -> Option<Linearized> {
        match self.residual {
            ResidualKind::PointToLine => {
                let line = &at.lines[o.line as usize];
                Some(Linearized::of(
                    &point_to_line::linearize(placement, &o.point_in_camera, line),
                    placement,
                ))
            }
            ResidualKind::Sheet => self.linearized_in_sheet(o, at, placement),
        }
    }

    fn linearized_in_sheet(
        &self,
        o: &Observation,
        at: &Parameters,
        placement: &Placement,
    ) -> Option<Linearized> {
        let line = &at.lines[o.line as usize];
        let sheet = &self.observations.sheet;
        let Some(curvature) = at.curvatures.get(o.line as usize) else {
            let parts = sheet_residual::linearize(placement, sheet, &o.point_in_camera, line)?;
            return Some(Linearized::of(&parts, placement));
        };
        let seam = SeamInSheet { line, curvature, shape: at.shape.as_ref() };
        let parts = seam.linearize(placement, sheet, &o.point_in_camera)?;
        let mut all = Linearized::of(&parts.straight, placement);
        all.jacobian.fixed_columns_mut::<2>(LOCAL_STRAIGHT).copy_from(&parts.d_curvature);
        all.jacobian.fixed_columns_mut::<5>(LOCAL_BOWED).copy_from(&parts.d_shape);
        Some(all)
    }

    /// The residual of an observation in the sheet, for either criterion. `None` if the seam runs along the sheet.
    #[must_use]
    pub(crate) fn in_sheet(
        &self,
        o: &Observation,
        at: &Parameters,
        placement: &Placement,
    ) -> Option<InSheet> {
        let parts = self.linearized_in_sheet(o, at, placement)?;
        Some(InSheet { residual: parts.residual, d_time_offset: parts.jacobian.column(TIME_OFFSET).into() })
    }

    /// The residual of an observation across the seam, along the line's two cross axes. `None` for the paper's residual, and if the seam runs along
    /// the sheet.
    #[must_use]
    pub(crate) fn in_cross_section(
        &self,
        o: &Observation,
        at: &Parameters,
        placement: &Placement,
    ) -> Option<InCrossSection> {
        if self.residual == ResidualKind::PointToLine {
            return None;
        }
        let parts = self.linearized_in_sheet(o, at, placement)?;
        let line = at.lines[o.line as usize].axes();
        let base_from_camera = placement.base_from_tool.rotation * at.tool_from_camera.rotation;
        let across = line.fixed_columns::<2>(1).transpose()
            * base_from_camera.to_rotation_matrix().matrix()
            * self.observations.sheet.axes();
        Some(InCrossSection {
            in_sheet: parts.residual,
            residual: across * parts.residual,
            jacobian: across * parts.jacobian,
        })
    }

    /// Whitened residual and Jacobian by the local unknowns. Columns of unmodelled unknowns are zero.
    #[must_use]
    pub fn whitened(
        &self,
        (observation, whitener): (&Observation, &Whitener),
        at: &Parameters,
    ) -> Option<(Vector2<f64>, LocalJacobian)> {
        let placement = self.placement(observation, at)?;
        self.whitened_where((observation, whitener), at, &placement)
    }

    /// The same with another pose of the sensor.
    #[must_use]
    pub(crate) fn whitened_where(
        &self,
        (observation, whitener): (&Observation, &Whitener),
        at: &Parameters,
        placement: &Placement,
    ) -> Option<(Vector2<f64>, LocalJacobian)> {
        let parts = self.linearized(observation, at, placement)?;
        let whiten = whitener.matrix();
        Some((whiten * parts.residual, whiten * parts.jacobian))
    }

    /// Derivative of the whitened residual by a displacement of the measured point in base (2×3), and by the time offset.
    #[must_use]
    pub(crate) fn whitened_displacement(
        &self,
        (o, whitener): (&Observation, &Whitener),
        at: &Parameters,
        placement: &Placement,
    ) -> Option<Matrix2x3<f64>> {
        Some(whitener.matrix() * self.linearized(o, at, placement)?.onto_sheet)
    }

    /// Derivative of a whitened residual with this Jacobian by the errors shared by all features of an image, per standard deviation
    /// (2×4): one column for each axis of the robot's position, in the tool, and one for the stamp. A position error of the robot acts
    /// like one of the hand-eye translation. The point-to-line residual has no noise model, so its columns are zero.
    #[must_use]
    pub(crate) fn shared_errors(
        &self,
        jacobian: &LocalJacobian,
        noise: &NoiseLevels,
    ) -> Option<SMatrix<f64, 2, 4>> {
        let mut errors = SMatrix::<f64, 2, 4>::zeros();
        let by_robot = jacobian.fixed_columns::<3>(TRANSLATION) * noise.robot_sigma_m;
        errors.fixed_columns_mut::<3>(0).copy_from(&by_robot);
        errors.fixed_columns_mut::<1>(3).copy_from(&(jacobian.column(TIME_OFFSET) * noise.stamp_sigma_s));
        (self.residual == ResidualKind::Sheet).then_some(errors * noise.factor)
    }
}

/// The residual of an observation in the sheet.
#[derive(Clone, Copy, Debug)]
pub(crate) struct InSheet {
    /// Measured minus predicted, m.
    pub residual: Vector2<f64>,
    /// d r / d t_d, m/s.
    pub d_time_offset: Vector2<f64>,
}

/// The residual of an observation across the seam.
#[derive(Clone, Copy, Debug)]
pub(crate) struct InCrossSection {
    /// The residual in the sheet, m.
    pub in_sheet: Vector2<f64>,
    /// The residual along the line's two cross axes, m.
    pub residual: Vector2<f64>,
    /// Its Jacobian by the local unknowns.
    pub jacobian: LocalJacobian,
}

/// A Jacobian by the local unknowns of an observation.
pub(crate) type LocalJacobian = SMatrix<f64, 2, LOCAL_ALL>;

struct Linearized {
    residual: Vector2<f64>,
    jacobian: LocalJacobian,
    onto_sheet: Matrix2x3<f64>,
}

impl Linearized {
    fn of(parts: &ResidualJacobian, placement: &Placement) -> Self {
        let mut jacobian = LocalJacobian::zeros();
        jacobian.fixed_columns_mut::<LINES>(0).copy_from(&parts.by_links(placement));
        jacobian.fixed_columns_mut::<4>(LINES).copy_from(&parts.d_line);
        Self { residual: parts.residual, jacobian, onto_sheet: parts.by_shift() }
    }
}

fn unknowns_of(residual: ResidualKind, at: &Parameters) -> Unknowns {
    let unknowns = at.unknowns();
    debug_assert!(
        residual == ResidualKind::Sheet || unknowns.model == Model::Straight,
        "the paper's lines are straight"
    );
    unknowns
}

impl LeastSquares for LineProblem<'_> {
    type State = Parameters;

    fn dimension(&self) -> usize {
        self.unknowns.dimension()
    }

    fn retract(&self, state: &Parameters, step: &DVector<f64>) -> Parameters {
        state.retract(step)
    }

    fn cost(&self, state: &Parameters) -> f64 {
        let part = |range| Cost::new(&self.whiteners[range], self.loss);
        let parts = self.sweep_chunks(state, part);
        parts.iter().map(Cost::total).sum::<f64>()
            + state.known(self.shape_prior.as_ref()).cost()
            + self.prior.as_ref().map_or(0.0, |prior| prior.cost(state))
    }

    fn linearize(&self, state: &Parameters, equations: &mut NormalEquations) {
        match self.unknowns.model {
            Model::Straight => self.add_sums::<LOCAL_STRAIGHT>(state, equations),
            Model::Bowed => self.add_sums::<LOCAL_BOWED>(state, equations),
            Model::Shaped => self.add_sums::<LOCAL_ALL>(state, equations),
        }
        self.add_known(state, equations);
    }
}

impl LineProblem<'_> {
    /// The prior of the unknowns: cost, gradient and Hessian.
    #[must_use]
    pub(crate) fn known_beforehand(&self, at: &Parameters) -> NormalEquations {
        let mut known = NormalEquations::zeros(self.unknowns.dimension());
        self.add_known(at, &mut known);
        known
    }

    fn add_known(&self, at: &Parameters, equations: &mut NormalEquations) {
        at.known(self.shape_prior.as_ref()).add_to(equations);
        if let Some(prior) = &self.prior {
            prior.add_to(at, equations);
        }
    }

    fn sweep_chunks<V: Visit + Send>(
        &self,
        state: &Parameters,
        visitor: impl Fn(std::ops::Range<usize>) -> V + Sync,
    ) -> Vec<V> {
        let scan = self.scan(state);
        let packed = self.packing.samples(&scan);
        sweep_chunks(&scan, packed.as_ref().map(|packed| &packed.samples[..]), self.threads, visitor)
    }

    /// The sums over N local unknowns, compiled for each N.
    fn add_sums<const N: usize>(&self, state: &Parameters, equations: &mut NormalEquations) {
        let part = |range| Equations::<N>::new(&self.whiteners[range], self.loss, self.unknowns.lines);
        let parts = self.sweep_chunks(state, part);
        let mounting = Mounting::new(&self.observations.sheet, state);
        for part in &parts {
            part.add_to(equations, &self.unknowns, &mounting.sheet_from_tool);
        }
    }
}
