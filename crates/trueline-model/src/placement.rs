//! Stage 3: point in the camera → point in base, through hand-eye, robot motion and time offset.
//!
//! p_E = R_EC p_C + p_EC,  p_B = R_BE(t − t_d) p_E + p_BE(t − t_d)  \[Yang2025, Eq. 3\].

use nalgebra::{Matrix2x3, Matrix3, SVector, Vector3};
use trueline_geometry::{Pose, Segment, so3};

/// Pose and motion of the sensor when one frame was exposed.
#[derive(Clone, Copy, Debug)]
pub struct Placement {
    /// Robot pose at the exposure.
    pub base_from_tool: Pose,
    /// Hand-eye transform.
    pub tool_from_camera: Pose,
    /// Angular velocity of the tool in base, R_BE ω, rad/s.
    pub angular_velocity: Vector3<f64>,
    /// Velocity of the tool origin in base, m/s.
    pub velocity: Vector3<f64>,
}

/// Jacobians of p_B for one point fixed in the camera frame, with perturbations as in \[Yang2025, Eq. 18\].
#[derive(Clone, Copy, Debug)]
pub struct PlacementJacobian {
    /// d p_B / d t_d, m/s.
    pub d_point_d_time_offset: Vector3<f64>,
    /// d p_B / d δ for R_EC ← Exp(δ) R_EC, m/rad.
    pub d_point_d_rotation: Matrix3<f64>,
    /// d p_B / d p_EC: R_BE.
    pub d_point_d_translation: Matrix3<f64>,
}

/// Derivatives of a number by the sensor's motion as a rigid body, in axes of base, with rotations about the origin of the tool.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseGradient {
    /// By a shift, in its unit per metre.
    pub by_shift: Vector3<f64>,
    /// By a rotation, in its unit per radian.
    pub by_turn: Vector3<f64>,
}

impl PoseGradient {
    /// The gradient of a constant.
    pub const ZERO: Self =
        Self { by_shift: Vector3::new(0.0, 0.0, 0.0), by_turn: Vector3::new(0.0, 0.0, 0.0) };

    /// Adds a fraction of another.
    #[inline]
    pub fn add(&mut self, other: &Self, part: f64) {
        self.by_shift += other.by_shift * part;
        self.by_turn += other.by_turn * part;
    }
}

/// Derivatives by time offset (1/s), hand-eye rotation (left, tool frame, 1/rad) and hand-eye translation (1/m), times a number's unit, in this
/// order.
pub type ByLinks = SVector<f64, 7>;

impl Placement {
    /// The placement at `exposure_time` (s, robot clock), which lies in or next to `segment`.
    #[must_use]
    pub fn new(segment: &Segment, exposure_time: f64, tool_from_camera: &Pose) -> Self {
        let base_from_tool = segment.pose_at(exposure_time);
        Self {
            base_from_tool,
            tool_from_camera: *tool_from_camera,
            angular_velocity: base_from_tool.rotation * segment.body_rate,
            velocity: segment.velocity,
        }
    }

    /// `base_from_camera`.
    #[must_use]
    pub fn base_from_camera(&self) -> Pose {
        self.base_from_tool * self.tool_from_camera
    }

    /// A point of the camera frame in base \[Yang2025, Eq. 3\], m.
    #[must_use]
    pub fn point_in_base(&self, point_in_camera: &Vector3<f64>) -> Vector3<f64> {
        let point_in_tool =
            self.tool_from_camera.rotation * point_in_camera + self.tool_from_camera.translation.vector;
        self.base_from_tool.rotation * point_in_tool + self.base_from_tool.translation.vector
    }

    /// Jacobians of [`Placement::point_in_base`] at a point of the camera frame.
    #[must_use]
    pub fn jacobian(&self, point_in_camera: &Vector3<f64>) -> PlacementJacobian {
        let rotated = self.tool_from_camera.rotation * point_in_camera;
        let lever = self.base_from_tool.rotation * (rotated + self.tool_from_camera.translation.vector);
        let base_from_tool = self.base_from_tool.rotation.to_rotation_matrix().into_inner();
        PlacementJacobian {
            // Differs from Eqs. (7) and (12). d R/d t_d = −R [ω]×, so the rotation part is −(R ω) × (R p_E) = +[R p_E]× R ω. The lever is the whole
            // p_E, including p_EC.
            d_point_d_time_offset: lever.cross(&self.angular_velocity) - self.velocity,
            d_point_d_rotation: -base_from_tool * so3::hat(&rotated), // Eq. (14)
            d_point_d_translation: base_from_tool,                    // Eq. (15)
        }
    }

    /// By the pose, of a number with the gradient `by_point` by a point of the sensor at `point_in_base`.
    #[must_use]
    #[inline]
    pub fn by_pose(&self, point_in_base: &Vector3<f64>, by_point: &Vector3<f64>) -> PoseGradient {
        let lever = point_in_base - self.base_from_tool.translation.vector;
        PoseGradient { by_shift: *by_point, by_turn: lever.cross(by_point) }
    }

    /// The same of two numbers; the rows of a matrix are their gradients by the point.
    #[must_use]
    #[inline]
    pub(crate) fn by_pose_of_two(
        &self,
        point_in_base: &Vector3<f64>,
        by_point: &Matrix2x3<f64>,
    ) -> [PoseGradient; 2] {
        [0, 1].map(|row| self.by_pose(point_in_base, &by_point.row(row).transpose()))
    }

    /// Maps a gradient by the pose of the sensor to the time offset and to the hand-eye transform. The exposure is earlier by t_d, so the tool moves
    /// back along its motion. A perturbation of the hand-eye transform is one of the pose, in the tool frame.
    #[must_use]
    #[inline]
    pub fn carried(&self, by_pose: &PoseGradient) -> ByLinks {
        let PoseGradient { by_shift, by_turn } = by_pose;
        let tool_from_base = self.base_from_tool.rotation.inverse();
        let by_time = -(by_shift.dot(&self.velocity) + by_turn.dot(&self.angular_velocity));
        let shift = tool_from_base * by_shift;
        let turn = tool_from_base * by_turn - self.tool_from_camera.translation.vector.cross(&shift);
        ByLinks::from([by_time, turn.x, turn.y, turn.z, shift.x, shift.y, shift.z])
    }
}
