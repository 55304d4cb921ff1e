//! The robot's motion: poses that let the seam appear where the scan wants it in the sheet.

use crate::capture::SheetAxes;
use crate::scenario::{Between, Scenario};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use trueline_geometry::{Line, Pose};

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
        let (scan, timing) = (&self.scenario.scan, &self.scenario.timing);
        let progress = time_s / timing.duration_s - 0.5;
        let seam_point = self.seam.anchor() + self.seam.direction() * (scan.length_m * progress);
        let angle = |axis: usize| scan.attitude_rad[axis] + scan.tilts[axis].at(time_s);
        let [work, travel, spin] = [0, 1, 2].map(angle);
        let tilt = Rotation3::from_axis_angle(&Vector3::y_axis(), work)
            * Rotation3::from_axis_angle(&Vector3::x_axis(), travel)
            * Rotation3::from_axis_angle(&Vector3::z_axis(), spin);
        let base_from_camera = self.base_from_sheet * tilt * self.sheet.camera_from_sheet.inverse();
        let aim = self.sheet.point(scan.lateral.at(time_s), scan.range.at(time_s));
        let origin = seam_point - base_from_camera * aim;
        let rotation = UnitQuaternion::from_rotation_matrix(&base_from_camera);
        Pose::from_parts(origin.into(), rotation) * self.scenario.cell.tool_from_camera.inverse()
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
