//! A design as motion: smooth from rest to rest.

use crate::cell::Cell;
use crate::cell_axis::CellAxis;
use crate::course::Course;
use crate::design::Design;
use crate::evenly_swung::EvenlySwung;
use crate::sensor_pose::{SensorPose, Station};
use crate::shape::Shape;
use crate::sweep::Sweep;
use crate::truth::Truth;
use nalgebra::{Point3, Vector3};
use std::sync::Arc;
use trueline_dataset::AxisRecord;
use trueline_dataset::axes::AxisValue;
use trueline_geometry::{Pose, so3};
use trueline_method::input::axis_chain::AxisChain;
use trueline_model::Placement;

/// The tool's motion over the scan.
#[derive(Clone, Debug)]
pub struct Motion {
    design: Design,
    sensor_pose: SensorPose,
    middle: Vector3<f64>,
    scanned: Vector3<f64>,
    /// Curve of a curved seam.
    course: Option<Arc<Course>>,
    /// Middle of the scanned part from the middle of the seam, and its length, m.
    along_m: [f64; 2],
    /// Time in which the sensor is spun between two passes, s; 0 without a spin.
    spin_s: f64,
    /// External axes at their rough places, over time; `None` without axes.
    axes: Option<AxisChain>,
}

/// Part of the time of a spin in which it gets up to speed, and again to rest.
const SPIN_RAMP: f64 = 0.25;
/// Part of a limit of speed that a spin uses.
const SPIN_USES: f64 = 0.98;

/// Time between the poses of a path, s, at any rate of the robot's feedback: between them it may move straight.
pub const PATH_PERIOD_S: f64 = 4e-3;

/// Time between the values of an external axis, s. Cubic pieces are between them.
const AXIS_PERIOD_S: f64 = 8e-3;
/// Before the start and after the end an axis rests for so long, s.
const AXIS_REST_S: f64 = 0.1;

/// Step of the difference that gives velocities, s: at 1 m/s² it is 0.05 mm/s off.
const STEP_S: f64 = 1e-4;

impl Motion {
    /// The motion of a design in a cell.
    #[must_use]
    pub fn new(cell: &Cell, design: Design) -> Self {
        let still = Self {
            sensor_pose: cell.sensor_pose.clone(),
            middle: 0.5 * (cell.seam.from_m + cell.seam.to_m)
                + (cell.seam.to_m - cell.seam.from_m) * design.centre,
            scanned: (cell.seam.to_m - cell.seam.from_m) * design.length_share,
            course: cell.course.clone(),
            along_m: [design.centre, design.length_share].map(|part| part * cell.seam.length_m()),
            design,
            spin_s: 0.0,
            axes: None,
        };
        let spin_s = if still.design.shape == Shape::Spun { still.spin_needs_s(cell) } else { 0.0 };
        let moving = Self { spin_s, ..still };
        Self { axes: moving.chain(cell), ..moving }
    }

    /// The external axes over time; `None` without axes.
    fn chain(&self, cell: &Cell) -> Option<AxisChain> {
        if cell.axes.is_empty() {
            return None;
        }
        let count = ((self.design.duration_s + 2.0 * AXIS_REST_S) / AXIS_PERIOD_S).ceil() as usize + 1;
        let times_s: Vec<f64> = (0..count).map(|k| k as f64 * AXIS_PERIOD_S - AXIS_REST_S).collect();
        let total_s = self.eased_total_s();
        let eased_s: Vec<f64> = times_s.iter().map(|time_s| self.eased_and_spun(*time_s).0).collect();
        let moved = cell.axes.iter().zip(&self.design.axes).map(|(axis, course)| {
            let values = eased_s.iter().map(|eased_s| course.at(*eased_s, total_s)).collect();
            (axis.axis, axis.record.carries, values)
        });
        Some(AxisChain::planned(moved.collect(), &times_s))
    }

    /// The axes at their rough places, over time; `None` without axes.
    pub(crate) fn axes(&self) -> Option<&AxisChain> {
        self.axes.as_ref()
    }

    /// The axes at the places of a truth; `None` without axes.
    pub(crate) fn axes_at(&self, truth: &Truth) -> Option<AxisChain> {
        Some(self.axes.as_ref()?.at_places(&truth.axes))
    }

    /// Values of the axes at a time, s, rad or m; they rest before the start and after the end.
    #[must_use]
    pub fn axis_values(&self, time_s: f64) -> Vec<f64> {
        let within_s = time_s.clamp(0.0, self.design.duration_s);
        self.axes.as_ref().and_then(|axes| axes.values_at(within_s)).unwrap_or_default()
    }

    /// Records of a cell's axes with a value each period, s, from so long before the start to so long after the end, s.
    #[must_use]
    pub fn axis_records(&self, cell: &Cell, period_s: f64, beyond_s: f64) -> Vec<AxisRecord> {
        if cell.axes.is_empty() {
            return Vec::new();
        }
        let count = ((self.design.duration_s + 2.0 * beyond_s) / period_s - 1e-9).ceil() as usize + 1;
        let times_s = (0..count).map(|k| k as f64 * period_s - beyond_s);
        let rows: Vec<(i64, Vec<f64>)> =
            times_s.map(|time_s| ((time_s * 1e9).round() as i64, self.axis_values(time_s))).collect();
        let record = |(k, axis): (usize, &CellAxis)| {
            let values =
                rows.iter().map(|(stamp_ns, values)| AxisValue { stamp_ns: *stamp_ns, value: values[k] });
            AxisRecord { values: values.collect(), known: Some(axis.axis), ..axis.record.clone() }
        };
        cell.axes.iter().enumerate().map(record).collect()
    }

    /// The tool's pose by which the sensor goes so about the seam: the robot follows the axes at their rough places.
    fn followed(&self, lines_from_tool: Pose, time_s: f64) -> Pose {
        let robot = self.axes.as_ref().and_then(|axes| axes.without_axes(&lines_from_tool, time_s));
        robot.unwrap_or(lines_from_tool)
    }

    /// Duration of half a turn at the limits of speed: it is made between the passes, while everything else rests.
    fn spin_needs_s(&self, cell: &Cell) -> f64 {
        let limits = &cell.limits;
        let reach = |low: &Sweep| low.swings.iter().map(|swing| swing.amplitude.abs()).sum::<f64>();
        let Design { stripe, stand_off, .. } = &self.design;
        let far_m = stand_off.mean + reach(stand_off);
        let levers = [-1.0, 1.0].into_iter().flat_map(|side| {
            [-1.0, 1.0].map(|end| {
                let stripe_m = side * reach(stripe) * far_m;
                let stand_off_m = stand_off.mean + end * reach(stand_off);
                let station =
                    Station { seam_point: Vector3::zeros(), stripe_m, stand_off_m, tilt_rad: [0.0; 3] };
                self.sensor_pose.lever_m(&station)
            })
        });
        let lever_m = levers.fold(0.0, f64::max);
        let fastest = (limits.tip_speed_m_s / (lever_m + limits.reach_m)).min(limits.speed_m_s / lever_m);
        std::f64::consts::PI / ((1.0 - SPIN_RAMP) * SPIN_USES * fastest.min(limits.turn_rad_s))
    }

    /// Start and end of the spin, s; equal without one.
    #[must_use]
    pub fn spun_s(&self) -> [f64; 2] {
        let middle_s = 0.5 * self.design.duration_s;
        [middle_s - 0.5 * self.spin_s, middle_s + 0.5 * self.spin_s]
    }

    /// Whether the duration suffices for the passes and the spin.
    #[must_use]
    pub fn has_time(&self) -> bool {
        self.pass_s() >= 3.0 * self.design.ramp_s
    }

    /// Duration of a pass, s, from rest to rest: the whole scan without a spin.
    fn pass_s(&self) -> f64 {
        if self.spin_s > 0.0 { 0.5 * (self.design.duration_s - self.spin_s) } else { self.design.duration_s }
    }

    /// Eased time of all passes together, s.
    fn eased_total_s(&self) -> f64 {
        let passes = if self.spin_s > 0.0 { 2.0 } else { 1.0 };
        passes * (self.pass_s() - self.design.ramp_s)
    }

    /// Eased time of the passes at a time, s, and how far the sensor is spun, rad.
    fn eased_and_spun(&self, time_s: f64) -> (f64, f64) {
        let (pass_s, ramp_s) = (self.pass_s(), self.design.ramp_s);
        let first_s = eased(time_s, pass_s, ramp_s);
        if self.spin_s == 0.0 || time_s <= pass_s {
            return (first_s, 0.0);
        }
        let second_s = eased(time_s - pass_s - self.spin_s, pass_s, ramp_s);
        let spun_s = eased(time_s - pass_s, self.spin_s, SPIN_RAMP * self.spin_s);
        (first_s + second_s, std::f64::consts::PI * spun_s / ((1.0 - SPIN_RAMP) * self.spin_s))
    }

    /// The design.
    #[must_use]
    pub fn design(&self) -> &Design {
        &self.design
    }

    /// Planned place of the seam at a time, s, and attitude of the sensor then; along the tangent line of a curved seam.
    #[must_use]
    pub fn station(&self, time_s: f64) -> Station {
        let (eased_s, spun_rad) = self.eased_and_spun(time_s);
        self.station_of(eased_s, spun_rad, self.design.sweeps().map(|sweep| sweep.at(eased_s)))
    }

    fn station_of(
        &self,
        eased_s: f64,
        spun_rad: f64,
        [stripe, stand_off_m, work, travel, spin]: [f64; 5],
    ) -> Station {
        let done = eased_s / self.eased_total_s();
        Station {
            seam_point: self.middle + self.scanned * self.design.shape.progress(done),
            stripe_m: stripe * stand_off_m,
            stand_off_m,
            tilt_rad: [work, travel, spin + spun_rad],
        }
    }

    /// The transform of the straight seam onto the curve at an eased time, s; `None` for a straight seam.
    fn bend(&self, eased_s: f64) -> Option<Pose> {
        let [middle_m, scanned_m] = self.along_m;
        let done = eased_s / self.eased_total_s();
        Some(self.course.as_ref()?.bend(middle_m + scanned_m * self.design.shape.progress(done)))
    }

    /// The planned point of the seam in base, m, at a time, s.
    #[must_use]
    pub fn seam_point(&self, time_s: f64) -> Vector3<f64> {
        let (point, bend) = (self.station(time_s).seam_point, self.bend(self.eased_and_spun(time_s).0));
        let point = bend.map_or(point, |bend| (bend * Point3::from(point)).coords);
        let carried = self.axes.as_ref().and_then(|axes| axes.base_from_part(time_s));
        carried.map_or(point, |carried| (carried * Point3::from(point)).coords)
    }

    /// Pose of the tool at a time, s; before the start and after the end it rests.
    #[must_use]
    pub fn base_from_tool(&self, time_s: f64) -> Pose {
        let straight = self.sensor_pose.base_from_tool(&self.station(time_s));
        let bent = self.bend(self.eased_and_spun(time_s).0).map_or(straight, |bend| bend * straight);
        self.followed(bent, time_s)
    }

    /// The point in the camera frame where the seam is expected, m.
    #[must_use]
    pub fn point_in_camera(&self, time_s: f64) -> Vector3<f64> {
        self.sensor_pose.point_in_camera(&self.station(time_s))
    }

    /// Pose of the tool about the seam at times, s, that are mostly a step apart, and its motion, in axes that turn with a curved seam. A truth
    /// places camera and external axes.
    pub(crate) fn placements<'a>(
        &'a self,
        times_s: impl Iterator<Item = f64> + 'a,
        step_s: f64,
        truth: &Truth,
    ) -> impl Iterator<Item = (f64, Placement)> + 'a {
        let mut now = self.evenly(step_s);
        let mut after = self.evenly(step_s);
        let tool_from_camera = truth.tool_from_camera;
        let elsewhere = self.axes_at(truth).filter(|_| !self.is_right_about(truth));
        // The robot follows the axes where they are thought to be.
        let seen = move |pose: Pose, time_s: f64| {
            let robot = elsewhere.as_ref().map(|axes| (axes, self.followed(pose, time_s)));
            robot.and_then(|(axes, robot)| axes.lines_from_carrier(&robot, time_s)).unwrap_or(pose)
        };
        times_s.map(move |time_s| {
            let ((now, bend), (mut after, bend_after)) = (now(time_s), after(time_s + STEP_S));
            if let Some((bend, bend_after)) = bend.zip(bend_after) {
                after = bend.inverse() * bend_after * after;
            }
            let (now, after) = (seen(now, time_s), seen(after, time_s + STEP_S));
            let placement = Placement {
                base_from_tool: now,
                tool_from_camera,
                angular_velocity: so3::log(&(after.rotation * now.rotation.inverse())) / STEP_S,
                velocity: (after.translation.vector - now.translation.vector) / STEP_S,
            };
            (time_s, placement)
        })
    }

    /// Whether the axes are where the robot follows them.
    fn is_right_about(&self, truth: &Truth) -> bool {
        self.axes.as_ref().is_none_or(|rough| rough.is_at(&truth.axes))
    }

    /// Pose of the tool over the straight seam at one time, s, after another, and the transform onto a curved seam; fast if they are a step apart.
    fn evenly(&self, step_s: f64) -> impl FnMut(f64) -> (Pose, Option<Pose>) + '_ {
        let mut swung = EvenlySwung::new(self.design.sweeps(), step_s);
        move |time_s| {
            let (eased_s, spun_rad) = self.eased_and_spun(time_s);
            let station = self.station_of(eased_s, spun_rad, swung.at(eased_s));
            (self.sensor_pose.base_from_tool(&station), self.bend(eased_s))
        }
    }

    /// Poses from start to end, evenly spaced; the last may be less than a period after the end.
    #[must_use]
    pub fn sampled(&self, period_s: f64) -> Vec<Pose> {
        let count = (self.design.duration_s / period_s - 1e-9).ceil() as usize + 1;
        let mut pose = self.evenly(period_s);
        let at = |time_s: f64| {
            let (straight, bend) = pose(time_s);
            self.followed(bend.map_or(straight, |bend| bend * straight), time_s)
        };
        (0..count).map(|k| k as f64 * period_s).map(at).collect()
    }
}

/// Time with a slow start and end: its rate rises from 0 to 1 over the ramp as the smooth step u³(10 − 15u + 6u²). So
/// speed, acceleration and jerk begin and end at zero.
fn eased(time_s: f64, duration_s: f64, ramp_s: f64) -> f64 {
    let time_s = time_s.clamp(0.0, duration_s);
    // ∫ of the smooth step, ½ at u = 1.
    let risen = |u: f64| u.powi(4) * (2.5 - 3.0 * u + u * u);
    let total_s = duration_s - ramp_s;
    if time_s < ramp_s {
        ramp_s * risen(time_s / ramp_s)
    } else if time_s > duration_s - ramp_s {
        total_s - ramp_s * risen((duration_s - time_s) / ramp_s)
    } else {
        time_s - 0.5 * ramp_s
    }
}
