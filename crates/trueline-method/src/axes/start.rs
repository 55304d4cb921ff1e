//! Starts for a scan with axes, without a guess.
//!
//! Time offset, attitude of the sensor and, of a rotary axis, its direction are tried on a grid. The direction of the seam
//! is then the mean of the laser plane's normal in its frame. Everything else follows from a linear problem. With a point of
//! the axis c, its motion R, the chain before it (P, p) and behind it (Q, q), each reading x in the tool's axes is placed at
//!
//! ```text
//! rotary: P (R (Q (x + t) + q − c) + c) + p      linear: P (Q (x + t) + q + v d) + p,
//! ```
//!
//! linear in the translation t, in c or in d, and in the seam's place.

use crate::axes::refine::{Refined, follow};
use crate::axes::scan::{AxisScan, Reading};
use crate::axes::state::State;
use crate::input::axis_chain::{Around, AxisChain};
use crate::parallel;
use nalgebra::{Matrix3, SMatrix, SVector, UnitQuaternion, UnitVector3, Vector3};
use trueline_geometry::{Axis, AxisKind, Line, Pose, se3, so3};

/// Number of directions of a rotary axis on the whole sphere: neighbours are some 25° apart.
const DIRECTIONS: usize = 60;
/// Rotation about the pole between successive directions, rad: it fills a sphere evenly.
const GOLDEN_ANGLE_RAD: f64 = 2.399_963_229_728_653;
/// Step of the time offsets, s.
const OFFSET_STEP_S: f64 = 0.2;
/// Readings used by a trial, and by each following stage.
const READINGS: [usize; 4] = [40, 60, 120, 500];
/// Rotations of the attitudes of a cube, rad. Sets are tried in turn until one explains nearly all readings.
const SETS: [[f64; 3]; 4] = [[0.0; 3], [0.4, 0.3, -0.5], [-0.5, 0.45, 0.2], [0.3, -0.5, 0.45]];
/// Mean loss of a state that explains nearly all readings.
const CLEAR: f64 = 0.05;
/// If two sets find the same, to this part of the loss, the search ends.
const AGAIN: f64 = 0.01;
/// Number of starts kept in each stage.
const FOLLOWED: [usize; 3] = [240, 40, 8];
/// Scales of the loss of each stage, m.
const SCALES_M: [&[f64]; 3] = [&[0.06], &[0.03, 0.01], &[0.005, 0.002, 0.001]];
/// Steps at each scale.
const STEPS: [usize; 3] = [5, 8, 15];
/// Ridge of the linear problem for each reading: undetermined quantities stay small.
const RIDGE: f64 = 1e-6;

/// The state that explains most readings, with one axis placed anew and the others constant; `None` if nothing explains
/// them.
#[must_use]
pub(crate) fn from_nothing(scan: &AxisScan, sought: usize, within_s: f64, threads: usize) -> Option<Refined> {
    let steps = (within_s / OFFSET_STEP_S).ceil() as i32;
    let offsets: Vec<f64> = (-steps..=steps).map(|k| f64::from(k) * OFFSET_STEP_S).collect();
    let mut best: Option<Refined> = None;
    for turn in SETS {
        let set = Set { scan, sought, turn: so3::exp(&Vector3::from(turn)), threads };
        let found = set.best(&offsets);
        let before = best.as_ref().map_or(f64::INFINITY, |best| best.loss);
        let is_better = |found: &&Refined| found.loss < before;
        if let Some(found) = found.as_ref().filter(is_better) {
            best = Some(found.clone());
        }
        let again = found.as_ref().map_or(f64::INFINITY, |found| found.loss);
        let is_again = (again - before).abs() < AGAIN * before.min(again);
        if is_again || best.as_ref().is_some_and(|best| best.loss < CLEAR) {
            break;
        }
    }
    best
}

/// One set of attitudes, all rotated alike, with all time offsets and directions.
struct Set<'a> {
    scan: &'a AxisScan,
    sought: usize,
    turn: UnitQuaternion<f64>,
    threads: usize,
}

impl Set<'_> {
    fn best(&self, offsets: &[f64]) -> Option<Refined> {
        let Self { scan, threads, .. } = *self;
        let readings = scan.some(READINGS[0]);
        let per_offset =
            parallel::filter_map(threads, offsets, |offset_s| Some(trials(self, *offset_s, &readings)));
        let mut starts: Vec<(f64, State)> = per_offset.into_iter().flatten().collect();
        starts.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut states: Vec<State> = starts.into_iter().map(|(_, state)| state).collect();
        let mut best = None;
        for stage in 0..SCALES_M.len() {
            states.truncate(FOLLOWED[stage]);
            let readings = scan.some(READINGS[stage + 1]);
            let mut followed = parallel::filter_map(threads, &states, |state| {
                follow(scan, &readings, state.clone(), SCALES_M[stage], STEPS[stage])
            });
            followed.sort_by(|a, b| a.loss.total_cmp(&b.loss));
            best = followed.first().cloned();
            states = followed.into_iter().map(|refined| refined.state).collect();
        }
        best
    }
}

/// The chain around the sought axis at one reading.
struct Placed {
    around: Around,
    point: Vector3<f64>,
}

/// The trials of one time offset that are kept.
fn trials(set: &Set<'_>, offset_s: f64, readings: &[Reading]) -> Vec<(f64, State)> {
    let Set { scan, sought, turn, .. } = *set;
    let place = |reading: &Reading| {
        let time_s = reading.stamp_s - offset_s;
        let mut around = scan.chain.around(sought, &scan.path.pose_at(time_s)?, time_s)?;
        around.value *= scan.chain.links[sought].axis.scale;
        Some(Placed { around, point: reading.point })
    };
    let placed: Vec<Placed> = readings.iter().filter_map(place).collect();
    if 2 * placed.len() < readings.len() {
        return Vec::new();
    }
    let kind = scan.chain.links[sought].axis.kind;
    let directions: Vec<Vector3<f64>> = match (kind, scan.directions.get(sought).copied().flatten()) {
        (AxisKind::Rotary, Some(stated)) => vec![stated],
        (AxisKind::Rotary, None) => (0..DIRECTIONS).map(direction).collect(),
        (AxisKind::Linear, _) => vec![Vector3::zeros()],
    };
    let mut trials = Vec::new();
    for attitude in so3::cube_rotations() {
        let attitude = turn * attitude;
        for direction in &directions {
            let trial = Trial { placed: &placed, attitude, direction: *direction, normal: scan.normal };
            let Some(Solved { mean_square_m2, tool_from_camera, line, axis }) = trial.solved(kind) else {
                continue;
            };
            let mut chain: AxisChain = scan.chain.clone();
            chain.links[sought].axis = Axis { scale: chain.links[sought].axis.scale, ..axis };
            let state = State { time_offset_s: offset_s, tool_from_camera, line, chain };
            trials.push((mean_square_m2, state));
        }
    }
    trials.sort_by(|a, b| a.0.total_cmp(&b.0));
    trials.truncate(FOLLOWED[0]);
    trials
}

/// The k-th direction of a sphere.
fn direction(k: usize) -> Vector3<f64> {
    let height = 2.0 * (k as f64 + 0.5) / DIRECTIONS as f64 - 1.0;
    let (sin, cos) = (k as f64 * GOLDEN_ANGLE_RAD).sin_cos();
    let radius = (1.0 - height * height).sqrt();
    Vector3::new(radius * cos, radius * sin, height)
}

/// An attitude of the sensor and a direction of the axis.
struct Trial<'a> {
    placed: &'a [Placed],
    attitude: UnitQuaternion<f64>,
    direction: Vector3<f64>,
    normal: Vector3<f64>,
}

/// The remaining unknowns, and the quantities that follow from them.
struct Solved {
    mean_square_m2: f64,
    tool_from_camera: Pose,
    line: Line,
    axis: Axis,
}

/// Unknowns of the linear problem: translation 3, point or direction of the axis 3, place of the seam 2.
const LINEAR: usize = 8;

impl Trial<'_> {
    fn solved(&self, kind: AxisKind) -> Option<Solved> {
        let motion = |value: f64| so3::exp(&(self.direction * value));
        let turns: Vec<UnitQuaternion<f64>> = self.placed.iter().map(|p| motion(p.around.value)).collect();
        let mut along = Vector3::zeros();
        for (placed, turn) in self.placed.iter().zip(&turns) {
            let Around { before, behind, .. } = &placed.around;
            along += before.rotation * (turn * (behind.rotation * (self.attitude * self.normal)));
        }
        let along = UnitVector3::try_new(along, 0.3 * self.placed.len() as f64)?;
        let line = Line::new(Vector3::zeros(), &along);
        let axes = line.axes();
        let mut normal = SMatrix::<f64, LINEAR, LINEAR>::zeros();
        let (mut right, mut squares) = (SVector::<f64, LINEAR>::zeros(), 0.0);
        for (placed, turn) in self.placed.iter().zip(&turns) {
            let Around { before, behind, value } = &placed.around;
            let outer = (before.rotation * turn).to_rotation_matrix().into_inner();
            let by_translation = outer * behind.rotation.to_rotation_matrix().into_inner();
            let of_before = before.rotation.to_rotation_matrix().into_inner();
            let by_axis: Matrix3<f64> = match kind {
                AxisKind::Rotary => of_before - outer,
                AxisKind::Linear => of_before * *value,
            };
            let point = by_translation * (self.attitude * placed.point)
                + outer * behind.translation.vector
                + before.translation.vector;
            for across in 0..2 {
                let axis: Vector3<f64> = axes.column(1 + across).into();
                let mut row = SVector::<f64, LINEAR>::zeros();
                row.fixed_rows_mut::<3>(0).copy_from(&by_translation.tr_mul(&axis));
                row.fixed_rows_mut::<3>(3).copy_from(&by_axis.tr_mul(&axis));
                row[6 + across] = -1.0;
                let wanted = -axis.dot(&point);
                normal.ger(1.0, &row, &row, 1.0);
                right += row * wanted;
                squares += wanted * wanted;
            }
        }
        let count = self.placed.len() as f64;
        for k in 0..6 {
            normal[(k, k)] += RIDGE * count;
        }
        normal[(6, 6)] += 1e-3 * RIDGE * count;
        normal[(7, 7)] += 1e-3 * RIDGE * count;
        let solved = normal.cholesky()?.solve(&right);
        let of_axis: Vector3<f64> = solved.fixed_rows::<3>(3).into();
        let axis = match kind {
            AxisKind::Rotary => Axis::new(kind, UnitVector3::new_unchecked(self.direction), of_axis),
            AxisKind::Linear => Axis::new(kind, UnitVector3::try_new(of_axis, 0.1)?, Vector3::zeros()),
        };
        let anchor = axes.column(1) * solved[6] + axes.column(2) * solved[7];
        Some(Solved {
            mean_square_m2: (squares - solved.dot(&right)).max(0.0) / count,
            tool_from_camera: se3::from_parts(self.attitude, solved.fixed_rows::<3>(0).into()),
            line: Line::new(anchor, &along),
            axis,
        })
    }
}
