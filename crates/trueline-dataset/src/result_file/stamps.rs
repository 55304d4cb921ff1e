//! The streams' clocks, and how they were treated.

use serde::{Deserialize, Serialize};

/// Stamps of both streams. Times in the result are seconds since `zero_s`, the stamp of the first robot row.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default)]
pub struct Stamps {
    /// Stamp of time 0 in the files.
    pub zero_s: f64,
    /// The robot's.
    pub robot: RobotStream,
    /// The images'.
    pub features: FeatureStream,
    /// Noise of a recorded robot position, per axis, as measured on the stream.
    pub robot_noise_mm: f64,
    /// Whether the robot's poses were replaced by a local fit.
    pub robot_smoothed: bool,
    /// Robot samples that only repeat the pose before, and were left out.
    pub robot_poses_repeated: usize,
    /// Meaning of the stamps, if the recording states it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub meaning: Option<String>,
}

impl Stamps {
    /// Whether the time offset is that of stamps with jitter or drift removed, not of the recorded ones.
    #[must_use]
    pub(crate) fn are_treated(&self) -> bool {
        let dejittered = |stream: &Stream| stream.used == "regular";
        dejittered(&self.robot.stream) || dejittered(&self.features.stream) || self.features.drift_taken_out
    }
}

/// The robot's stream.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default)]
pub struct RobotStream {
    /// Properties that both streams have.
    #[serde(flatten)]
    pub stream: Stream,
    /// Rate of the controller's clock against the receiver's, where device stamps are recorded.
    pub drift_ppm: Option<f64>,
}

/// The images' stream.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default)]
pub struct FeatureStream {
    /// Properties that both streams have.
    #[serde(flatten)]
    pub stream: Stream,
    /// Drift of the time offset, even if it is not significant.
    pub drift_ppm: Option<f64>,
    /// Its standard deviation.
    pub drift_sigma_ppm: Option<f64>,
    /// Whether it was significant and has been taken out.
    pub drift_taken_out: bool,
    /// When the time offset holds.
    pub drift_about_s: Option<f64>,
}

/// The stamps of one stream.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default)]
pub struct Stream {
    /// Samples with a stamp of their own.
    pub count: usize,
    /// Rows that repeat the stamp of the row before.
    pub repeated: usize,
    /// Median time between stamps.
    pub median_period_s: f64,
    /// Longest time between stamps.
    pub longest_gap_s: f64,
    /// Sampling period of the clock behind the stamps; null if there is none.
    pub period_s: Option<f64>,
    /// Standard deviation of the stamps about that clock.
    pub jitter_s: Option<f64>,
    /// Samples missing between the first and the last.
    pub drops: Option<usize>,
    /// Silences of more than four periods.
    pub silences: usize,
    /// Rate of the device's clock against the receiver's, where device stamps are recorded.
    pub device_drift_ppm: Option<f64>,
    /// Whether all delays are to one side, so that the clock follows their lower bound.
    pub one_sided: bool,
    /// Median lateness of the stamps against that clock.
    pub late_s: Option<f64>,
    /// Lateness of the latest stamp: a stall of the receiver, or a queue.
    pub latest_s: Option<f64>,
    /// Largest deviation of that clock from an even tick; null if it is even.
    pub wander_s: Option<f64>,
    /// All stamps are multiples of this though the samples are not.
    pub grain_s: Option<f64>,
    /// Steps of the receive clock.
    pub steps: Vec<StepEntry>,
    /// Whether the only step is taken out of the regular stamps.
    pub step_taken_out: bool,
    /// `raw`, or `regular` if the samples were dated by the clock.
    pub used: String,
}

/// A step of a receive clock.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct StepEntry {
    /// When.
    pub at_s: f64,
    /// How high.
    pub step_s: f64,
}
