//! The robot's motion: poses that let the seam appear where the scan wants it in the sheet.

use crate::capture::SheetAxes;
use crate::scenario::{Between, Progress, Scenario, TrackedIn};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use std::f64::consts::TAU;
use trueline_geometry::{Line, Pose};

/// Time in which the sensor is turned about its view between two passes, s.
const SPIN_TURN_S: f64 = 2.0;

/// The true robot motion.
pub struct Motion<'a> {
    scenario: &'a Scenario,
    seam: Line,
    sheet: SheetAxes,
    base_from_sheet: Rotation3<f64>,
}

impl<'a> Motion<'a> {
    /// The motion of a scenario; `None` if it has no line.
    #[must_use]
    pub fn new(scenario: &'a Scenario) -> Option<Self> {
        let seam = *scenario.cell.lines.first()?;
        let along = seam.direction();
        // The sheet stands across the line: range axis along the approach, stripe square to both.
        let range = scenario.cell.approach.into_inner();
        let range = (range - along * along.dot(&range)).normalize();
        let axes = Matrix3::from_columns(&[along.cross(&range), along, range]);
        Some(Self {
            scenario,
            seam,
            sheet: SheetAxes::of(&scenario.cell.sensor),
            base_from_sheet: Rotation3::from_matrix_unchecked(axes),
        })
    }

    /// True pose of the tool at a time since the start, s.
    #[must_use]
    pub fn base_from_tool(&self, time_s: f64) -> Pose {
        match self.scenario.timing.between {
            Between::Smooth => self.on_the_sines(time_s),
            Between::Straight => self.between_samples(time_s),
        }
    }

    fn on_the_sines(&self, time_s: f64) -> Pose {
        let scan = &self.scenario.scan;
        let seam_point = self.seam.anchor() + self.seam.direction() * (scan.length_m * self.progress(time_s));
        let angle = |axis: usize| scan.attitude_rad[axis] + scan.tilts[axis].at(time_s);
        let [work, travel, spin] = [0, 1, 2].map(angle);
        let tilt = Rotation3::from_axis_angle(&Vector3::y_axis(), work)
            * Rotation3::from_axis_angle(&Vector3::x_axis(), travel)
            * Rotation3::from_axis_angle(&Vector3::z_axis(), spin + self.further_spin_rad(time_s));
        let base_from_camera = self.base_from_sheet * tilt * self.sheet.camera_from_sheet.inverse();
        let (lateral_m, range_m) = (scan.lateral.at(time_s), scan.range.at(time_s));
        let origin = match scan.tracked_in {
            TrackedIn::Sensor => seam_point - base_from_camera * self.sheet.point(lateral_m, range_m),
            TrackedIn::Base => {
                let middle = seam_point - self.base_from_sheet * Vector3::new(lateral_m, 0.0, range_m);
                middle - base_from_camera * self.sheet.middle
            }
        };
        let rotation = UnitQuaternion::from_rotation_matrix(&base_from_camera);
        Pose::from_parts(origin.into(), rotation) * self.scenario.cell.tool_from_camera.inverse()
    }

    /// Place of the scan along the scanned length, from −½ to ½.
    fn progress(&self, time_s: f64) -> f64 {
        let (scan, duration_s) = (&self.scenario.scan, self.scenario.timing.duration_s);
        if scan.passes <= 1 && scan.progress == Progress::Even {
            return time_s / duration_s - 0.5;
        }
        let passes = f64::from(scan.passes.max(1));
        let run = (time_s / duration_s * passes).clamp(0.0, passes);
        let pass = run.floor().min(passes - 1.0);
        let part = match scan.progress {
            Progress::Even => run - pass,
            Progress::Eased => (run - pass) - (TAU * (run - pass)).sin() / TAU,
        };
        if (pass as u32).is_multiple_of(2) { part - 0.5 } else { 0.5 - part }
    }

    /// Spin of the later passes; each turn takes [`SPIN_TURN_S`].
    fn further_spin_rad(&self, time_s: f64) -> f64 {
        let (scan, duration_s) = (&self.scenario.scan, self.scenario.timing.duration_s);
        let turns = 1..scan.passes.max(1);
        let turned = |pass: u32| {
            let turn_s = duration_s * f64::from(pass) / f64::from(scan.passes);
            let part = ((time_s - turn_s) / SPIN_TURN_S + 0.5).clamp(0.0, 1.0);
            part * part * (3.0 - 2.0 * part)
        };
        scan.spin_by_pass_rad * turns.map(turned).sum::<f64>()
    }

    /// Straight and at constant rate between the samples before and after.
    fn between_samples(&self, time_s: f64) -> Pose {
        let period = self.scenario.timing.robot_period_s;
        let index = (time_s / period).floor();
        let part = time_s / period - index;
        let (from, to) = (self.on_the_sines(index * period), self.on_the_sines((index + 1.0) * period));
        // `slerp` of two attitudes this near to each other returns a quaternion 1e-8 off unit length.
        let turn = (from.rotation.inverse() * to.rotation).scaled_axis();
        let rotation = from.rotation * UnitQuaternion::new(turn * part);
        let position = from.translation.vector.lerp(&to.translation.vector, part);
        Pose::from_parts(position.into(), rotation)
    }
}
