//! Several sensors on one robot.

use super::PoseEntry;
use serde::{Deserialize, Serialize};

/// A sensor among several, tied to the others by the seams that they saw.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct SensorAmongEntry {
    /// Its name.
    pub name: String,
    /// Its hand-eye transform.
    pub tool_from_camera: PoseEntry,
    /// A reading stamped t was exposed at t − this.
    pub time_offset_s: f64,
    /// One standard deviation of each.
    pub sigma: SensorAmongSigma,
}

/// One standard deviation of a sensor's answer.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct SensorAmongSigma {
    /// Of the time offset.
    pub time_offset_s: f64,
    /// Of the rotation, about the axes of the tool.
    pub rotation_rad: [f64; 3],
    /// Of the translation.
    pub translation_mm: [f64; 3],
}

/// Pose of one sensor in the frame of another.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct BetweenEntry {
    /// Name of the sensor that defines the frame.
    pub from: String,
    /// Name of the other.
    pub to: String,
    /// Takes coordinates of `to` to those of `from`.
    pub transform: PoseEntry,
    /// One standard deviation: about and along the axes of `from`.
    pub sigma: BetweenSigma,
}

/// One standard deviation of a transform between two sensors.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct BetweenSigma {
    /// Of its rotation.
    pub rotation_rad: [f64; 3],
    /// Of its translation.
    pub translation_mm: [f64; 3],
}
