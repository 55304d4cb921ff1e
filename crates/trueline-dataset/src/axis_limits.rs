//! `[axis.limits]` of `cell.toml`: how an external axis may move in a planned scan.

use crate::error::Problem;
use crate::unit::MM_PER_M;
use serde::{Deserialize, Serialize};
use trueline_geometry::AxisKind;

/// Kind of motion in a planned scan.
#[derive(Clone, Debug, PartialEq)]
pub enum AxisMotion {
    /// It swings within its range.
    Swings,
    /// It runs once from one end of its range to the other.
    Runs,
    /// It stands at these places in turn, rad or m.
    Stands(Vec<f64>),
}

/// Limits of an axis in a planned scan, in rad or m.
#[derive(Clone, Debug, PartialEq)]
pub struct AxisLimits {
    /// Lowest and highest value.
    pub range: [f64; 2],
    /// Top speed, 1/s.
    pub speed: f64,
    /// Acceleration, 1/s².
    pub acceleration: f64,
    /// Its motion.
    pub motion: AxisMotion,
}

impl AxisLimits {
    /// Limits of an axis without stated ones: a table swings by ±30°, a track by ±200 mm.
    #[must_use]
    pub fn usual(kind: AxisKind) -> Self {
        let (by, speed, acceleration) = match kind {
            AxisKind::Rotary => (30f64.to_radians(), 20f64.to_radians(), 40f64.to_radians()),
            AxisKind::Linear => (0.2, 0.2, 0.4),
        };
        Self { range: [-by, by], speed, acceleration, motion: AxisMotion::Swings }
    }
}

#[derive(Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct LimitsTable {
    motion: Option<String>,
    range_deg: Option<[f64; 2]>,
    range_mm: Option<[f64; 2]>,
    stand_deg: Option<Vec<f64>>,
    stand_mm: Option<Vec<f64>>,
    speed_deg_s: Option<f64>,
    speed_mm_s: Option<f64>,
    acceleration_deg_s2: Option<f64>,
    acceleration_mm_s2: Option<f64>,
}

/// A smaller range holds no swing that shows the axis: rad …
const LEAST_RAD: f64 = std::f64::consts::PI / 180.0;
/// … and m.
const LEAST_M: f64 = 5e-3;

/// The limits that a table states.
///
/// # Errors
/// Keys of the other kind of axis, values that no axis has, and a range without room for a motion.
pub(crate) fn limits(kind: AxisKind, table: Option<&LimitsTable>) -> Result<AxisLimits, Problem> {
    let usual = AxisLimits::usual(kind);
    let Some(table) = table else { return Ok(usual) };
    let is_rotary = kind == AxisKind::Rotary;
    let strange = match kind {
        AxisKind::Rotary => [
            ("axis.limits.range_mm", table.range_mm.is_some()),
            ("axis.limits.stand_mm", table.stand_mm.is_some()),
            ("axis.limits.speed_mm_s", table.speed_mm_s.is_some()),
            ("axis.limits.acceleration_mm_s2", table.acceleration_mm_s2.is_some()),
        ],
        AxisKind::Linear => [
            ("axis.limits.range_deg", table.range_deg.is_some()),
            ("axis.limits.stand_deg", table.stand_deg.is_some()),
            ("axis.limits.speed_deg_s", table.speed_deg_s.is_some()),
            ("axis.limits.acceleration_deg_s2", table.acceleration_deg_s2.is_some()),
        ],
    };
    if let Some((key, _)) = strange.into_iter().find(|(_, is_there)| *is_there) {
        let expected = if is_rotary { "degrees for a rotary axis" } else { "mm for a linear axis" };
        return Err(Problem::Value { key, expected, found: "the other unit".to_owned() });
    }
    let unit = if is_rotary { 1f64.to_radians() } else { MM_PER_M.recip() };
    let pick = |deg: &'static str, mm: &'static str| if is_rotary { deg } else { mm };
    let range = range(
        pick("axis.limits.range_deg", "axis.limits.range_mm"),
        table.range_deg.or(table.range_mm).map(|range| range.map(|value| value * unit)),
        (usual.range, kind),
    )?;
    let positive = |key: &'static str, value: Option<f64>, usual: f64| match value {
        Some(value) if !(value > 0.0 && value.is_finite()) => {
            Err(Problem::Value { key, expected: "a number above zero", found: value.to_string() })
        }
        value => Ok(value.map_or(usual, |value| value * unit)),
    };
    let speed = positive(
        pick("axis.limits.speed_deg_s", "axis.limits.speed_mm_s"),
        table.speed_deg_s.or(table.speed_mm_s),
        usual.speed,
    )?;
    let acceleration = positive(
        pick("axis.limits.acceleration_deg_s2", "axis.limits.acceleration_mm_s2"),
        table.acceleration_deg_s2.or(table.acceleration_mm_s2),
        usual.acceleration,
    )?;
    let stands = table.stand_deg.as_ref().or(table.stand_mm.as_ref());
    let stands = stands.map(|values| values.iter().map(|value| value * unit).collect::<Vec<f64>>());
    let key = pick("axis.limits.stand_deg", "axis.limits.stand_mm");
    let is_stated = table.range_deg.or(table.range_mm).is_some();
    let motion = motion(table.motion.as_deref(), key, stands, is_stated.then_some(range))?;
    Ok(AxisLimits { range, speed, acceleration, motion })
}

fn range(
    key: &'static str,
    stated: Option<[f64; 2]>,
    (usual, kind): ([f64; 2], AxisKind),
) -> Result<[f64; 2], Problem> {
    let [low, high] = stated.unwrap_or(usual);
    let (least, expected) = match kind {
        AxisKind::Rotary => (LEAST_RAD, "a lower and an upper limit, at least 1° apart for a swing"),
        AxisKind::Linear => (LEAST_M, "a lower and an upper limit, at least 5 mm apart for a swing"),
    };
    if low.is_finite() && high.is_finite() && high - low >= least {
        return Ok([low, high]);
    }
    let unit = if kind == AxisKind::Rotary { 1f64.to_degrees() } else { MM_PER_M };
    Err(Problem::Value { key, expected, found: format!("[{}, {}]", low * unit, high * unit) })
}

fn motion(
    stated: Option<&str>,
    key: &'static str,
    stands: Option<Vec<f64>>,
    range: Option<[f64; 2]>,
) -> Result<AxisMotion, Problem> {
    let wrong = |key, expected, found: &str| Problem::Value { key, expected, found: found.to_owned() };
    if let Some(places) = &stands {
        let [low, high] = range.unwrap_or([f64::NEG_INFINITY, f64::INFINITY]);
        let is_within = |value: &f64| value.is_finite() && (low..=high).contains(value);
        if places.is_empty() || !places.iter().all(is_within) {
            return Err(wrong(key, "at least one place, each within the range", "none, or one beyond it"));
        }
    }
    match (stated.unwrap_or(if stands.is_some() { "stand" } else { "swing" }), stands) {
        ("stand", Some(places)) => Ok(AxisMotion::Stands(places)),
        ("stand", None) => Err(wrong(key, "the places where it stands", "none")),
        ("swing" | "run", Some(_)) => {
            Err(wrong("axis.limits.motion", "\"stand\" beside stated places", "another motion"))
        }
        ("swing", None) => Ok(AxisMotion::Swings),
        ("run", None) => Ok(AxisMotion::Runs),
        (other, _) => {
            Err(wrong("axis.limits.motion", "\"swing\", \"stand\" or \"run\"", &format!("\"{other}\"")))
        }
    }
}
