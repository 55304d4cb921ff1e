//! The estimates, their uncertainties, and the quantities that could not be estimated.

use serde::{Deserialize, Serialize};

/// A transform.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct PoseEntry {
    /// Translation along each tool axis; null if it is not observable.
    pub translation_mm: [Option<f64>; 3],
    /// Unit quaternion w, x, y, z with w ≥ 0; null if a rotation is not observable.
    pub rotation_wxyz: Option<[f64; 4]>,
}

/// A target that was sighted.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct TargetEntry {
    /// Its place; null if it is not observable.
    pub translation_mm: [Option<f64>; 3],
    /// Unit quaternion w, x, y, z with w ≥ 0; null if its attitude is not observable.
    pub rotation_wxyz: Option<[f64; 4]>,
    /// One standard deviation of its rotation about each axis of base (left perturbation).
    pub sigma_rotation_rad: [Option<f64>; 3],
    /// One standard deviation of its translation along each axis of base.
    pub sigma_translation_mm: [Option<f64>; 3],
    /// Noise of a sighting about each axis of the camera: as stated, or estimated.
    pub sighting_rotation_deg: [f64; 3],
    /// Noise of a sighting along each axis of the camera.
    pub sighting_translation_mm: [f64; 3],
    /// Whether the sightings state it.
    pub noise_stated: bool,
    /// Length over reported length of the sightings, where that is certainly not one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scale: Option<f64>,
    /// One standard deviation of it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sigma_scale: Option<f64>,
}

/// A sphere that was scanned.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct SphereEntry {
    /// Its centre in base, or with `mounted` fixed in the tool; null where it is not observable.
    pub center_mm: [Option<f64>; 3],
    /// One standard deviation of it along each axis.
    pub sigma_center_mm: [Option<f64>; 3],
    /// Its radius: stated, or estimated.
    pub radius_mm: f64,
    /// One standard deviation of the radius; null where it is stated.
    pub sigma_radius_mm: Option<f64>,
    /// Noise of the circle in a profile: of its centre along the stripe and in depth, and of its radius.
    pub sigma_circle_mm: [f64; 3],
    /// Profiles that were read.
    pub profiles: usize,
    /// Profiles in which an arc was found.
    pub arcs: usize,
}

/// A cylinder that was scanned.
///
/// Its place along its axis and its turn about it are not estimated: it looks the same under them.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct CylinderEntry {
    /// Unit direction of its axis in base, or with `mounted` fixed in the tool; null where it is not observable.
    pub direction: Option<[f64; 3]>,
    /// A point of its axis in the middle of the scanned part, in the same frame; null where it is not observable.
    pub point_mm: Option<[f64; 3]>,
    /// One standard deviation of the direction, in its largest direction.
    pub sigma_direction_deg: Option<f64>,
    /// One standard deviation of the point across the axis, in its largest direction.
    pub sigma_point_mm: Option<f64>,
    /// Its radius: stated, or estimated.
    pub radius_mm: f64,
    /// One standard deviation of the radius; null where it is stated.
    pub sigma_radius_mm: Option<f64>,
    /// Noise of the arc in a profile, across it: at its ends, and in its middle.
    pub sigma_arc_mm: [f64; 2],
    /// Profiles that were read.
    pub profiles: usize,
    /// Profiles in which an arc was found.
    pub arcs: usize,
    /// What of its pose is held, because the cylinder looks the same under it.
    pub held: Vec<String>,
}

/// A line in base.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default)]
pub struct LineEntry {
    /// Its number among the features.
    pub label: String,
    /// A point in the middle of the scanned part.
    pub point_mm: Option<[f64; 3]>,
    /// Unit direction in which the scan progressed.
    pub direction: Option<[f64; 3]>,
    /// Plücker coordinates.
    pub pluecker: Option<LinePosition>,
    /// Orthonormal form: rotation vector of U (rad), then the distance from the origin (mm); null through the origin.
    pub orthonormal: Option<[f64; 4]>,
    /// Its bow along each of `curvature_axes`, in (s/100 mm)²; null if the line is not observable or was treated as
    /// straight.
    pub curvature_mm_per_100mm_squared: Option<[f64; 2]>,
    /// One standard deviation of each.
    pub curvature_sigma_mm_per_100mm_squared: Option<[f64; 2]>,
    /// Unit directions across the line, base frame.
    pub curvature_axes: Option<[[f64; 3]; 2]>,
}

/// A line's Plücker coordinates: moment = point × direction.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct LinePosition {
    /// The moment.
    pub moment_mm: [f64; 3],
    /// The direction.
    pub direction: [f64; 3],
}

/// Standard deviations; null for unobservable quantities and those held fixed.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default)]
pub struct Sigma {
    /// Of the time offset.
    pub time_offset_s: Option<f64>,
    /// Of the rotation about the tool's axes (left perturbation).
    pub rotation_rad: [Option<f64>; 3],
    /// Of the translation along the tool's axes.
    pub translation_mm: [Option<f64>; 3],
}

/// A covariance matrix; each name ends in its unit.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default)]
pub struct Covariance {
    /// Names of rows and columns.
    pub order: Vec<String>,
    /// Row by row; null in rows and columns without a sigma.
    pub matrix: Vec<Vec<Option<f64>>>,
}

impl Covariance {
    /// The entry of two components, in the units of their names.
    #[must_use]
    pub fn entry(&self, row: &str, column: &str) -> Option<f64> {
        let place = |name: &str| self.order.iter().position(|known| known == name);
        self.matrix.get(place(row)?)?.get(place(column)?).copied().flatten()
    }

    /// Standard deviation of a component, in the unit of its name.
    #[must_use]
    pub fn sigma(&self, name: &str) -> Option<f64> {
        let k = self.order.iter().position(|known| known == name)?;
        self.matrix.get(k)?.get(k).copied().flatten().map(f64::sqrt)
    }
}

/// Observability in this scan.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default)]
pub struct Observability {
    /// Observable directions.
    pub rank: usize,
    /// Unknowns.
    pub size: usize,
    /// Largest over smallest singular value; null where the smallest is zero.
    pub condition: Option<f64>,
    /// Directions below this part of the largest singular value are not observable.
    pub threshold: f64,
    /// Unobservable quantities.
    pub unobservable: Vec<UnobservableEntry>,
    /// Whether it was held at the initial guess.
    pub held_at_guess: bool,
}

/// A direction without information in the scan.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct UnobservableEntry {
    /// `time_offset`, `hand_eye_rotation`, `hand_eye_translation` or `line`.
    pub parameter: String,
    /// Unit direction: tool axes for the hand-eye, base axes for a line; null for the time offset.
    pub direction: Option<[f64; 3]>,
    /// The motion that would determine it.
    pub advice: String,
}

/// One step of the solver.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct IterationEntry {
    /// Cost ½ Σ ρ.
    pub cost: f64,
    /// Root mean square distance from the line.
    pub rms_mm: f64,
    /// Time offset before the step.
    pub time_offset_s: f64,
    /// Hand-eye translation before the step.
    pub translation_mm: [f64; 3],
    /// Hand-eye rotation before the step.
    pub rotation_wxyz: [f64; 4],
    /// The lines before the step.
    pub lines: Vec<IterationLine>,
    /// Whether the step was taken.
    pub accepted: bool,
}

/// A line before a step of the solver.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct IterationLine {
    /// Its point nearest to the base origin.
    pub nearest_point_mm: [f64; 3],
    /// Its unit direction.
    pub direction: [f64; 3],
}
