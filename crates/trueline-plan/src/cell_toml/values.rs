//! Values of keys, checked: impossible values are refused with the key.

use nalgebra::Vector3;
use serde::Deserialize;
use trueline_dataset::Problem;
use trueline_dataset::robot_csv::unit_quaternion;
use trueline_dataset::unit::MM_PER_M;
use trueline_geometry::{Pose, se3};

/// A transform as files have it.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PoseTable {
    translation_mm: [f64; 3],
    rotation_wxyz: [f64; 4],
}

impl PoseTable {
    /// The transform; `key` names its translation.
    pub(super) fn pose(&self, key: &'static str) -> Result<Pose, Problem> {
        Ok(se3::from_parts(unit_quaternion(self.rotation_wxyz)?, point(key, self.translation_mm)?))
    }
}

/// Numbers that are numbers.
pub(super) fn finite(key: &'static str, numbers: &[f64]) -> Result<(), Problem> {
    if numbers.iter().all(|x| x.is_finite()) {
        return Ok(());
    }
    Err(wrong(key, "finite numbers", &format!("{numbers:?}")))
}

pub(super) fn point(key: &'static str, mm: [f64; 3]) -> Result<Vector3<f64>, Problem> {
    if mm.iter().all(|x| x.is_finite()) {
        return Ok(Vector3::from(mm) / MM_PER_M);
    }
    Err(wrong(key, "finite numbers", &format!("{mm:?}")))
}

pub(super) fn range(key: &'static str, limits: [f64; 2]) -> Result<[f64; 2], Problem> {
    let [low, high] = limits;
    if low > 0.0 && low < high && high.is_finite() {
        return Ok(limits);
    }
    Err(wrong(key, "a smaller and a larger number above zero", &format!("{limits:?}")))
}

/// A number between two.
pub(super) fn between(
    key: &'static str,
    value: Option<f64>,
    default: f64,
    (limits, expected): ([f64; 2], &'static str),
) -> Result<f64, Problem> {
    let value = value.unwrap_or(default);
    if value >= limits[0] && value <= limits[1] {
        return Ok(value);
    }
    Err(wrong(key, expected, &value.to_string()))
}

pub(super) fn positive(key: &'static str, value: Option<f64>, default: f64) -> Result<f64, Problem> {
    let value = value.unwrap_or(default);
    if value > 0.0 && value.is_finite() {
        return Ok(value);
    }
    Err(wrong(key, "a number above zero", &value.to_string()))
}

pub(super) fn not_negative(key: &'static str, value: Option<f64>, default: f64) -> Result<f64, Problem> {
    let value = value.unwrap_or(default);
    if value >= 0.0 && value.is_finite() {
        return Ok(value);
    }
    Err(wrong(key, "a number of at least zero", &value.to_string()))
}

pub(super) fn wrong(key: &'static str, expected: &'static str, found: &str) -> Problem {
    Problem::Value { key, expected, found: found.to_owned() }
}
