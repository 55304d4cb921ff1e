//! Observations → problem: one whitened residual for each observation, with its Jacobian by the chain rule.

use crate::config::ResidualKind;
use crate::input::noise_levels::{NoiseLevels, Whitener};
use crate::input::observations::{Observation, Observations};
use crate::problem::parameters::{LINES, LOCAL, Parameters, line_index};
use crate::problem::placement::placement;
use crate::problem::prior::Prior;
use crate::problem::simd::{Cost, Equations, Mounting, Scan, Squared, Whitening, sweep, sweep_chunks};
use nalgebra::{DVector, SMatrix, Vector2};
use trueline_lsq::{LeastSquares, Loss, NormalEquations};
use trueline_model::point_to_line::{self, ResidualJacobian};
use trueline_model::{Placement, sheet_residual};

/// Standard deviation that stands for one unit of the point-to-line residual until its spread is known, m.
pub const POINT_TO_LINE_SIGMA_M: f64 = 5e-5;

/// The least-squares problem of a scan.
pub struct LineProblem<'a> {
    /// Trajectory and sheet.
    pub observations: &'a Observations,
    /// The observations that take part, by rising stamp.
    pub list: &'a [Observation],
    /// The whitener of each.
    pub whiteners: Vec<Whitener>,
    /// Which residual.
    pub residual: ResidualKind,
    /// Robust loss.
    pub loss: Loss,
    /// Directions held at a guess.
    pub prior: Option<Prior>,
    /// Threads that share large scans; the result does not depend on it.
    pub threads: usize,
}

/// What is minimised: the residual and its robust loss.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Criterion {
    /// Which residual.
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
            prior: None,
            threads: 1,
        }
    }

    /// A problem for a search far from the solution, where speeds across the sheet mean nothing yet:
    /// whitened for the noise of feature and robot alone.
    #[must_use]
    pub fn coarse(
        observations: &'a Observations,
        list: &'a [Observation],
        loss: Loss,
        noise: &NoiseLevels,
    ) -> Self {
        let whiteners = list.iter().map(|o| noise.coarse_whitener(o.covariance)).collect();
        Self { observations, list, whiteners, residual: ResidualKind::Sheet, loss, prior: None, threads: 1 }
    }

    /// The same problem with directions held at a guess.
    #[must_use]
    pub fn with_prior(self, prior: Option<Prior>) -> Self {
        Self { prior, ..self }
    }

    /// The observations that take part, each with its whitener.
    pub fn selected(&self) -> impl Iterator<Item = (&Observation, &Whitener)> {
        self.list.iter().zip(&self.whiteners)
    }

    fn scan<'s>(&'s self, at: &'s Parameters) -> Scan<'s> {
        Scan { observations: self.observations, list: self.list, at, residual: self.residual }
    }

    /// The same problem shared by so many threads where it is large.
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

    /// The same of each observation in turn; NaN where one cannot be evaluated.
    #[must_use]
    pub fn squared_residual_of_each(&self, at: &Parameters) -> Vec<f64> {
        let mut squared = Squared::new(&self.whiteners);
        sweep(&self.scan(at), &mut squared);
        squared.values
    }

    /// Where the sensor was at the exposure of an observation; `None` outside the recording or in a gap.
    #[must_use]
    pub fn placement(&self, o: &Observation, at: &Parameters, hint: &mut usize) -> Option<Placement> {
        placement(self.observations, o, at, hint)
    }

    /// Residual of an observation in m, not whitened.
    #[must_use]
    pub fn residual(&self, o: &Observation, at: &Parameters, hint: &mut usize) -> Option<Vector2<f64>> {
        let placement = self.placement(o, at, hint)?;
        let line = &at.lines[o.line as usize];
        match self.residual {
            ResidualKind::PointToLine => Some(point_to_line::residual(&placement, &o.point_in_camera, line)),
            ResidualKind::Sheet => {
                sheet_residual::residual(&placement, &self.observations.sheet, &o.point_in_camera, line)
            }
        }
    }

    fn linearized(
        &self,
        o: &Observation,
        at: &Parameters,
        placement: &Placement,
    ) -> Option<ResidualJacobian> {
        let line = &at.lines[o.line as usize];
        match self.residual {
            ResidualKind::PointToLine => Some(point_to_line::linearize(placement, &o.point_in_camera, line)),
            ResidualKind::Sheet => {
                sheet_residual::linearize(placement, &self.observations.sheet, &o.point_in_camera, line)
                    .map(|(jacobian, _)| jacobian)
            }
        }
    }

    /// Whitened residual and Jacobian (2×11: sensor and clock, then the observation's own line).
    #[must_use]
    pub fn whitened(
        &self,
        (observation, whitener): (&Observation, &Whitener),
        at: &Parameters,
        hint: &mut usize,
    ) -> Option<(Vector2<f64>, SMatrix<f64, 2, LOCAL>)> {
        let placement = self.placement(observation, at, hint)?;
        self.whitened_where((observation, whitener), at, &placement)
    }

    /// The same with the sensor placed elsewhere.
    #[must_use]
    pub fn whitened_where(
        &self,
        (observation, whitener): (&Observation, &Whitener),
        at: &Parameters,
        placement: &Placement,
    ) -> Option<(Vector2<f64>, SMatrix<f64, 2, LOCAL>)> {
        let parts = self.linearized(observation, at, placement)?;
        let mut jacobian = SMatrix::<f64, 2, LOCAL>::zeros();
        jacobian.fixed_columns_mut::<1>(0).copy_from(&parts.d_time_offset);
        jacobian.fixed_columns_mut::<3>(1).copy_from(&parts.d_rotation);
        jacobian.fixed_columns_mut::<3>(4).copy_from(&parts.d_translation);
        jacobian.fixed_columns_mut::<4>(LINES).copy_from(&parts.d_line);
        let whiten = whitener.matrix();
        Some((whiten * parts.residual, whiten * jacobian))
    }

    /// How the errors that all features of an image share move a whitened residual: one column for each axis
    /// of the robot's position and one for the stamp, per standard deviation (2×4). The point-to-line
    /// residual has no model of its noise, so nothing is expected of it.
    #[must_use]
    pub fn whitened_shared_errors(
        &self,
        (o, whitener): (&Observation, &Whitener),
        at: &Parameters,
        noise: &NoiseLevels,
        hint: &mut usize,
    ) -> Option<SMatrix<f64, 2, 4>> {
        if self.residual == ResidualKind::PointToLine {
            return None;
        }
        let placement = self.placement(o, at, hint)?;
        let line = &at.lines[o.line as usize];
        let (jacobian, onto_sheet) =
            sheet_residual::linearize(&placement, &self.observations.sheet, &o.point_in_camera, line)?;
        let mut errors = SMatrix::<f64, 2, 4>::zeros();
        errors.fixed_columns_mut::<3>(0).copy_from(&(onto_sheet * noise.robot_sigma_m));
        errors.fixed_columns_mut::<1>(3).copy_from(&(jacobian.d_time_offset * noise.stamp_sigma_s));
        Some(whitener.matrix() * errors * noise.factor)
    }
}

impl LeastSquares for LineProblem<'_> {
    type State = Parameters;

    fn dimension(&self) -> usize {
        line_index(self.observations.line_count)
    }

    fn retract(&self, state: &Parameters, step: &DVector<f64>) -> Parameters {
        state.retract(step)
    }

    fn cost(&self, state: &Parameters) -> f64 {
        let part = |range| Cost::new(&self.whiteners[range], self.loss);
        let parts = sweep_chunks(&self.scan(state), self.threads, part);
        parts.iter().map(Cost::total).sum::<f64>()
            + self.prior.as_ref().map_or(0.0, |prior| prior.cost(state))
    }

    fn linearize(&self, state: &Parameters, equations: &mut NormalEquations) {
        let lines = self.observations.line_count;
        let part = |range| Equations::new(&self.whiteners[range], self.loss, lines);
        let parts = sweep_chunks(&self.scan(state), self.threads, part);
        let mounting = Mounting::new(&self.observations.sheet, state);
        for part in &parts {
            part.add_to(equations, &mounting.sheet_from_tool);
        }
        if let Some(prior) = &self.prior {
            prior.add_to(state, equations);
        }
    }
}
