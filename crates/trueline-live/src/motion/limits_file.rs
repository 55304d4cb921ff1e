//! The file of limits that somebody has read: every key must be there, and every figure plausible.

use super::limits::{FASTEST_M_S, MotionLimits};
use nalgebra::{UnitVector3, Vector3};
use serde::Deserialize;
use std::path::Path;
use trueline_dataset::sensor_toml::parse_toml;
use trueline_dataset::{Error, Problem};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct LimitsFile {
    r#box: BoxTable,
    tool_cone: ConeTable,
    sensor: SensorTable,
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
struct SensorTable {
    reach_mm: f64,
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

/// Reads a limits file. Every key must be there: the limits of a robot are stated, not assumed.
///
/// # Errors
/// A file without such a table, or limits without a sense.
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
    if [low, high].iter().any(|corner| corner.amax() * MM > FARTHEST_M)
        || (high - low).max() * MM > FARTHEST_M
    {
        let found = format!("{:?} to {:?}", wire.r#box.min_mm, wire.r#box.max_mm);
        return Err(Problem::Value { key: "box", expected: "corners and sides within 10 000 mm", found });
    }
    let axis = Vector3::from(wire.tool_cone.axis);
    let tool_axis = UnitVector3::try_new(axis, 1e-6).filter(|axis| axis.iter().all(|v| v.is_finite()));
    let no_axis = || Problem::Value {
        key: "tool_cone.axis",
        expected: "a direction",
        found: format!("{:?}", wire.tool_cone.axis),
    };
    let reach_m = plausible("sensor.reach_mm", wire.sensor.reach_mm, MM, REACH)?;
    let turn_rad_s = positive("motion.turn_deg_s", motion.turn_deg_s, DEGREE)?;
    if turn_rad_s * reach_m > FASTEST_M_S * ROUNDED {
        let found = format!("{} °/s at a reach of {} mm", motion.turn_deg_s, wire.sensor.reach_mm);
        let expected = "rotation that moves the tool's load by at most 250 mm/s";
        return Err(Problem::Value { key: "motion.turn_deg_s", expected, found });
    }
    Ok(MotionLimits {
        box_m: [low * MM, high * MM],
        tool_axis: tool_axis.ok_or_else(no_axis)?,
        cone_rad: plausible("tool_cone.half_angle_deg", wire.tool_cone.half_angle_deg, DEGREE, CONE)?,
        reach_m,
        speed_m_s: plausible("motion.speed_mm_s", motion.speed_mm_s, MM, SPEED)?,
        acceleration_m_s2: plausible(
            "motion.acceleration_mm_s2",
            motion.acceleration_mm_s2,
            MM,
            ACCELERATION,
        )?,
        jerk_m_s3: plausible("motion.jerk_mm_s3", motion.jerk_mm_s3, MM, JERK)?,
        turn_rad_s,
        turn_acceleration_rad_s2: plausible(
            "motion.turn_acceleration_deg_s2",
            motion.turn_acceleration_deg_s2,
            DEGREE,
            TURN_ACCELERATION,
        )?,
        deviation_m: plausible("deviation.distance_mm", deviation.distance_mm, MM, NEAR)?,
        deviation_rad: plausible("deviation.angle_deg", deviation.angle_deg, DEGREE, NEARLY_TURNED)?,
        start_m: plausible("start.distance_mm", start.distance_mm, MM, NEAR)?,
        start_rad: plausible("start.angle_deg", start.angle_deg, DEGREE, NEARLY_TURNED)?,
    })
}

const MM: f64 = 1e-3;
const DEGREE: f64 = std::f64::consts::PI / 180.0;
/// Farthest corner of the box, and its longest side, m: no robot reaches further.
const FARTHEST_M: f64 = 10.0;
/// Figures are written with two digits after the point.
const ROUNDED: f64 = 1.001;

/// The greatest sensible figure, in the units of the file, and the message about a greater one.
type Most = (f64, &'static str);
const REACH: Most = (3000.0, "at most 3000 mm");
const CONE: Most = (180.0, "at most 180°");
const SPEED: Most = (FASTEST_M_S / MM, "at most 250 mm/s, the speed with people near (ISO 10218-1)");
const ACCELERATION: Most = (10_000.0, "at most 10 000 mm/s²");
const JERK: Most = (1e6, "at most 1 000 000 mm/s³");
const TURN_ACCELERATION: Most = (2000.0, "at most 2000 °/s²");
const NEAR: Most = (100.0, "at most 100 mm");
const NEARLY_TURNED: Most = (20.0, "at most 20°");

fn positive(key: &'static str, value: f64, per_unit: f64) -> Result<f64, Problem> {
    if value > 0.0 && value.is_finite() {
        return Ok(value * per_unit);
    }
    Err(Problem::Value { key, expected: "a number above 0", found: value.to_string() })
}

fn plausible(key: &'static str, value: f64, per_unit: f64, (most, expected): Most) -> Result<f64, Problem> {
    let figure = positive(key, value, per_unit)?;
    if value <= most { Ok(figure) } else { Err(Problem::Value { key, expected, found: value.to_string() }) }
}

/// A limits file with every key explained.
#[must_use]
pub fn format(limits: &MotionLimits) -> String {
    let mm = |metres: f64| format!("{:.1}", metres * 1e3);
    let corner = |corner: &Vector3<f64>| format!("[{}, {}, {}]", mm(corner.x), mm(corner.y), mm(corner.z));
    let deg = |angle: f64| format!("{:.2}", angle.to_degrees());
    let axis = limits.tool_axis;
    format!(
        "# Limits of the commands that `trueline scan --enable-motion` may send. Read every line before you allow it.\n\
         # These limits are not safety-rated: fence, enabling device, emergency stop and the controller's own\n\
         # supervision protect people; these protect the seam and the sensor.\n\n\
         [box] # the tool's origin stays within, robot base\n\
         min_mm = {}\nmax_mm = {}\n\n\
         [tool_cone] # the tool's z axis stays this near to a direction in base\n\
         axis = [{:.4}, {:.4}, {:.4}]\nhalf_angle_deg = {}\n\n\
         [sensor] # no point of the tool's load moves faster than 250 mm/s, at any value below\n\
         reach_mm = {} # from the tool's origin to the farthest point of sensor and torch\n\n\
         [motion] # of the tool's origin\n\
         speed_mm_s = {} # at most 250\nacceleration_mm_s2 = {}\njerk_mm_s3 = {}\n\
         turn_deg_s = {}\nturn_acceleration_deg_s2 = {}\n\n\
         [deviation] # robot from its reference; if further off, it is held in place\n\
         distance_mm = {}\nangle_deg = {}\n\n\
         [start] # robot from the path's first pose; if further off, the scan does not start\n\
         distance_mm = {}\nangle_deg = {}\n",
        corner(&limits.box_m[0]),
        corner(&limits.box_m[1]),
        axis.x,
        axis.y,
        axis.z,
        deg(limits.cone_rad),
        mm(limits.reach_m),
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
[sensor]
reach_mm = 300
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
            reach_m: 0.3,
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
                l.reach_m,
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
    fn implausible_figures_are_refused_by_name() {
        for (line, wrong, key) in [
            ("half_angle_deg = 30", "half_angle_deg = 100000", "tool_cone.half_angle_deg"),
            ("turn_deg_s = 45", "turn_deg_s = 1e9", "motion.turn_deg_s"),
            ("turn_deg_s = 45", "turn_deg_s = 48", "motion.turn_deg_s"),
            ("reach_mm = 300", "reach_mm = 5000", "sensor.reach_mm"),
            ("reach_mm = 300", "reach_mm = 0", "sensor.reach_mm"),
            ("[sensor]\nreach_mm = 300", "", "sensor"),
            ("speed_mm_s = 80", "speed_mm_s = 251", "motion.speed_mm_s"),
            ("min_mm = [-100, 200, 300]", "min_mm = [-1e12, 200, 300]", "box"),
            ("max_mm = [400, 500, 600]", "max_mm = [9950, 500, 600]", "box"),
            ("distance_mm = 15", "distance_mm = 101", "deviation.distance_mm"),
            ("angle_deg = 5", "angle_deg = 21", "deviation.angle_deg"),
            ("distance_mm = 4", "distance_mm = 1e12", "start.distance_mm"),
            ("acceleration_mm_s2 = 500", "acceleration_mm_s2 = 1e9", "motion.acceleration_mm_s2"),
            ("jerk_mm_s3 = 6000", "jerk_mm_s3 = inf", "motion.jerk_mm_s3"),
        ] {
            assert!(TEXT.contains(line), "{line}");
            let refused = parse(Path::new("limits.toml"), &TEXT.replacen(line, wrong, 1)).unwrap_err();
            assert!(refused.to_string().contains(key), "{wrong}: {refused}");
        }
    }

    #[test]
    fn the_greatest_figures_that_make_sense_are_taken() {
        let turned_slowly = TEXT.replacen("turn_deg_s = 45", "turn_deg_s = 4.7", 1);
        for (text, line, most) in [
            (TEXT, "half_angle_deg = 30", "half_angle_deg = 180"),
            (TEXT, "speed_mm_s = 80", "speed_mm_s = 250"),
            (TEXT, "acceleration_mm_s2 = 500", "acceleration_mm_s2 = 10000"),
            (TEXT, "jerk_mm_s3 = 6000", "jerk_mm_s3 = 1e6"),
            (TEXT, "turn_acceleration_deg_s2 = 90", "turn_acceleration_deg_s2 = 2000"),
            (TEXT, "distance_mm = 15", "distance_mm = 100"),
            (TEXT, "angle_deg = 5", "angle_deg = 20"),
            // 0.25 m/s over 0.3 m are 47.746°/s; a figure with two digits may be 0.1 % more.
            (TEXT, "turn_deg_s = 45", "turn_deg_s = 47.75"),
            (&turned_slowly, "reach_mm = 300", "reach_mm = 3000"),
            (TEXT, "min_mm = [-100, ", "min_mm = [-9500, "),
        ] {
            assert!(text.contains(line), "{line}");
            let read = parse(Path::new("limits.toml"), &text.replacen(line, most, 1));
            assert!(read.is_ok(), "{most}: {read:?}");
        }
        for (line, wrong, key) in [
            ("min_mm = [-100, 200, 300]", "min_mm = [-100, 500, 300]", "box"),
            ("min_mm = [-100, 200, 300]", "min_mm = [-100, nan, 300]", "box"),
            ("min_mm = [-100, 200, 300]", "min_mm = [-9601, 200, 300]", "box"),
            ("axis = [0, 0, -2]", "axis = [0, 0, 0]", "tool_cone.axis"),
            ("axis = [0, 0, -2]", "axis = [0, 0, inf]", "tool_cone.axis"),
        ] {
            let refused = parse(Path::new("limits.toml"), &TEXT.replacen(line, wrong, 1)).unwrap_err();
            assert!(refused.to_string().contains(key), "{wrong}: {refused}");
        }
    }
}
