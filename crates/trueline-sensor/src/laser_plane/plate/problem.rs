//! Camera, laser plane, hand-eye transform and plate as one least-squares problem.

use super::residual::OnPlate;
use super::state::{CAMERA, HAND_EYE, LASER_PLANE, PLATE, PlateState, SIZE};
use super::stop::Support;
use crate::bundle::CameraPrior;
use crate::projection::{CAMERA_SIZE, CameraVector, from_vector, to_vector};
use crate::sheet_tilt;
use nalgebra::{DMatrix, DVector, Matrix3, RowSVector, SMatrix, Vector3};
use trueline_geometry::{Pose, se3, so3};
use trueline_lsq::{LeastSquares, NormalEquations};

/// How well a rough hand-eye transform is taken to be known: rotation, rad, and translation, m.
const ROUGH: [f64; 2] = [0.2, 0.050];

/// The problem: two residuals a stop.
#[derive(Clone, Debug)]
pub struct PlateProblem {
    /// The stops.
    pub stops: Vec<Support>,
    /// For each stop the standard deviations of the mean distance of its two points from the laser plane, and of half their
    /// difference, m.
    pub sigmas_m: Vec<[f64; 2]>,
    /// Prior knowledge of the camera.
    pub camera_prior: CameraPrior,
    /// About where the camera is on the robot: to 11° and 50 mm.
    pub rough_tool_from_camera: Pose,
}

/// One stop's two numbers and their derivatives.
pub(super) struct StopRows {
    /// Mean and half difference of the two distances, m.
    pub values_m: [f64; 2],
    /// Their derivatives.
    pub d_unknowns: [SMatrix<f64, 1, SIZE>; 2],
    /// d mean distance / d (plate's surface, along its normal).
    pub d_surface: f64,
    /// Pixels across the stripe for each metre off the laser plane.
    pub px_per_m: f64,
    /// The two points, camera frame, m.
    pub points: [Vector3<f64>; 2],
}

impl StopRows {
    /// `None` where the stripe cannot be on the plate.
    pub(super) fn of(state: &PlateState, stop: &Support) -> Option<Self> {
        let [a, b] = stop.pixels.map(|pixel| OnPlate::of(state, &stop.base_from_tool, &pixel));
        let (a, b) = (a?, b?);
        Some(Self {
            values_m: [0.5 * (a.distance_m + b.distance_m), 0.5 * (b.distance_m - a.distance_m)],
            d_unknowns: [(a.d_unknowns + b.d_unknowns) * 0.5, (b.d_unknowns - a.d_unknowns) * 0.5],
            d_surface: 0.5 * (a.d_surface + b.d_surface),
            px_per_m: 0.5 * (a.px_per_m + b.px_per_m),
            points: [a.point_in_camera, b.point_in_camera],
        })
    }
}

impl PlateProblem {
    /// Off the rough hand-eye transform: rotation vector and translation, each in standard deviations.
    fn off_rough(&self, state: &PlateState) -> [Vector3<f64>; 2] {
        let (turn, shift) = se3::difference_decoupled(&state.tool_from_camera, &self.rough_tool_from_camera);
        [turn / ROUGH[0], shift / ROUGH[1]]
    }

    /// The approximate transform is the prior of undetermined directions.
    fn add_rough(&self, state: &PlateState, equations: &mut NormalEquations) {
        let [turn, shift] = self.off_rough(state);
        let slopes =
            [so3::left_jacobian_inverse(&(turn * ROUGH[0])) / ROUGH[0], Matrix3::identity() / ROUGH[1]];
        for ((off, slope), first) in [turn, shift].iter().zip(slopes).zip([HAND_EYE, HAND_EYE + 3]) {
            let mut hessian = equations.hessian.view_mut((first, first), (3, 3));
            hessian += slope.transpose() * slope;
            let mut gradient = equations.gradient.rows_mut(first, 3);
            gradient += slope.transpose() * off;
            equations.cost += 0.5 * off.norm_squared();
        }
    }
}

impl LeastSquares for PlateProblem {
    type State = PlateState;

    fn dimension(&self) -> usize {
        SIZE
    }

    fn retract(&self, state: &PlateState, step: &DVector<f64>) -> PlateState {
        let camera: CameraVector = to_vector(&state.camera) + step.fixed_rows::<CAMERA_SIZE>(CAMERA);
        let three = |first: usize| -> Vector3<f64> { step.fixed_rows::<3>(first).into() };
        PlateState {
            camera: from_vector(state.camera.size, &camera),
            laser_plane_in_camera: sheet_tilt::moved(&state.laser_plane_in_camera, &three(LASER_PLANE)),
            tool_from_camera: se3::retract_decoupled(
                &state.tool_from_camera,
                &three(HAND_EYE),
                &three(HAND_EYE + 3),
            ),
            plate_in_base: sheet_tilt::moved(&state.plate_in_base, &three(PLATE)),
        }
    }

    fn cost(&self, state: &PlateState) -> f64 {
        let of_stop = |(stop, sigmas): (&Support, &[f64; 2])| {
            let Some(rows) = StopRows::of(state, stop) else { return f64::INFINITY };
            (0..2).map(|k| 0.5 * (rows.values_m[k] / sigmas[k]).powi(2)).sum::<f64>()
        };
        let rough: f64 = self.off_rough(state).iter().map(|off| 0.5 * off.norm_squared()).sum();
        let stops: f64 = self.stops.iter().zip(&self.sigmas_m).map(of_stop).sum();
        stops + rough + self.camera_prior.cost(&state.camera)
    }

    fn linearize(&self, state: &PlateState, equations: &mut NormalEquations) {
        self.camera_prior.add(&state.camera, equations);
        self.add_rough(state, equations);
        for (stop, sigmas) in self.stops.iter().zip(&self.sigmas_m) {
            let Some(rows) = StopRows::of(state, stop) else {
                equations.cost = f64::INFINITY;
                return;
            };
            for (k, sigma) in sigmas.iter().enumerate() {
                let slope: RowSVector<f64, SIZE> = rows.d_unknowns[k] / *sigma;
                let value = rows.values_m[k] / sigma;
                equations.hessian +=
                    DMatrix::from_iterator(SIZE, SIZE, (slope.transpose() * slope).iter().copied());
                equations.gradient += DVector::from_column_slice((slope.transpose() * value).as_slice());
                equations.cost += 0.5 * value * value;
            }
        }
    }
}
