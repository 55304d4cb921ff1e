//! A design as motion: smooth from rest to rest.

use crate::cell::Cell;
use crate::design::Design;
use crate::evenly_swung::EvenlySwung;
use crate::sensor_pose::{SensorPose, Station};
use nalgebra::Vector3;
use trueline_geometry::{Pose, so3};
use trueline_model::Placement;

/// The tool's motion over the scan.
#[derive(Clone, Debug)]
pub struct Motion {
    design: Design,
    sensor_pose: SensorPose,
    middle: Vector3<f64>,
    scanned: Vector3<f64>,
}

/// Time between the poses of a path, s, whatever the rate of the robot's feedback: between them it may go straight.
pub const PATH_PERIOD_S: f64 = 4e-3;

/// Step of the difference that gives velocities, s: at 1 m/s² it is 0.05 mm/s off.
const STEP_S: f64 = 1e-4;

impl Motion {
    /// The motion of a design in a cell.
    #[must_use]
    pub fn new(cell: &Cell, design: Design) -> Self {
        Self {
            sensor_pose: cell.sensor_pose.clone(),
            middle: 0.5 * (cell.seam.from_m + cell.seam.to_m)
                + (cell.seam.to_m - cell.seam.from_m) * design.centre,
            scanned: (cell.seam.to_m - cell.seam.from_m) * design.length_share,
            design,
        }
    }

    /// The design.
    #[must_use]
    pub fn design(&self) -> &Design {
        &self.design
    }

    /// Where the seam is to appear at a time, s, and how the sensor stands then.
    #[must_use]
    pub fn station(&self, time_s: f64) -> Station {
        let Design { duration_s, ramp_s, .. } = self.design;
        let eased_s = eased(time_s, duration_s, ramp_s);
        self.station_of(eased_s, self.design.sweeps().map(|sweep| sweep.at(eased_s)))
    }

    fn station_of(&self, eased_s: f64, [stripe, stand_off_m, work, travel, spin]: [f64; 5]) -> Station {
        let Design { shape, duration_s, ramp_s, .. } = self.design;
        let done = eased_s / (duration_s - ramp_s);
        Station {
            seam_point: self.middle + self.scanned * shape.progress(done),
            stripe_m: stripe * stand_off_m,
            stand_off_m,
            tilt_rad: [work, travel, spin],
        }
    }

    /// Pose of the tool at a time, s; before the start and after the end it rests.
    #[must_use]
    pub fn base_from_tool(&self, time_s: f64) -> Pose {
        self.sensor_pose.base_from_tool(&self.station(time_s))
    }

    /// The point in the camera frame where the seam is expected, m.
    #[must_use]
    pub fn point_in_camera(&self, time_s: f64) -> Vector3<f64> {
        self.sensor_pose.point_in_camera(&self.station(time_s))
    }

    /// Pose of the tool at so many times that begin at one, s, and are evenly spaced, and how it moves; the camera sits where a hand-eye
    /// transform has it.
    pub fn placements(
        &self,
        [first_s, step_s]: [f64; 2],
        count: usize,
        tool_from_camera: &Pose,
    ) -> impl Iterator<Item = (f64, Placement)> {
        let mut now = self.evenly(step_s);
        let mut after = self.evenly(step_s);
        let tool_from_camera = *tool_from_camera;
        (0..count).map(move |k| {
            let time_s = first_s + k as f64 * step_s;
            let (now, after) = (now(time_s), after(time_s + STEP_S));
            let placement = Placement {
                base_from_tool: now,
                tool_from_camera,
                angular_velocity: so3::log(&(after.rotation * now.rotation.inverse())) / STEP_S,
                velocity: (after.translation.vector - now.translation.vector) / STEP_S,
            };
            (time_s, placement)
        })
    }

    /// Pose of the tool at one time, s, after another; quick where they are a step apart.
    fn evenly(&self, step_s: f64) -> impl FnMut(f64) -> Pose + '_ {
        let Design { duration_s, ramp_s, .. } = self.design;
        let mut swung = EvenlySwung::new(self.design.sweeps(), step_s);
        move |time_s| {
            let eased_s = eased(time_s, duration_s, ramp_s);
            self.sensor_pose.base_from_tool(&self.station_of(eased_s, swung.at(eased_s)))
        }
    }

    /// Poses from start to end, evenly spaced; the last may be less than a period after the end.
    #[must_use]
    pub fn sampled(&self, period_s: f64) -> Vec<Pose> {
        let count = (self.design.duration_s / period_s - 1e-9).ceil() as usize + 1;
        let mut pose = self.evenly(period_s);
        (0..count).map(|k| pose(k as f64 * period_s)).collect()
    }
}

/// Time that runs slowly at first and at last: its rate rises from 0 to 1 over the ramp as the smooth step
/// u³(10 − 15u + 6u²), so that speed, acceleration and jerk begin and end at zero.
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
