//! Arms from standard Denavit–Hartenberg parameters: each joint is Rz(θ) Tz(d) Tx(a) Rx(α).

use crate::Pose;
use crate::arm::six_axes::{AXES, Arm, Joint};
use nalgebra::{Translation3, UnitQuaternion, Vector3};

/// A row of a table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// Added to the joint's angle, rad.
    pub offset_rad: f64,
    /// Along the joint's axis, m.
    pub d_m: f64,
    /// Along the common normal, m.
    pub a_m: f64,
    /// Twist about the common normal, rad.
    pub alpha_rad: f64,
    /// Smallest and largest angle, rad.
    pub range_rad: [f64; 2],
    /// Largest speed, rad/s.
    pub speed_rad_s: f64,
}

/// The arm of a table. The flange is the frame of its last row.
#[must_use]
pub fn arm(rows: &[Row; AXES]) -> Arm {
    let mut after = Pose::identity();
    let joints = rows.map(|row| {
        let offset = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), row.offset_rad);
        let joint = Joint {
            before: after * Pose::from_parts(Translation3::identity(), offset),
            axis: Vector3::z_axis(),
            range_rad: row.range_rad,
            speed_rad_s: row.speed_rad_s,
            acceleration_rad_s2: None,
        };
        let twist = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), row.alpha_rad);
        after = Pose::from_parts(Translation3::new(row.a_m, 0.0, row.d_m), twist);
        joint
    });
    Arm { joints, last_from_flange: after }
}
