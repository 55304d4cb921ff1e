//! The baseline: the published program, as far as its behaviour can be described.
//!
//! Differs from Eqs. (16) to (18), which promise one joint step. Five blocks of unknowns (time offset; rotation of the
//! line; its moment; hand-eye rotation; hand-eye translation) are linearised at one point. Each is solved as if the
//! others were known, (JᵀJ + μI) δ = −JᵀF. All are moved at once, but the hand-eye by a fifth of its step only. Each
//! block has its own μ, which follows the change of the total error; a worse step is kept. There is no robust loss. Only
//! every tenth image is used. Lengths are millimetres here, because μI makes the way depend on units.

use nalgebra::{Matrix3, SMatrix, SVector, UnitQuaternion, Vector3};
use trueline_geometry::{OrthonormalLine, Pose, se3, so3};
use trueline_method::input::observations::Observations;

/// Which derivative with respect to the time offset is used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TimeJacobian {
    /// As published: Eq. (7) with the wrong sign of the rotation term, and a lever that leaves out p_EC.
    Published,
    /// The true one.
    Corrected,
}

/// Part of the hand-eye's step that is taken.
const HAND_EYE_GAIN: f64 = 0.2;
/// Images that are skipped between two that are used.
const STRIDE: usize = 10;
/// Longest time between robot samples that is bridged, s.
const LONGEST_GAP_S: f64 = 5e-3;
/// Points further than this from the line are left out, mm.
const FURTHEST_MM: f64 = 2000.0;
/// Rates are formed with this period, at any recorded one, s.
const NOMINAL_PERIOD_S: f64 = 4e-3;
/// The translation's μ may grow this much above its first value; the others' not at all.
const TRANSLATION_CAP: f64 = 10.0;

/// The unknowns, in mm.
#[derive(Clone, Debug)]
pub struct State {
    /// Time offset, s.
    pub time_offset_s: f64,
    /// Hand-eye transform; translation in m as everywhere else.
    pub tool_from_camera: Pose,
    /// The line in its orthonormal form; distance in m.
    pub line: OrthonormalLine,
}

/// A state and the root mean square distance of the points from the line there, m; `None` if no point is left.
#[derive(Clone, Debug)]
pub struct Visit {
    /// The unknowns.
    pub state: State,
    /// RMS distance, m.
    pub rms_m: Option<f64>,
}

const MM: f64 = 1e3;

/// Does this many iterations from a start; the first visit is the start, the last the end.
#[must_use]
pub fn walk(observations: &Observations, start: State, rule: TimeJacobian, iterations: usize) -> Vec<Visit> {
    let mut visits = Vec::with_capacity(iterations + 1);
    let mut blocks = Blocks::default();
    let mut state = start;
    let mut last_error = f64::NAN;
    for _ in 0..iterations {
        blocks.clear();
        let (error, count) = linearise(observations, &state, rule, &mut blocks);
        let rms_m = (count > 0).then(|| (error / count as f64).sqrt() / MM);
        visits.push(Visit { state: state.clone(), rms_m });
        blocks.control(last_error, error);
        let Some(next) = blocks.step(&state).filter(|_| count > 0) else { return visits };
        (state, last_error) = (next, error);
    }
    let (error, count) = linearise(observations, &state, rule, &mut Blocks::default());
    let rms_m = (count > 0).then(|| (error / count as f64).sqrt() / MM);
    visits.push(Visit { state, rms_m });
    visits
}

/// One block's equations and its damping.
#[derive(Clone, Debug)]
struct Block<const N: usize> {
    hessian: SMatrix<f64, N, N>,
    gradient: SVector<f64, N>,
    damping: f64,
    growth: f64,
    cap: f64,
    last: Option<(SVector<f64, N>, SVector<f64, N>)>,
}

impl<const N: usize> Default for Block<N> {
    fn default() -> Self {
        Self {
            hessian: SMatrix::zeros(),
            gradient: SVector::zeros(),
            damping: f64::NAN,
            growth: 1.0,
            cap: f64::INFINITY,
            last: None,
        }
    }
}

impl<const N: usize> Block<N> {
    fn clear(&mut self) {
        self.hessian.fill(0.0);
        self.gradient.fill(0.0);
    }

    fn add(&mut self, jacobian: &SMatrix<f64, 3, N>, residual: &Vector3<f64>) {
        self.hessian += jacobian.transpose() * jacobian;
        self.gradient += jacobian.transpose() * residual;
    }

    fn control(&mut self, last_error: f64, error: f64, cap: f64) {
        let Some((step, gradient)) = &self.last else {
            self.damping = self.hessian.diagonal().max();
            self.cap = cap * self.damping;
            return;
        };
        let gain = (last_error - error) / step.dot(&(step * self.damping - gradient));
        if gain > 0.0 {
            self.damping *= (1.0_f64 / 3.0).max(1.0 - (2.0 * gain - 1.0).powi(3));
            self.growth = 2.0;
        } else {
            self.damping = (self.damping * self.growth).min(self.cap);
            self.growth *= 2.0;
        }
    }

    fn step(&mut self) -> Option<SVector<f64, N>> {
        let damped = self.hessian + SMatrix::<f64, N, N>::identity() * self.damping;
        let step = -damped.try_inverse()? * self.gradient;
        self.last = Some((step, self.gradient));
        step.iter().all(|x| x.is_finite()).then_some(step)
    }
}

#[derive(Default)]
struct Blocks {
    time_offset: Block<1>,
    line_turn: Block<3>,
    moment: Block<1>,
    rotation: Block<3>,
    translation: Block<3>,
}

impl Blocks {
    fn clear(&mut self) {
        self.time_offset.clear();
        self.line_turn.clear();
        self.moment.clear();
        self.rotation.clear();
        self.translation.clear();
    }

    fn control(&mut self, last_error: f64, error: f64) {
        self.time_offset.control(last_error, error, 1.0);
        self.line_turn.control(last_error, error, 1.0);
        self.moment.control(last_error, error, 1.0);
        self.rotation.control(last_error, error, 1.0);
        self.translation.control(last_error, error, TRANSLATION_CAP);
    }

    /// All blocks move at once, from the same point.
    fn step(&mut self, from: &State) -> Option<State> {
        let time_offset = self.time_offset.step()?;
        let line_turn = self.line_turn.step()?;
        let moment = self.moment.step()?;
        let rotation = self.rotation.step()?;
        let translation = self.translation.step()?;
        Some(State {
            time_offset_s: from.time_offset_s + time_offset[0],
            tool_from_camera: se3::retract_decoupled(
                &from.tool_from_camera,
                &(rotation * HAND_EYE_GAIN),
                &(translation * (HAND_EYE_GAIN / MM)),
            ),
            line: OrthonormalLine {
                rotation: so3::exp(&line_turn) * from.line.rotation,
                distance: from.line.distance + moment[0] / MM,
            },
        })
    }
}

/// Adds all images' parts; the sum of squared distances (mm²) and the number of points.
fn linearise(
    observations: &Observations,
    state: &State,
    rule: TimeJacobian,
    blocks: &mut Blocks,
) -> (f64, usize) {
    let trajectory = &observations.robot.trajectory;
    let mounted: UnitQuaternion<f64> = state.tool_from_camera.rotation;
    let arm = state.tool_from_camera.translation.vector * MM;
    let axes: Matrix3<f64> = state.line.rotation.to_rotation_matrix().into_inner();
    let (u1, u2): (Vector3<f64>, Vector3<f64>) = (axes.column(0).into(), axes.column(1).into());
    let distance = state.line.distance * MM;
    let (mut error, mut count) = (0.0, 0);
    for o in observations.list.iter().filter(|o| o.line == 0).step_by(STRIDE) {
        let exposure_s = o.stamp_s - state.time_offset_s;
        let Some(index) = trajectory.bracket(exposure_s) else { continue };
        let segment = &trajectory.segments()[index];
        if segment.duration > LONGEST_GAP_S || segment.duration <= 0.0 {
            continue;
        }
        let pose = segment.pose_at(exposure_s);
        let in_camera = o.point_in_camera * MM;
        let turned = mounted * in_camera;
        let point = pose.rotation * (turned + arm) + pose.translation.vector * MM;
        let residual = point.cross(&u1) - u2 * distance;
        if residual.norm() >= FURTHEST_MM {
            continue;
        }
        error += residual.norm_squared();
        count += 1;
        let attitude = pose.rotation.to_rotation_matrix().into_inner();
        let d_point = -so3::hat(&u1);
        // Rates as differences over the nominal period.
        let stretch = segment.duration / NOMINAL_PERIOD_S;
        let rate = segment.base_from_tool.rotation * segment.body_rate * stretch;
        let velocity = segment.velocity * (MM * stretch);
        let d_time = match rule {
            TimeJacobian::Published => -(attitude * turned).cross(&rate) - velocity,
            TimeJacobian::Corrected => (attitude * (turned + arm)).cross(&rate) - velocity,
        };
        blocks.time_offset.add(&(d_point * d_time), &residual);
        blocks.line_turn.add(&(-so3::hat(&point) * so3::hat(&u1) + so3::hat(&u2) * distance), &residual);
        blocks.moment.add(&-u2, &residual);
        blocks.rotation.add(&(-d_point * attitude * so3::hat(&turned)), &residual);
        blocks.translation.add(&(d_point * attitude), &residual);
    }
    (error, count)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;
    use crate::convergence::papers_start;
    use crate::settings::Settings;
    use trueline_method::input::timestamps::Sampling;
    use trueline_method::{Config, ResidualKind, input::observations, solve::start};
    use trueline_sim::simulate;

    fn scan() -> (Observations, State) {
        let mut scenario = Settings::default().scenario();
        scenario.timing.duration_s = 12.0;
        // The rates are means over a period; between even samples without noise they are those of the path.
        let features = scenario.disturbance.feature_noise_px;
        scenario.disturbance = trueline_sim::Disturbance { feature_noise_px: features, ..Default::default() };
        scenario.timing.between = trueline_sim::Between::Straight;
        let recording = simulate(&scenario, 3).unwrap();
        let config = Config { residual: ResidualKind::PointToLine, ..Config::default() };
        let sampling = Sampling::of(&recording, observations::origin_ns(&recording));
        let observed = observations::observe(&recording, &sampling, &config).unwrap();
        let start = papers_start(&recording.truth.unwrap().parameters);
        let line = start::from_guess(&observed, &start).unwrap().lines[0].to_pluecker();
        let line = line.to_orthonormal().unwrap();
        let state = State { time_offset_s: 0.011, tool_from_camera: start.tool_from_camera, line };
        (observed, state)
    }

    fn error(observed: &Observations, state: &State) -> f64 {
        linearise(observed, state, TimeJacobian::Corrected, &mut Blocks::default()).0
    }

    /// JᵀF is half the derivative of the squared error, by any unknown.
    fn check(numeric: f64, gradient: f64, scale: f64) {
        assert!((numeric - gradient).abs() < 1e-4 * scale, "{numeric} {gradient} {scale}");
    }

    #[test]
    fn gradients_are_those_of_the_error() {
        let (observed, state) = scan();
        let mut blocks = Blocks::default();
        linearise(&observed, &state, TimeJacobian::Corrected, &mut blocks);
        let slope = |moved: &dyn Fn(f64) -> State, step: f64| {
            (error(&observed, &moved(step)) - error(&observed, &moved(-step))) / (4.0 * step)
        };
        let offset = |h: f64| State { time_offset_s: state.time_offset_s + h, ..state.clone() };
        check(slope(&offset, 1e-5), blocks.time_offset.gradient[0], blocks.time_offset.gradient[0].abs());
        let far = |h: f64| State {
            line: OrthonormalLine { distance: state.line.distance + h / MM, ..state.line },
            ..state.clone()
        };
        let scale = blocks.moment.hessian[0].sqrt() * error(&observed, &state).sqrt();
        check(slope(&far, 1e-3), blocks.moment.gradient[0], scale);
        for axis in 0..3 {
            let unit = Vector3::ith(axis, 1.0);
            let turned = |h: f64| State {
                line: OrthonormalLine { rotation: so3::exp(&(unit * h)) * state.line.rotation, ..state.line },
                ..state.clone()
            };
            check(slope(&turned, 1e-7), blocks.line_turn.gradient[axis], blocks.line_turn.gradient.norm());
            let moved = |turn: Vector3<f64>, shift: Vector3<f64>| State {
                tool_from_camera: se3::retract_decoupled(&state.tool_from_camera, &turn, &shift),
                ..state.clone()
            };
            let mounted = |h: f64| moved(unit * h, Vector3::zeros());
            check(slope(&mounted, 1e-6), blocks.rotation.gradient[axis], blocks.rotation.gradient.norm());
            let shifted = |h: f64| moved(Vector3::zeros(), unit * (h / MM));
            check(
                slope(&shifted, 1e-4),
                blocks.translation.gradient[axis],
                blocks.translation.gradient.norm(),
            );
        }
    }

    #[test]
    fn the_published_derivative_is_not_that_of_the_error() {
        let (observed, state) = scan();
        let gradient = |rule| {
            let mut blocks = Blocks::default();
            linearise(&observed, &state, rule, &mut blocks);
            blocks.time_offset.gradient[0]
        };
        let (right, published) = (gradient(TimeJacobian::Corrected), gradient(TimeJacobian::Published));
        assert!((published / right - 1.0).abs() > 0.05, "{published} {right}");
    }
}
