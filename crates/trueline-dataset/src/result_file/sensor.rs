//! The scan's information on the sensor's own calibration.

use crate::unit::MM_PER_M;
use nalgebra::{Matrix3x2, SMatrix, Vector2, Vector3};
use serde::{Deserialize, Serialize};
use trueline_geometry::Pose;
use trueline_model::{LaserSheet, RigidPart, SheetField, SheetShape};

/// The sensor's own calibration.
///
/// With (a, b) in mm along the stripe and in depth from `shape_origin_mm`, the sensor reports (a, b) of a point at
/// ((1 + h1) a + h3 b, (1 + h2) b)/w, w = 1 + h4 a + h5 b.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default)]
pub struct SensorEntry {
    /// What it is, as in sensor.toml: `camera_laser`, `profiler`, `points` or `poses`; absent in results of older programs.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub kind: Option<String>,
    /// `fixed`, `prior` or `free`.
    pub mode: String,
    /// h1, h2, h3, h4 per mm, h5 per mm: the whole correction, including the one in sensor.toml; null if it was held
    /// fixed.
    pub shape: Option<[f64; 5]>,
    /// One standard deviation of each.
    pub shape_sigma: Option<[f64; 5]>,
    /// Origin of the shape in the sheet.
    pub shape_origin_mm: Option<[f64; 2]>,
    /// The standard deviations before the scan.
    pub prior_sigma: Option<[f64; 5]>,
    /// Whether sensor.toml states these; else they are assumed.
    pub prior_stated: bool,
    /// Whether the scan adds information about the shape to the prior.
    pub improved: bool,
    /// hᵀ C⁻¹ h of the estimate: chi-squared with 5 degrees of freedom for a sensor without error; above 25 the sensor
    /// is off.
    pub wald: Option<f64>,
    /// The findings, in words.
    pub words: Vec<String>,
    /// The sensor file that `tool_from_camera` belongs to; null where the recording did not come with one.
    pub file: Option<SensorFileEntry>,
    /// Remaining error of `tool_from_camera` for the sensor as that file states it: RMS over the field, on top of the seam
    /// error. It is 0 for a file that contains the correction, and null if the shape was held or the scan does not determine
    /// the whole transform.
    pub remains_mm: Option<f64>,
    /// The rigid part of the shape, which `tool_from_camera` contains: with it the shape and the transform are used together. Null for
    /// a file that contains the correction.
    pub rigid_part: Option<RigidPartEntry>,
}

/// A sensor file.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default)]
pub struct SensorFileEntry {
    /// Its name: that of the input, or of `--write-sensor`.
    pub name: String,
    /// SHA-256 of its content.
    pub sha256: String,
    /// Whether it was written with the correction that the scan found.
    pub corrected: bool,
}

/// A rigid motion in the laser plane, q ↦ R q + s in the coordinates (a, b) of the plane, and where these lie in the camera frame.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default)]
pub struct RigidPartEntry {
    /// The angle of R, from a to b.
    pub turn_rad: f64,
    /// s.
    pub shift_mm: [f64; 2],
    /// Point with a = b = 0, in the camera frame.
    pub origin_mm: [f64; 3],
    /// Direction of a, along the stripe, in the camera frame.
    pub axis_a: [f64; 3],
    /// Direction of b, in depth, in the camera frame.
    pub axis_b: [f64; 3],
    /// From and to of the field along a.
    pub field_a_mm: [f64; 2],
    /// From and to of the field along b.
    pub field_b_mm: [f64; 2],
}

impl RigidPartEntry {
    /// Of a motion in the coordinates of a sheet, over a field.
    #[must_use]
    pub fn of(part: &RigidPart, sheet: &LaserSheet, field: &SheetField) -> Self {
        let mm = |m: f64| m * MM_PER_M;
        let axis = |k: usize| -> [f64; 3] { sheet.axes().column(k).into_owned().into() };
        Self {
            turn_rad: part.turn_rad,
            shift_mm: part.shift_m.map(mm),
            origin_mm: <[f64; 3]>::from(*sheet.origin()).map(mm),
            axis_a: axis(0),
            axis_b: axis(1),
            field_a_mm: field.width_m.map(mm),
            field_b_mm: field.depth_m.map(mm),
        }
    }

    /// The sheet with the motion's coordinates; `None` if the axes span no plane.
    fn sheet(&self) -> Option<LaserSheet> {
        let axes = Matrix3x2::from_columns(&[self.axis_a, self.axis_b].map(Vector3::from));
        LaserSheet::from_axes(Vector3::from(self.origin_mm.map(metres)), axes)
    }

    /// The motion in the camera frame from the sensor file's points to the corrected ones; `None` if the axes span no plane.
    #[must_use]
    pub fn corrected_from_file(&self) -> Option<Pose> {
        let part = RigidPart { turn_rad: self.turn_rad, shift_m: self.shift_mm.map(metres) };
        Some(part.in_camera(&self.sheet()?))
    }

    /// d (left rotation, translation) of [`Self::corrected_from_file`] / d h about an origin in the sheet, m, near the shape of a sensor
    /// without fault.
    #[must_use]
    pub fn d_shape(&self, shape_origin_m: [f64; 2]) -> Option<SMatrix<f64, 6, 5>> {
        let field = SheetField { width_m: self.field_a_mm.map(metres), depth_m: self.field_b_mm.map(metres) };
        let exact = SheetShape::exact_about(&Vector2::from(shape_origin_m));
        Some(field.rigid_part(&exact)?.d_in_camera(&self.sheet()?))
    }
}

fn metres(mm: f64) -> f64 {
    mm / MM_PER_M
}
