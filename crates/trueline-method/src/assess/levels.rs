//! Assumed levels of systematic errors: as stated, or typical of such cells.

use crate::assess::robot_field::RobotSigmas;
use crate::config::{ASSUMED_EDGE_RADIUS_M, ASSUMED_ROBOT_ACCURACY_M, Config, SensorMode};
use crate::input::shape_knowledge::{ShapeCovariance, ShapeKnowledge};
use trueline_dataset::Recording;

/// How large the errors are taken to be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SystematicLevels {
    /// Absolute accuracy of the robot, m.
    pub robot_accuracy_m: f64,
    /// Its errors within a scan: the usual ones of such a robot, or those from its residuals.
    pub robot: RobotSigmas,
    /// Whether somebody stated it; else it is assumed.
    pub robot_is_stated: bool,
    /// Radius of the seam's edge, m.
    pub edge_radius_m: f64,
    /// Whether somebody stated it; else it is assumed.
    pub edge_is_stated: bool,
    /// Bias of the feature per 10° of tilt, along and across the picture's rows, px.
    pub feature_bias_px: f64,
    /// Whether the bias was estimated, with this value as the prior.
    pub bias_is_estimated: bool,
    /// Covariance of the shape of a sensor that is held; `None` where it is estimated, or exact.
    pub held_shape: Option<ShapeCovariance>,
}

impl SystematicLevels {
    /// For a recording with a known uncertainty of its sensor, whose shape may be held.
    #[must_use]
    pub(crate) fn of(
        recording: &Recording,
        config: &Config,
        knowledge: &ShapeKnowledge,
        is_held: bool,
    ) -> Self {
        let stated = recording.setup.robot_accuracy_m;
        // A held sensor is only as good as its file states, or as typical sensors are.
        let is_doubted = knowledge.stated || config.sensor != SensorMode::Fixed;
        let robot_accuracy_m = config.robot_accuracy_m.or(stated).unwrap_or(ASSUMED_ROBOT_ACCURACY_M);
        let edge_radius_m = config.edge_radius_m.or(recording.setup.edge_radius_m);
        Self {
            robot_accuracy_m,
            robot: if config.used_at.by_another_robot {
                RobotSigmas::for_another(robot_accuracy_m)
            } else {
                RobotSigmas::of_accuracy(robot_accuracy_m)
            },
            robot_is_stated: config.robot_accuracy_m.or(stated).is_some(),
            // The intersection of two fitted lines involves no edge.
            edge_radius_m: edge_radius_m.unwrap_or(if recording.stripes.is_empty() {
                ASSUMED_EDGE_RADIUS_M
            } else {
                0.0
            }),
            edge_is_stated: edge_radius_m.is_some(),
            feature_bias_px: config.feature_bias_px,
            bias_is_estimated: false,
            held_shape: (is_held && is_doubted).then_some(knowledge.covariance),
        }
    }
}
