//! Settings of a production.

use super::change::ScheduledChange;
use crate::plates::Plates;
use crate::scenario::{Scenario, Sine};
use nalgebra::{UnitVector3, Vector3};

/// A production.
#[derive(Clone, Debug)]
pub struct Production {
    /// Sensor, mounting, clocks and noise; its lines, motion and duration are not used.
    pub scenario: Scenario,
    /// The seams of the part in the order in which they are welded.
    pub seams: Vec<SeamPass>,
    /// Speed along the seams, m/s.
    pub speed_m_s: f64,
    /// Weave across the seam, m.
    pub weave: Sine,
    /// Change of stand-off, m.
    pub range: Sine,
    /// Work angle, travel angle and spin relative to those of each seam, rad.
    pub tilts: [Sine; 3],
    /// The point of the camera frame about which the tilts turn, m; `None`: the point of the seam, which then rests in the sheet.
    pub pivot_m: Option<Vector3<f64>>,
    /// The plates of each seam, with whole stripes for a camera; `None`: seam points alone.
    pub plates: Option<Plates>,
    /// How pieces differ.
    pub scatter: PlacementScatter,
    /// The change, and its time.
    pub change: Option<ScheduledChange>,
}

/// One seam of a part, as taught.
#[derive(Clone, Copy, Debug)]
pub struct SeamPass {
    /// Its start, m in base.
    pub start: Vector3<f64>,
    /// Its end, m in base.
    pub end: Vector3<f64>,
    /// Direction from which the sensor looks at it.
    pub approach: UnitVector3<f64>,
    /// Work angle about the seam, rad.
    pub work_angle_rad: f64,
}

/// How pieces differ: standard deviations.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PlacementScatter {
    /// The part in its fixture, each axis, m.
    pub translation_m: f64,
    /// The part about its middle, each axis, rad.
    pub rotation_rad: f64,
    /// Each seam on the part, in the two directions across it, m.
    pub seam_m: f64,
}

impl Production {
    /// The middle of all seams, m: pieces turn about it.
    #[must_use]
    pub fn middle(&self) -> Vector3<f64> {
        let sum: Vector3<f64> = self.seams.iter().map(|seam| 0.5 * (seam.start + seam.end)).sum();
        sum / self.seams.len().max(1) as f64
    }
}
