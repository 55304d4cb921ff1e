//! Limits of the commands to the robot.

use nalgebra::{UnitVector3, Vector3};
use trueline_geometry::Pose;

/// Speed at which robots may move with people near, m/s (ISO 10218-1, 5.6.2): nothing in a limits file raises it. It holds
/// for every point of the tool's load, not for the tool's origin alone.
pub(crate) const FASTEST_M_S: f64 = 0.250;

/// Limits of every command, for the tool frame in base.
#[derive(Clone, Debug, PartialEq)]
pub struct MotionLimits {
    /// Lower and upper corner of the box for the tool's origin, m.
    pub box_m: [Vector3<f64>; 2],
    /// The direction in base about which the tool's z axis must stay.
    pub tool_axis: UnitVector3<f64>,
    /// Greatest angle between the two, rad.
    pub cone_rad: f64,
    /// Distance from the tool's origin to the farthest point of its load (sensor, torch), m.
    pub reach_m: f64,
    /// Speed of the tool's origin, m/s.
    pub speed_m_s: f64,
    /// Acceleration, m/s².
    pub acceleration_m_s2: f64,
    /// Jerk, m/s³.
    pub jerk_m_s3: f64,
    /// Angular speed, rad/s.
    pub turn_rad_s: f64,
    /// Angular acceleration, rad/s².
    pub turn_acceleration_rad_s2: f64,
    /// How far the robot may be from its reference, m.
    pub deviation_m: f64,
    /// The same for its attitude, rad.
    pub deviation_rad: f64,
    /// How far from the path's first pose a scan may begin, m.
    pub start_m: f64,
    /// The same for the attitude, rad.
    pub start_rad: f64,
}

impl MotionLimits {
    /// Whether a pose is in the box and its tool axis in the cone.
    #[must_use]
    pub fn contain(&self, base_from_tool: &Pose) -> bool {
        self.in_box(&base_from_tool.translation.vector, 0.0)
            && self.cone_angle_rad(base_from_tool) <= self.cone_rad
    }

    /// Whether a point is in the box and at least `margin_m` from its sides.
    #[must_use]
    pub fn in_box(&self, point: &Vector3<f64>, margin_m: f64) -> bool {
        let [low, high] = &self.box_m;
        (0..3).all(|k| point[k] - margin_m >= low[k] && point[k] + margin_m <= high[k])
    }

    /// Angle between the tool's z axis and its wanted direction, rad.
    #[must_use]
    pub fn cone_angle_rad(&self, base_from_tool: &Pose) -> f64 {
        (base_from_tool.rotation * Vector3::z()).angle(&self.tool_axis)
    }

    /// Greatest speed of any point that the tool carries, m/s, for the velocity v of the tool's origin and the angular velocity ω,
    /// both in one frame. Over a ball about the origin ω × p fills a disc square to ω, so it is √(v∥² + (v⊥ + |ω|·reach)²) with the
    /// parts of v along ω and square to it.
    #[must_use]
    pub fn tip_speed_m_s(&self, velocity_m_s: &Vector3<f64>, turn_rad_s: &Vector3<f64>) -> f64 {
        let rate = turn_rad_s.norm();
        if rate == 0.0 {
            return velocity_m_s.norm();
        }
        let along = velocity_m_s.dot(turn_rad_s) / rate;
        let square = (velocity_m_s - turn_rad_s * (along / rate)).norm();
        along.hypot(square + rate * self.reach_m)
    }

    /// Shortest time of a reference for this shift and rotation (a rotation vector in base, rad), s. NaN gives NaN:
    /// `f64::max` would ignore it.
    #[must_use]
    pub(crate) fn least_time_s(&self, shift_m: &Vector3<f64>, turn_rad: &Vector3<f64>) -> f64 {
        let tip_s = self.tip_speed_m_s(shift_m, turn_rad) / FASTEST_M_S;
        [tip_s, shift_m.norm() / self.speed_m_s, turn_rad.norm() / self.turn_rad_s]
            .into_iter()
            .fold(0.0, |most_s, takes_s| if takes_s > most_s || takes_s.is_nan() { takes_s } else { most_s })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn limits() -> MotionLimits {
        MotionLimits {
            box_m: [Vector3::new(-0.1, 0.2, 0.3), Vector3::new(0.4, 0.5, 0.6)],
            tool_axis: -Vector3::z_axis(),
            cone_rad: 30.0_f64.to_radians(),
            reach_m: 0.3,
            speed_m_s: 0.08,
            acceleration_m_s2: 0.5,
            jerk_m_s3: 6.0,
            turn_rad_s: 0.5,
            turn_acceleration_rad_s2: 1.5,
            deviation_m: 0.015,
            deviation_rad: 0.09,
            start_m: 0.004,
            start_rad: 0.03,
        }
    }

    #[test]
    fn box_and_cone_hold_what_is_inside() {
        let limits = limits();
        let down = nalgebra::UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
        let pose = |x: f64, y: f64, z: f64, lean_deg: f64| {
            let lean = nalgebra::UnitQuaternion::from_axis_angle(&Vector3::y_axis(), lean_deg.to_radians());
            Pose::from_parts(Vector3::new(x, y, z).into(), lean * down)
        };
        assert!(limits.contain(&pose(0.0, 0.3, 0.4, 29.9)) && !limits.contain(&pose(0.0, 0.3, 0.4, 30.1)));
        for (x, y, z) in [
            (-0.11, 0.3, 0.4),
            (0.41, 0.3, 0.4),
            (0.0, 0.19, 0.4),
            (0.0, 0.51, 0.4),
            (0.0, 0.3, 0.29),
            (0.0, 0.3, 0.61),
        ] {
            assert!(!limits.contain(&pose(x, y, z, 0.0)));
        }
        assert!(!limits.contain(&pose(f64::NAN, 0.3, 0.4, 0.0)));
    }

    #[test]
    fn a_step_takes_as_long_as_the_slowest_of_origin_attitude_and_tip() {
        let (l, x, y) = (limits(), Vector3::x(), Vector3::y());
        assert!((l.least_time_s(&(x * 0.08), &Vector3::zeros()) - 1.0).abs() < 1e-12, "the origin");
        assert!((l.least_time_s(&Vector3::zeros(), &(y * 0.5)) - 1.0).abs() < 1e-12, "the attitude");
        // 0.07 m and 0.4 rad about 0.3 m: 0.19 m of the tip at 0.25 m/s, less than 0.07/0.08 s.
        assert!((l.least_time_s(&(x * 0.07), &(y * 0.4)) - 0.875).abs() < 1e-12);
        let long = MotionLimits { reach_m: 0.6, ..limits() };
        assert!((long.least_time_s(&(x * 0.07), &(y * 0.4)) - 0.31 / 0.25).abs() < 1e-12, "the tip");
        assert!(l.least_time_s(&(x * f64::NAN), &y).is_nan() && l.least_time_s(&x, &(y * f64::NAN)).is_nan());
    }

    #[test]
    fn no_point_of_the_ball_is_faster_than_the_tip_and_one_is_as_fast() {
        let l = limits();
        let mut k = 0.0_f64;
        let mut any = || {
            k += 1.0;
            Vector3::new((k * 12.9898).sin(), (k * 78.233).sin(), (k * 37.719).sin())
        };
        for _ in 0..50 {
            let (v, w) = (any() * 0.1, any() * 0.5);
            let tip = l.tip_speed_m_s(&v, &w);
            let mut fastest = 0.0_f64;
            for _ in 0..4000 {
                let speed = (v + w.cross(&(any().normalize() * l.reach_m))).norm();
                assert!(speed <= tip + 1e-12);
                fastest = fastest.max(speed);
            }
            // The nearest of 4000 points to the fastest one is some 0.03 rad off: a part of 5e-4 of its speed at most.
            assert!(fastest > 0.99 * tip, "{fastest} of {tip}");
        }
        assert!((l.tip_speed_m_s(&(Vector3::x() * 0.1), &Vector3::zeros()) - 0.1).abs() < 1e-15);
    }
}
