//! What the robot may be told to do.

use nalgebra::{UnitVector3, Vector3};
use serde::Deserialize;
use std::path::Path;
use trueline_dataset::sensor_toml::parse_toml;
use trueline_dataset::{Error, Problem};
use trueline_geometry::Pose;

/// Speed at which robots may move with people near, m/s (ISO 10218-1, 5.6.2): nothing in a limits file raises it.
pub const FASTEST_M_S: f64 = 0.250;

/// Limits of every command, for the tool frame in base.
#[derive(Clone, Debug, PartialEq)]
pub struct MotionLimits {
    /// Lower and upper corner of the box for the tool's origin, m.
    pub box_m: [Vector3<f64>; 2],
    /// The direction in base about which the tool's z axis must stay.
    pub tool_axis: UnitVector3<f64>,
    /// Greatest angle between the two, rad.
    pub cone_rad: f64,
    /// Speed, m/s.
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

    /// Angle between the tool's z axis and where it should point, rad.
    #[must_use]
    pub fn cone_angle_rad(&self, base_from_tool: &Pose) -> f64 {
        (base_from_tool.rotation * Vector3::z()).angle(&self.tool_axis)
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct LimitsFile {
    r#box: BoxTable,
    tool_cone: ConeTable,
    motion: MotionTable,
    deviation: DistanceTable,
    start: DistanceTable,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct BoxTable {
    min_mm: [f64; 3],
    max_mm: [f64; 3],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ConeTable {
    axis: [f64; 3],
    half_angle_deg: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MotionTable {
    speed_mm_s: f64,
    acceleration_mm_s2: f64,
    jerk_mm_s3: f64,
    turn_deg_s: f64,
    turn_acceleration_deg_s2: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct DistanceTable {
    distance_mm: f64,
    angle_deg: f64,
}

/// Reads a limits file. Every key must be there: what a robot may do is said, not assumed.
///
/// # Errors
/// A file that is no such table, or limits that make no sense.
pub fn parse(file: &Path, text: &str) -> Result<MotionLimits, Error> {
    let wire: LimitsFile = parse_toml(file, text)?;
    checked(&wire).map_err(|problem| Error::in_file(file, problem))
}

fn checked(wire: &LimitsFile) -> Result<MotionLimits, Problem> {
    let LimitsFile { motion, deviation, start, .. } = wire;
    let (low, high) = (Vector3::from(wire.r#box.min_mm), Vector3::from(wire.r#box.max_mm));
    if !(0..3).all(|k| low[k].is_finite() && high[k].is_finite() && low[k] < high[k]) {
        let found = format!("{:?} to {:?}", wire.r#box.min_mm, wire.r#box.max_mm);
        return Err(Problem::Value { key: "box", expected: "min_mm below max_mm on each axis", found });
    }
    let axis = Vector3::from(wire.tool_cone.axis);
    let tool_axis = UnitVector3::try_new(axis, 1e-6).filter(|axis| axis.iter().all(|v| v.is_finite()));
    let no_axis = || Problem::Value {
        key: "tool_cone.axis",
        expected: "a direction",
        found: format!("{:?}", wire.tool_cone.axis),
    };
    let speed_m_s = positive("motion.speed_mm_s", motion.speed_mm_s, MM)?;
    if speed_m_s > FASTEST_M_S {
        return Err(Problem::Value {
            key: "motion.speed_mm_s",
            expected: "at most 250 mm/s, the speed with people near (ISO 10218-1)",
            found: format!("{} mm/s", motion.speed_mm_s),
        });
    }
    let turn_acceleration = motion.turn_acceleration_deg_s2;
    Ok(MotionLimits {
        box_m: [low * MM, high * MM],
        tool_axis: tool_axis.ok_or_else(no_axis)?,
        cone_rad: positive("tool_cone.half_angle_deg", wire.tool_cone.half_angle_deg, DEGREE)?,
        speed_m_s,
        acceleration_m_s2: positive("motion.acceleration_mm_s2", motion.acceleration_mm_s2, MM)?,
        jerk_m_s3: positive("motion.jerk_mm_s3", motion.jerk_mm_s3, MM)?,
        turn_rad_s: positive("motion.turn_deg_s", motion.turn_deg_s, DEGREE)?,
        turn_acceleration_rad_s2: positive("motion.turn_acceleration_deg_s2", turn_acceleration, DEGREE)?,
        deviation_m: positive("deviation.distance_mm", deviation.distance_mm, MM)?,
        deviation_rad: positive("deviation.angle_deg", deviation.angle_deg, DEGREE)?,
        start_m: positive("start.distance_mm", start.distance_mm, MM)?,
        start_rad: positive("start.angle_deg", start.angle_deg, DEGREE)?,
    })
}

const MM: f64 = 1e-3;
const DEGREE: f64 = std::f64::consts::PI / 180.0;

fn positive(key: &'static str, value: f64, per_unit: f64) -> Result<f64, Problem> {
    if value > 0.0 && value.is_finite() {
        return Ok(value * per_unit);
    }
    Err(Problem::Value { key, expected: "a number above 0", found: value.to_string() })
}

/// A limits file with every key explained.
#[must_use]
pub fn format(limits: &MotionLimits) -> String {
    let mm = |metres: f64| format!("{:.1}", metres * 1e3);
    let corner = |corner: &Vector3<f64>| format!("[{}, {}, {}]", mm(corner.x), mm(corner.y), mm(corner.z));
    let deg = |angle: f64| format!("{:.2}", angle.to_degrees());
    let axis = limits.tool_axis;
    format!(
        "# What the robot may be told by `trueline scan --enable-motion`. Read every line before you allow it.\n\
         # These limits are not safety-rated: fence, enabling device, emergency stop and the controller's own\n\
         # supervision protect people; these protect the seam and the sensor.\n\n\
         [box] # the tool's origin stays within, robot base\n\
         min_mm = {}\nmax_mm = {}\n\n\
         [tool_cone] # the tool's z axis stays this near to a direction in base\n\
         axis = [{:.4}, {:.4}, {:.4}]\nhalf_angle_deg = {}\n\n\
         [motion] # of the tool's origin; a sensor that is 300 mm away moves faster by 5 mm/s for each °/s\n\
         speed_mm_s = {} # at most 250\nacceleration_mm_s2 = {}\njerk_mm_s3 = {}\n\
         turn_deg_s = {}\nturn_acceleration_deg_s2 = {}\n\n\
         [deviation] # robot from its reference; further off, and it is held where it is\n\
         distance_mm = {}\nangle_deg = {}\n\n\
         [start] # robot from the path's first pose; further off, and nothing begins\n\
         distance_mm = {}\nangle_deg = {}\n",
        corner(&limits.box_m[0]),
        corner(&limits.box_m[1]),
        axis.x,
        axis.y,
        axis.z,
        deg(limits.cone_rad),
        mm(limits.speed_m_s),
        mm(limits.acceleration_m_s2),
        mm(limits.jerk_m_s3),
        deg(limits.turn_rad_s),
        deg(limits.turn_acceleration_rad_s2),
        mm(limits.deviation_m),
        deg(limits.deviation_rad),
        mm(limits.start_m),
        deg(limits.start_rad),
    )
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;

    const TEXT: &str = "
[box]
min_mm = [-100, 200, 300]
max_mm = [400, 500, 600]
[tool_cone]
axis = [0, 0, -2]
half_angle_deg = 30
[motion]
speed_mm_s = 80
acceleration_mm_s2 = 500
jerk_mm_s3 = 6000
turn_deg_s = 45
turn_acceleration_deg_s2 = 90
[deviation]
distance_mm = 15
angle_deg = 5
[start]
distance_mm = 4
angle_deg = 2
";

    #[test]
    fn figures_are_read_in_their_units_and_written_as_they_are_read() {
        let read = parse(Path::new("limits.toml"), TEXT).unwrap();
        let degree = std::f64::consts::PI / 180.0;
        let expected = MotionLimits {
            box_m: [Vector3::new(-0.1, 0.2, 0.3), Vector3::new(0.4, 0.5, 0.6)],
            tool_axis: -Vector3::z_axis(),
            cone_rad: 30.0 * degree,
            speed_m_s: 0.08,
            acceleration_m_s2: 0.5,
            jerk_m_s3: 6.0,
            turn_rad_s: 45.0 * degree,
            turn_acceleration_rad_s2: 90.0 * degree,
            deviation_m: 0.015,
            deviation_rad: 5.0 * degree,
            start_m: 0.004,
            start_rad: 2.0 * degree,
        };
        assert!(
            (read.box_m[0] - expected.box_m[0]).norm() < 1e-15
                && (read.box_m[1] - expected.box_m[1]).norm() < 1e-15
        );
        let figures = |l: &MotionLimits| {
            [
                l.cone_rad,
                l.speed_m_s,
                l.acceleration_m_s2,
                l.jerk_m_s3,
                l.turn_rad_s,
                l.turn_acceleration_rad_s2,
                l.deviation_m,
                l.deviation_rad,
                l.start_m,
                l.start_rad,
            ]
        };
        for (found, wanted) in figures(&read).into_iter().zip(figures(&expected)) {
            assert!((found - wanted).abs() < 1e-12, "{found} is not {wanted}");
        }
        assert_eq!(read.tool_axis, expected.tool_axis);
        let again = parse(Path::new("limits.toml"), &format(&read)).unwrap();
        // Written to 0.01 of each unit or better.
        for (found, wanted) in figures(&again).into_iter().zip(figures(&read)) {
            assert!((found - wanted).abs() < 1e-3, "{found} is not {wanted}");
        }
    }

    #[test]
    fn box_and_cone_hold_what_is_inside() {
        let limits = parse(Path::new("limits.toml"), TEXT).unwrap();
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
}
