//! Scans in cells with external axes: the seam is scanned as if the cell had none, and the robot moves accordingly.

use crate::motion::Motion;
use crate::noise::Noise;
use crate::scenario::Scenario;
use crate::simulate::record_reported;
use nalgebra::{Rotation3, Translation3, Unit, UnitQuaternion, Vector3};
use std::f64::consts::TAU;
use trueline_dataset::axes::AxisValue;
use trueline_dataset::{AxisRecord, Carries, Recording};
use trueline_geometry::{Axis, AxisKind, Pose};

/// Motion of an axis during the scan.
#[derive(Clone, Debug, PartialEq)]
pub enum AxisCourse {
    /// It stands at one place after the other, rad or m, for equal times.
    Stands(Vec<f64>),
    /// It swings about zero, as far (rad or m) and as often (Hz).
    Swings {
        /// To either side.
        by: f64,
        /// How often, Hz.
        hz: f64,
    },
    /// It runs at a rate, rad/s or m/s.
    Runs(f64),
    /// It goes through values (rad or m) at rising times (s), at constant rate between them, and rests before and after.
    Follows {
        /// The times, s.
        times_s: Vec<f64>,
        /// The values.
        values: Vec<f64>,
    },
}

/// An axis of a simulated cell.
#[derive(Clone, Debug, PartialEq)]
pub struct SimulatedAxis {
    /// Its name.
    pub name: String,
    /// The body that it moves.
    pub carries: Carries,
    /// Its place.
    pub axis: Axis,
    /// Its motion.
    pub course: AxisCourse,
}

/// From one place to the next it takes this long, s.
const BETWEEN_S: f64 = 0.8;
/// Time between two values of an axis, s.
const PERIOD_S: f64 = 0.008;
/// Distance of an axis from the seam, m, least and most.
const BESIDE_M: [f64; 2] = [0.15, 0.5];

impl AxisCourse {
    /// Its value at a time, s, of a scan that lasts so long, s.
    fn at(&self, time_s: f64, duration_s: f64) -> f64 {
        match self {
            Self::Swings { by, hz } => by * (TAU * hz * time_s).sin(),
            Self::Runs(rate) => rate * time_s,
            Self::Follows { times_s, values } => {
                let next = times_s.partition_point(|t| *t <= time_s).clamp(1, times_s.len() - 1);
                let (from_s, to_s) = (times_s[next - 1], times_s[next]);
                let part = ((time_s - from_s) / (to_s - from_s)).clamp(0.0, 1.0);
                values[next - 1] + (values[next] - values[next - 1]) * part
            }
            Self::Stands(places) => {
                let each_s = duration_s / places.len() as f64;
                let last = places.len() - 1;
                let k = ((time_s / each_s).floor().max(0.0) as usize).min(last);
                let left_s = (k + 1) as f64 * each_s - time_s;
                if k == last || left_s >= BETWEEN_S {
                    return places[k];
                }
                // It sets off and arrives smoothly.
                let part = 1.0 - left_s / BETWEEN_S;
                places[k] + (places[k + 1] - places[k]) * part * part * (3.0 - 2.0 * part)
            }
        }
    }
}

impl SimulatedAxis {
    /// An axis in any direction beside the seam of a scenario, with a time offset of up to 40 ms.
    #[must_use]
    pub fn somewhere(
        name: &str,
        (kind, carries): (AxisKind, Carries),
        course: AxisCourse,
        scenario: &Scenario,
        seed: u64,
    ) -> Self {
        let mut noise = Noise::new(seed, 40);
        let mut any = || Unit::new_normalize(Vector3::from_fn(|_, _| noise.normal(1.0)));
        let (direction, beside) = (any(), any());
        let seam = scenario.cell.lines.first().map_or_else(Vector3::zeros, |line| *line.anchor());
        let beside = beside.into_inner() - direction.as_ref() * direction.dot(&beside);
        let [least_m, most_m] = BESIDE_M;
        let point_m = seam + beside.normalize() * noise.uniform(least_m, most_m);
        let time_offset_s = noise.uniform(-0.04, 0.04);
        let axis = Axis { time_offset_s, ..Axis::new(kind, direction, point_m) };
        Self { name: name.to_owned(), carries, axis, course }
    }

    /// Its effect on a point in base, or in the tool if it carries the sensor.
    fn motion(&self, value: f64) -> Pose {
        let Axis { kind, direction, point_m, scale, .. } = self.axis;
        match kind {
            AxisKind::Linear => Pose::translation(
                direction.x * scale * value,
                direction.y * scale * value,
                direction.z * scale * value,
            ),
            AxisKind::Rotary => {
                let turn = Rotation3::from_axis_angle(&direction, scale * value);
                let shift = Translation3::from(point_m - turn * point_m);
                Pose::from_parts(shift, UnitQuaternion::from_rotation_matrix(&turn))
            }
        }
    }

    fn record(&self, scenario: &Scenario) -> AxisRecord {
        let timing = &scenario.timing;
        // Values begin before the scan and end after it.
        let count = ((timing.duration_s + 2.0) / PERIOD_S) as i64;
        let value = |k: i64| {
            let time_s = k as f64 * PERIOD_S - 1.0;
            let stamp_ns = timing.start_ns + ((time_s + self.axis.time_offset_s) * 1e9).round() as i64;
            AxisValue { stamp_ns, value: self.course.at(time_s, timing.duration_s) }
        };
        AxisRecord {
            name: self.name.clone(),
            kind: self.axis.kind,
            carries: self.carries,
            in_pose: false,
            guess: None,
            values: (0..count).map(value).collect(),
            known: Some(self.axis),
            holds_time_offset: false,
        }
    }
}

/// Simulates a scan in a cell with axes; the same arguments give the same recording, bit for bit. Axes are chained in their
/// order. The scan is that of the scenario about the seam at zero values of all axes.
///
/// Returns `None` for a scenario without a line.
#[must_use]
pub fn simulate_with_axes(scenario: &Scenario, axes: &[SimulatedAxis], seed: u64) -> Option<Recording> {
    let motion = Motion::new(scenario)?;
    let moved = |carries, time_s| moved(scenario, axes, carries, time_s);
    let reported = |time_s: f64| {
        // The part has been carried away, and the robot goes after it.
        let world_from_tool = moved(Carries::Part, time_s) * motion.base_from_tool(time_s);
        moved(Carries::Robot, time_s).inverse() * world_from_tool * moved(Carries::Sensor, time_s).inverse()
    };
    let mut recording = record_reported(scenario, &|time_s| motion.base_from_tool(time_s), &reported, seed);
    recording.axes = axes.iter().map(|axis| axis.record(scenario)).collect();
    Some(recording)
}

/// The same with a prescribed motion of the robot: `base_from_tool` gives the pose of the arm alone at a time, s.
#[must_use]
pub fn simulate_along_with_axes(
    scenario: &Scenario,
    base_from_tool: &dyn Fn(f64) -> Pose,
    axes: &[SimulatedAxis],
    seed: u64,
) -> Recording {
    let moved = |carries, time_s| moved(scenario, axes, carries, time_s);
    let lines_from_tool = |time_s: f64| {
        let world_from_tool = moved(Carries::Robot, time_s) * base_from_tool(time_s);
        moved(Carries::Part, time_s).inverse() * world_from_tool * moved(Carries::Sensor, time_s)
    };
    let mut recording = record_reported(scenario, &lines_from_tool, base_from_tool, seed);
    recording.axes = axes.iter().map(|axis| axis.record(scenario)).collect();
    recording
}

/// The motion of all axes of one load at a time, s.
fn moved(scenario: &Scenario, axes: &[SimulatedAxis], carries: Carries, time_s: f64) -> Pose {
    let own = axes.iter().filter(|axis| axis.carries == carries);
    let value = |axis: &SimulatedAxis| axis.course.at(time_s, scenario.timing.duration_s);
    own.fold(Pose::identity(), |chain, axis| chain * axis.motion(value(axis)))
}
