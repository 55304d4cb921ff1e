//! An external axis.

use crate::unit::MM_PER_M;
use nalgebra::{UnitVector3, Vector3};
use serde::{Deserialize, Serialize};
use trueline_geometry::{Axis, AxisKind};

/// An external axis: its place in base, or in the tool if it carries the sensor. A quantity that the scan does not
/// determine is null.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default)]
pub struct AxisEntry {
    /// Its name.
    pub name: String,
    /// `rotary` or `linear`.
    pub kind: String,
    /// The body that it moves: `part`, `robot` or `sensor`.
    pub carries: String,
    /// Its direction, of length 1: it turns right-handed about it, or moves along it.
    pub direction: Option<[f64; 3]>,
    /// The point of a rotary axis that is nearest to the seam.
    pub point_mm: Option<[f64; 3]>,
    /// How far it moves for a recorded value of one.
    pub scale: f64,
    /// Delay of its stamps against those of the robot.
    pub time_offset_s: Option<f64>,
    /// One standard deviation of each.
    pub sigma: AxisSigma,
}

impl AxisEntry {
    /// The axis, in SI; `None` if the scan did not determine its place. For an axis that only stood at its places a time
    /// offset has no meaning: it is zero.
    #[must_use]
    pub fn known(&self) -> Option<Axis> {
        let kind = if self.kind == "linear" { AxisKind::Linear } else { AxisKind::Rotary };
        let direction = UnitVector3::try_new(Vector3::from(self.direction?), 1e-6)?;
        let point_m = match kind {
            AxisKind::Rotary => Vector3::from(self.point_mm?) / MM_PER_M,
            AxisKind::Linear => Vector3::zeros(),
        };
        let time_offset_s = self.time_offset_s.unwrap_or(0.0);
        Some(Axis { scale: self.scale, time_offset_s, ..Axis::new(kind, direction, point_m) })
    }
}

/// One standard deviation of each property of an axis, in its largest direction.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default)]
pub struct AxisSigma {
    /// Of its direction.
    pub direction_deg: Option<f64>,
    /// Of its place, square to it.
    pub point_mm: Option<f64>,
    /// Of its scale; 0 if that is held fixed.
    pub scale: f64,
    /// Of its time offset.
    pub time_offset_s: Option<f64>,
}
