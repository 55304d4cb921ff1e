//! The check pass: readings of the true sensor on the true seam without noise, their places in the tool, and the torch's
//! targets.
//!
//! Its robot moves straight at 10 mm/s without rotation, so a placed point minus this motion is in the frame of the
//! tool.

use super::course::Swing;
use super::layout::Layout;
use super::robot::ShopRobot;
use super::seam::SeamForm;
use super::sensor::{Seen, ShopSensor, TrueSeam};
use super::torch::Torch;
use super::truth::CheckPoint;
use nalgebra::{Point3, Vector3};
use std::f64::consts::TAU;
use trueline_dataset::{Feature, Measured, RobotSample};
use trueline_geometry::se3;

/// Readings that are tried.
const READINGS: u32 = 72;
/// Part of the seam, and of the swings of the scan, that they cover.
const OF_SEAM: f64 = 0.8;
const OF_SWING: f64 = 0.9;
/// Cycles of the swings over the pass: place, then tilts.
const CYCLES: [f64; 5] = [3.0, 5.0, 2.0, 4.0, 1.0];
/// Motion of the pass, m/s; its poses and readings, s.
const SPEED_M_S: f64 = 0.010;
const PERIOD_S: f64 = 0.05;
/// When poses begin and end, and readings begin, from the start of the scan, s.
const POSES_S: [f64; 2] = [-5.0, 18.5];
const READINGS_FROM_S: f64 = 5.0;

/// A cell that is checked.
pub(crate) struct CheckedCell<'a> {
    pub(crate) layout: &'a Layout,
    pub(crate) robot: &'a ShopRobot,
    pub(crate) sensor: &'a ShopSensor,
    pub(crate) form: &'a SeamForm,
}

impl CheckedCell<'_> {
    /// Readings and their true places.
    pub(crate) fn points(&self) -> Vec<(Measured, CheckPoint)> {
        let layout = self.layout;
        let middle_s = 0.5 * layout.course.duration_s;
        let middle = layout.pose(&Swing::default());
        // The tip is on the tool's axis, as far out as the sensor sees.
        let seen_m = layout.tool_from_camera * Point3::from(self.sensor.axes.middle);
        let tip = Vector3::new(0.0, 0.0, seen_m.z);
        let torch = Torch::taught(self.robot, middle_s, middle.rotation, tip, layout.line.anchor());
        let displacement = |along_m: f64| self.form.displacement(along_m);
        let seam = TrueSeam { line: &layout.line, displacement: &displacement, rounded: None };
        let point = |k: u32| {
            let reported = layout.pose(&self.swing(f64::from(k) / f64::from(READINGS - 1)));
            let actual = self.robot.standing(&reported, middle_s)?;
            let Seen { measured, point_in_camera } =
                self.sensor.see_from(&seam, &(actual * layout.tool_from_camera))?;
            let in_tool = layout.tool_from_camera * Point3::from(point_in_camera);
            let in_base = (actual * in_tool).coords;
            let check = CheckPoint {
                in_tool: in_tool.coords,
                velocity_in_tool: actual.rotation.inverse() * layout.line.direction(),
                reported,
                torch_reference: torch.as_ref().and_then(|torch| torch.sent_to(&in_base)),
            };
            Some((measured, check))
        };
        (0..READINGS).filter_map(point).collect()
    }

    /// Place of the sensor after a part of the pass.
    fn swing(&self, part: f64) -> Swing {
        let course = &self.layout.course;
        let wave = |k: usize| OF_SWING * (TAU * CYCLES[k] * part + k as f64).sin();
        Swing {
            progress: OF_SEAM * (part - 0.5),
            in_sheet_m: [0, 1].map(|k| course.in_sheet_m[k] * wave(k)),
            tilt_rad: [2, 3, 4].map(|k| course.tilt_rad * wave(k)),
        }
    }
}

/// The poses of the pass; its clock reads `start_ns` at the start of the scan.
pub(crate) fn poses(start_ns: i64) -> Vec<RobotSample> {
    let count = ((POSES_S[1] - POSES_S[0]) / PERIOD_S).round() as usize;
    let pose = |k: usize| {
        let time_s = POSES_S[0] + k as f64 * PERIOD_S;
        let place = Vector3::new(SPEED_M_S * time_s, 0.0, 0.0);
        RobotSample {
            stamp_ns: stamp_ns(start_ns, time_s),
            device_ns: None,
            base_from_tool: se3::from_parts(nalgebra::UnitQuaternion::identity(), place),
        }
    };
    (0..=count).map(pose).collect()
}

/// The readings as features; `frame` counts the points.
pub(crate) fn features<'a>(start_ns: i64, readings: impl Iterator<Item = &'a Measured>) -> Vec<Feature> {
    let feature = |(k, measured): (usize, &Measured)| Feature {
        stamp_ns: stamp_ns(start_ns, READINGS_FROM_S + k as f64 * PERIOD_S),
        line: 0,
        frame: Some(k as u64),
        device_ns: None,
        measured: *measured,
        sigma: None,
        correlation: 0.0,
    };
    readings.enumerate().map(feature).collect()
}

fn stamp_ns(start_ns: i64, time_s: f64) -> i64 {
    start_ns + (time_s * 1e9).round() as i64
}
