//! The cuts of a scan as a least-squares problem, whitened at one estimate.

use super::cut::Cut;
use super::model::{self, Follows, RADIUS, RoundState, SHAPE, SIZE};
use super::sheet_frame::SheetFrame;
use super::target::{ROWS, Row, Rows, Square};
use crate::board_hand_eye::joint::ROUND_MARGINS_S;
use crate::board_hand_eye::robot_path::{RobotPath, ToolState};
use crate::board_hand_eye::unknowns::{ErrorModel, TIME_OFFSET};
use crate::error::Error;
use nalgebra::{DMatrix, DVector, SMatrix, SVector};
use trueline_geometry::statistics::median;
use trueline_lsq::{LeastSquares, NormalEquations, SolveOptions, solve};
use trueline_method::input::shape_prior::ShapePrior;

/// The fewest cuts that leave something over to check.
pub(crate) const FEWEST: usize = 6;

/// What a scan has seen of a target, and what is known beforehand.
#[derive(Clone, Copy)]
pub(super) struct Scan<'a> {
    /// The target.
    pub(super) row: &'static Row,
    pub(super) cuts: &'a [Cut],
    pub(super) sheet: &'a SheetFrame,
    pub(super) robot: RobotPath<'a>,
    pub(super) noise: &'a ErrorModel,
    /// The radius, m, where it is stated.
    pub(super) radius_m: Option<f64>,
    /// The sensor's shape beforehand; `None` where it is held.
    pub(super) shape: Option<ShapePrior>,
}

impl Scan<'_> {
    /// Unknowns that are not estimated.
    pub(super) fn held(&self) -> Vec<usize> {
        let time = (!self.robot.has_time_offset()).then_some(TIME_OFFSET);
        let radius = self.radius_m.map(|_| RADIUS);
        let shape = (SHAPE..SIZE).filter(|_| self.shape.is_none());
        self.row.held.iter().copied().chain(time).chain(radius).chain(shape).collect()
    }

    /// Readings less unknowns, one at the least, with a number of cuts that count. A shape with a prior brings as many readings as unknowns.
    pub(super) fn freedom(&self, counting: usize) -> f64 {
        let estimated = SIZE - self.held().len() - if self.shape.is_some() { SIZE - SHAPE } else { 0 };
        ((self.row.rows * counting) as f64 - estimated as f64).max(1.0)
    }

    pub(super) fn tool(&self, k: usize, at: &RoundState) -> Option<ToolState> {
        self.robot.at(k, at.unknowns.time_offset_s)
    }

    /// Measured less predicted, m; `None` where the robot's pose is not known.
    pub(super) fn difference(&self, k: usize, at: &RoundState) -> Option<Rows> {
        Some(model::difference(&self.cuts[k], self.sheet, &self.tool(k, at)?, at))
    }

    /// How it follows all that it depends on, before a tool that moves.
    pub(super) fn follows(&self, k: usize, tool: &ToolState, at: &RoundState) -> Follows {
        Follows::of(&self.cuts[k], self.sheet, tool, self.noise, at)
    }
}

/// The problem.
#[derive(Clone)]
pub(super) struct RoundProblem<'a> {
    pub(super) scan: Scan<'a>,
    /// Which cuts count.
    pub(super) used: Vec<bool>,
    pub(super) whitening: Vec<Square>,
}

/// The estimate from a start, and the problem at it with the cuts that count, after a round for each margin, s.
pub(super) fn converged<'a>(
    scan: &Scan<'a>,
    start: RoundState,
    margins_s: &[f64],
) -> Result<(RoundState, RoundProblem<'a>), Error> {
    let mut state = start;
    let mut scale = f64::INFINITY;
    let mut used = vec![true; scan.cuts.len()];
    for &margin_s in margins_s {
        let problem = RoundProblem::whitened(scan, &state).within(margin_s, &state);
        (used, scale) = problem.fitting(&state, scale);
        let problem = problem.keeping(&used);
        used.clone_from(&problem.used);
        let count = problem.used.iter().filter(|used| **used).count();
        if count < FEWEST {
            return Err(Error::TooFewSightings { found: count, needed: FEWEST });
        }
        let solved = solve(&problem, state, &scan.held(), &SolveOptions::default());
        state = solved.map_err(|_| Error::HandEyeNotFixed)?.state;
    }
    Ok((state, RoundProblem::whitened(scan, &state).keeping(&used)))
}

/// All rounds of a fit from a start, s.
pub(super) fn rounds() -> &'static [f64] {
    &ROUND_MARGINS_S
}

impl<'a> RoundProblem<'a> {
    /// The problem with the noise as it acts at `at`; cuts without a robot pose there do not count.
    pub(super) fn whitened(scan: &Scan<'a>, at: &RoundState) -> Self {
        let of = |k: usize| scan.follows(k, &scan.tool(k, at)?, at).whitening(scan.noise);
        let whitening: Vec<Option<Square>> = (0..scan.cuts.len()).map(of).collect();
        Self {
            scan: *scan,
            used: whitening.iter().map(Option::is_some).collect(),
            whitening: whitening.into_iter().map(Option::unwrap_or_default).collect(),
        }
    }

    pub(super) fn keeping(mut self, used: &[bool]) -> Self {
        for (own, other) in self.used.iter_mut().zip(used) {
            *own = *own && *other;
        }
        self
    }

    /// Without the cuts whose robot pose is not known everywhere within a margin, s, of the offset.
    fn within(mut self, margin_s: f64, at: &RoundState) -> Self {
        if self.scan.robot.has_time_offset() {
            for (k, used) in self.used.iter_mut().enumerate() {
                let known = |s: f64| self.scan.robot.at(k, at.unknowns.time_offset_s + s).is_some();
                *used = *used && known(margin_s) && known(-margin_s);
            }
        }
        self
    }

    /// Which cuts fit, and the scale of their squares; the scale only falls from round to round.
    fn fitting(&self, at: &RoundState, last_scale: f64) -> (Vec<bool>, f64) {
        let squares: Vec<f64> = (0..self.used.len())
            .map(|k| self.residual(k, at).map_or(f64::INFINITY, |r| r.norm_squared()))
            .collect();
        let scale = self.scale(at).min(last_scale);
        (squares.iter().map(|s| *s <= self.scan.row.outlier_squared * scale).collect(), scale)
    }

    /// The scale of squared residuals by their median: one if the noise is as it was taken, or less.
    pub(super) fn scale(&self, at: &RoundState) -> f64 {
        let squares = self.counting().filter_map(|k| Some(self.residual(k, at)?.norm_squared()));
        (median(squares).unwrap_or(0.0) / self.scan.row.median_squared).max(1.0)
    }

    /// Measured less predicted, whitened; `None` where the robot's pose is not known.
    pub(super) fn residual(&self, k: usize, at: &RoundState) -> Option<Rows> {
        Some(self.whitening[k] * self.scan.difference(k, at)?)
    }

    /// Whitened residual of a cut and its derivative.
    pub(super) fn linearized(&self, k: usize, at: &RoundState) -> Option<(Rows, SMatrix<f64, ROWS, SIZE>)> {
        let tool = self.scan.tool(k, at)?;
        Some((self.residual(k, at)?, self.whitening[k] * self.scan.follows(k, &tool, at).unknowns))
    }

    /// The places of the cuts that count.
    pub(super) fn counting(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.used.len()).filter(|k| self.used[*k])
    }

    fn of_shape(&self, at: &RoundState) -> f64 {
        self.scan.shape.map_or(0.0, |prior| 0.5 * at.shape.dot(&(prior.information * at.shape)))
    }
}

impl LeastSquares for RoundProblem<'_> {
    type State = RoundState;

    fn dimension(&self) -> usize {
        SIZE
    }

    fn retract(&self, state: &RoundState, step: &DVector<f64>) -> RoundState {
        model::moved(state, &SVector::<f64, SIZE>::from_column_slice(step.as_slice()))
    }

    fn cost(&self, state: &RoundState) -> f64 {
        let of = |k| self.residual(k, state).map_or(f64::INFINITY, |r| 0.5 * r.norm_squared());
        self.counting().map(of).sum::<f64>() + self.of_shape(state)
    }

    fn linearize(&self, state: &RoundState, equations: &mut NormalEquations) {
        let (mut hessian, mut gradient) =
            (SMatrix::<f64, SIZE, SIZE>::zeros(), SVector::<f64, SIZE>::zeros());
        for k in self.counting() {
            let Some((residual, jacobian)) = self.linearized(k, state) else {
                equations.cost = f64::INFINITY;
                return;
            };
            hessian += jacobian.transpose() * jacobian;
            gradient += jacobian.transpose() * residual;
            equations.cost += 0.5 * residual.norm_squared();
        }
        if let Some(prior) = self.scan.shape {
            let mut block = hessian.fixed_view_mut::<5, 5>(SHAPE, SHAPE);
            block += prior.information;
            let mut pull = gradient.fixed_rows_mut::<5>(SHAPE);
            pull += prior.information * state.shape;
            equations.cost += self.of_shape(state);
        }
        equations.hessian += DMatrix::from_iterator(SIZE, SIZE, hessian.iter().copied());
        equations.gradient += DVector::from_column_slice(gradient.as_slice());
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

    use super::*;
    use crate::board_hand_eye::Carried;
    use crate::board_hand_eye::unknowns::Unknowns;
    use crate::round::target::RoundTarget;
    use nalgebra::{UnitQuaternion, Vector2, Vector3};
    use trueline_geometry::{Pose, Trajectory, se3};
    use trueline_model::{LaserSheet, SheetShape};

    fn pose(t: f64) -> Pose {
        let turn = Vector3::new(0.3 * t.sin(), 0.2 * (1.3 * t).cos(), 0.4 * (0.7 * t).sin());
        let shift = Vector3::new(0.9 + 0.05 * t.cos(), 0.1 + 0.04 * t.sin(), 0.5 + 0.03 * (2.0 * t).sin());
        se3::from_parts(UnitQuaternion::from_scaled_axis(turn), shift)
    }

    /// An arc of about 110° of an ellipse, or of a circle.
    fn cut(target: RoundTarget, k: usize) -> Cut {
        let k = k as f64;
        let long = if target == RoundTarget::Sphere { 1.0 } else { 1.15 };
        let radius_m = 0.014 + 0.003 * (2.0 * k).sin();
        let at = |j: i32| {
            let (sine, cosine) = (0.05 * f64::from(j) + k).sin_cos();
            let noise = 1e-5 * (f64::from(7 * j) + k).sin();
            Vector2::new(0.01 * k.sin(), 0.13 + 0.01 * k.cos())
                + Vector2::new(long * cosine, sine) * (radius_m + noise)
        };
        let points: Vec<Vector2<f64>> = (0..40).map(at).collect();
        Cut::of(target, &points, &SheetShape::exact_about(&Vector2::new(0.001, 0.13))).unwrap()
    }

    #[test]
    fn the_gradient_is_that_of_differences() {
        let times: Vec<f64> = (0..400).map(|k| 0.02 * f64::from(k)).collect();
        let poses: Vec<Pose> = times.iter().map(|t| pose(*t)).collect();
        let trajectory = Trajectory::new(times, &poses).unwrap();
        let stamps_s: Vec<f64> = (0..8).map(|k| 1.013 + 0.7 * f64::from(k)).collect();
        let prior = ShapePrior { information: SMatrix::<f64, 5, 5>::identity() * 4e4 };
        let both = [RoundTarget::Sphere, RoundTarget::Cylinder];
        let cases = both.into_iter().flat_map(|t| [Carried::Camera, Carried::Target].map(|c| (t, c)));
        for (target, carries) in cases {
            let cuts: Vec<Cut> = (0..8).map(|k| cut(target, k)).collect();
            let scan = Scan {
                row: target.row(),
                cuts: &cuts,
                sheet: &SheetFrame::of(&LaserSheet::of_profiler()),
                robot: RobotPath::Moving { trajectory: &trajectory, stamps_s: &stamps_s },
                noise: &ErrorModel { position_m: 2e-5, rotation_rad: 2e-5, stamp_s: 1e-4, carries },
                radius_m: None,
                shape: Some(prior),
            };
            let state = RoundState {
                unknowns: Unknowns {
                    time_offset_s: 0.004,
                    tool_from_camera: se3::from_parts(
                        UnitQuaternion::from_scaled_axis(Vector3::new(0.4, -0.3, 0.8)),
                        Vector3::new(0.05, -0.08, 0.12),
                    ),
                    base_from_target: se3::from_parts(
                        UnitQuaternion::from_scaled_axis(Vector3::new(-0.5, 0.2, 0.9)),
                        Vector3::new(1.0, 0.0, 0.7),
                    ),
                },
                radius_m: 0.02,
                shape: SVector::<f64, 5>::new(1e-3, -2e-3, 5e-4, 0.02, -0.01),
            };
            let problem = RoundProblem::whitened(&scan, &state);
            let mut equations = NormalEquations::zeros(SIZE);
            problem.linearize(&state, &mut equations);
            for k in 0..SIZE {
                let step = 1e-6;
                let at = |multiple: f64| {
                    let mut moved = DVector::zeros(SIZE);
                    moved[k] = multiple * step;
                    problem.cost(&problem.retract(&state, &moved))
                };
                let numerical = (at(-2.0) - at(2.0) + (at(1.0) - at(-1.0)) * 8.0) / (12.0 * step);
                // A sphere's attitude moves nothing. A cost is a sum of up to 56 rounded squares, and differences are divided by the step.
                let rounded = 56.0 * f64::EPSILON * at(0.0) / step;
                let scale = equations.hessian[(k, k)].sqrt();
                let off = (numerical - equations.gradient[k]).abs();
                let expected = equations.gradient[k];
                assert!(
                    off < 1e-6 * scale + rounded,
                    "{target:?} {carries:?} {k}: {numerical} {expected} {rounded}"
                );
            }
        }
    }
}
