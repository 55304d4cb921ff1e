//! The robot of a cell: joints that follow the path, their log, and the tool's true pose.

use super::super::drawn_errors::DrawnErrors;
use super::super::error_table::ShopError;
use super::super::joint_path::JointPath;
use super::command_lag::CommandLag;
use super::gear_ripple::GearRipple;
use super::{arm_geometry, hysteresis, moving_mean, polled_log, quantised_poses, sag, warm_up};
use nalgebra::Vector3;
use trueline_geometry::Pose;
use trueline_geometry::arm::inverse::angles_for;
use trueline_geometry::arm::six_axes::{AXES, Arm};

/// Time step of differences, s.
const DIFFERENCE_S: f64 = 0.01;

/// The robot.
pub(crate) struct ShopRobot {
    nominal: Arm,
    built: Arm,
    path: JointPath,
    ripple: Option<GearRipple>,
    lag: Option<CommandLag>,
    errors: DrawnErrors,
}

impl ShopRobot {
    pub(crate) fn new(nominal: Arm, path: JointPath, errors: &DrawnErrors) -> Self {
        Self {
            built: arm_geometry::built(&nominal, &path.middle(), errors),
            ripple: GearRipple::of(errors),
            lag: CommandLag::of(errors),
            errors: errors.clone(),
            nominal,
            path,
        }
    }

    /// Encoder readings at a time since the start, rad.
    fn encoders(&self, time_s: f64) -> [f64; AXES] {
        let command = |time_s: f64| self.path.at(time_s);
        self.lag.as_ref().map_or_else(|| command(time_s), |lag| lag.following(&command, time_s))
    }

    /// The pose that the stream reports at a time since the start.
    pub(crate) fn reported(&self, time_s: f64) -> Pose {
        let every_s = self.errors.size(ShopError::PolledLog);
        let time_s = every_s.map_or(time_s, |every_s| polled_log::renewed_s(time_s, every_s));
        let angles = match self.errors.size(ShopError::MovingMean) {
            Some(length_s) => moving_mean::mean(&|time_s| self.path.at(time_s), time_s, length_s),
            None => self.path.at(time_s),
        };
        let pose = self.nominal.base_from_flange(&angles);
        let step_m = self.errors.size(ShopError::QuantisedPoses);
        step_m.map_or(pose, |step_m| quantised_poses::quantised(&pose, step_m))
    }

    /// Pose of the tool at a time, s, if the arm followed the controller's model at once.
    pub(crate) fn wanted(&self, time_s: f64) -> Pose {
        self.nominal.base_from_flange(&self.path.at(time_s))
    }

    /// Pose of the tool at a time since the start, s.
    pub(crate) fn actual(&self, time_s: f64) -> Pose {
        let [before, angles, after] =
            [-1.0, 0.0, 1.0].map(|side| self.encoders(time_s + side * DIFFERENCE_S));
        let rates = std::array::from_fn(|k| (after[k] - before[k]) / (2.0 * DIFFERENCE_S));
        let place = |angles: &[f64; AXES]| self.nominal.base_from_flange(angles).translation.vector;
        let acceleration =
            (place(&after) - place(&angles) * 2.0 + place(&before)) / (DIFFERENCE_S * DIFFERENCE_S);
        self.taken_by(&angles, &rates, &acceleration, time_s)
    }

    /// Pose of the tool when the robot stands and reports a pose, in the middle of the scan; `None` out of reach.
    pub(crate) fn standing(&self, reported: &Pose, middle_s: f64) -> Option<Pose> {
        let angles = angles_for(&self.nominal, reported, &self.path.at(middle_s))?;
        Some(self.taken_by(&angles, &[0.0; AXES], &Vector3::zeros(), middle_s))
    }

    fn taken_by(
        &self,
        encoders: &[f64; AXES],
        rates: &[f64; AXES],
        acceleration: &Vector3<f64>,
        time_s: f64,
    ) -> Pose {
        let ripple = self.ripple.as_ref().map_or([0.0; AXES], |ripple| ripple.at(encoders));
        let behind = hysteresis::behind(&self.errors, rates);
        let yielding = sag::yielding(&self.errors, &self.nominal, encoders, acceleration);
        let angles = std::array::from_fn(|k| encoders[k] + ripple[k] + behind[k] + yielding[k]);
        warm_up::grown(self.built.clone(), &self.errors, time_s).base_from_flange(&angles)
    }

    /// How much later than its log the motion is: least, mean and most, s. Negative where the log is the later one.
    pub(crate) fn behind_log_s(&self) -> [f64; 3] {
        let mut behind = self.lag.as_ref().map_or([0.0; 3], CommandLag::delays_s);
        if let Some(length_s) = self.errors.size(ShopError::MovingMean) {
            behind = behind.map(|s| s - 0.5 * length_s);
        }
        if let Some(every_s) = self.errors.size(ShopError::PolledLog) {
            // The renewed rows are in time, and a repeated one is as old as it gets.
            behind[0] -= every_s;
        }
        behind
    }
}
