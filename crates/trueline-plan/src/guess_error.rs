//! How wrong hand-eye and line may be while the scan is planned, and where the seam may then appear.
//!
//! The sheet residual's Jacobian says how the seam moves in the sheet when an unknown moves. For unknowns within balls
//! (|δt| ≤ T, |δθ| ≤ Θ, the line within Λ) the seam then stays within a sum of ellipses, whose outermost point in
//! a direction d is Σ rₖ Jₖ Jₖᵀd / |Jₖᵀd|.

use crate::seam::Seam;
use nalgebra::{Matrix2x3, Vector2, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, UnitBall, UnitSphere};
use std::sync::LazyLock;
use trueline_geometry::{Pose, se3};
use trueline_model::Placement;
use trueline_model::point_to_line::ResidualJacobian;

/// Largest errors of the guess that the plan must survive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GuessError {
    /// Hand-eye translation, m.
    pub translation_m: f64,
    /// Hand-eye rotation, about any axis, rad.
    pub rotation_rad: f64,
    /// Distance of the line from where it was thought, m.
    pub line_m: f64,
}

impl Default for GuessError {
    fn default() -> Self {
        Self { translation_m: 0.010, rotation_rad: 5.0_f64.to_radians(), line_m: 0.020 }
    }
}

/// Directions in which the seam is followed out of view.
pub const DIRECTIONS: usize = 12;

/// Evenly around, in the sheet.
static AROUND: LazyLock<[Vector2<f64>; DIRECTIONS]> = LazyLock::new(|| {
    std::array::from_fn(|k| {
        let angle = std::f64::consts::TAU * k as f64 / DIRECTIONS as f64;
        Vector2::new(angle.cos(), angle.sin())
    })
});

impl GuessError {
    /// How far the seam can be from where it is expected, in the sheet, for one direction out of [`DIRECTIONS`], m.
    #[must_use]
    pub fn outermost(&self, jacobian: &ResidualJacobian, direction: usize) -> Vector2<f64> {
        let d = AROUND[direction];
        let line_shift = jacobian.d_line.fixed_columns::<2>(2);
        stretched(&jacobian.d_translation, &d, self.translation_m)
            + stretched(&jacobian.d_rotation, &d, self.rotation_rad)
            + line_shift
                * (line_shift.transpose() * d)
                    .try_normalize(f64::MIN_POSITIVE)
                    .map_or_else(Vector2::zeros, |u| u * self.line_m)
    }

    /// How far along the seam the sheet can meet it from where that is expected, counted from the seam's own ends, m: the
    /// sheet moves by the camera's shift and turn along its normal, the seam by what it is off.
    #[must_use]
    pub fn along_seam(
        &self,
        placement: &Placement,
        point_in_camera: &Vector3<f64>,
        direction: &Vector3<f64>,
        sheet_normal_in_camera: &Vector3<f64>,
    ) -> f64 {
        let base_from_camera = placement.base_from_camera().rotation;
        let normal = base_from_camera * sheet_normal_in_camera;
        let turned = placement.jacobian(point_in_camera).d_point_d_rotation.transpose() * normal;
        let shift = self.translation_m + self.rotation_rad * turned.norm() + self.line_m;
        shift / normal.dot(direction).abs()
    }

    /// A hand-eye transform and a seam that are wrong at random, anywhere within the errors allowed.
    #[must_use]
    pub fn disturbed(&self, tool_from_camera: &Pose, seam: &Seam, seed: u64) -> (Pose, Seam) {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        self.moved(tool_from_camera, seam, || Vector3::from(UnitBall.sample(&mut random)))
    }

    /// The same with every error as large as is allowed: only its direction is random.
    #[must_use]
    pub fn disturbed_most(&self, tool_from_camera: &Pose, seam: &Seam, seed: u64) -> (Pose, Seam) {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        self.moved(tool_from_camera, seam, || Vector3::from(UnitSphere.sample(&mut random)))
    }

    /// Both ends of the seam move on their own: what lies between them is then no further off than they are.
    fn moved(
        &self,
        tool_from_camera: &Pose,
        seam: &Seam,
        mut part: impl FnMut() -> Vector3<f64>,
    ) -> (Pose, Seam) {
        let (turn, shift) = (part() * self.rotation_rad, part() * self.translation_m);
        let mut off = |end: &Vector3<f64>| end + part() * self.line_m;
        let moved = Seam { from_m: off(&seam.from_m), to_m: off(&seam.to_m) };
        (se3::retract_decoupled(tool_from_camera, &turn, &shift), moved)
    }
}

/// r J Jᵀd / |Jᵀd|: the image of a ball of radius r, outermost towards d.
fn stretched(jacobian: &Matrix2x3<f64>, d: &Vector2<f64>, radius: f64) -> Vector2<f64> {
    let pulled = jacobian.transpose() * d;
    pulled.try_normalize(f64::MIN_POSITIVE).map_or_else(Vector2::zeros, |u| jacobian * u * radius)
}
