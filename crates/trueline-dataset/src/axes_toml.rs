//! `[[axis]]` of `cell.toml`: the external axes of a cell, and the body that each of them carries.

use crate::axes::{AxisGuess, AxisRecord, Carries, in_mm, is_axis_name};
use crate::axis_limits::{AxisLimits, LimitsTable, limits};
use crate::error::{Error, Problem};
use crate::sensor_toml::parse_toml;
use crate::toml_place::in_toml;
use crate::unit::MM_PER_M;
use nalgebra::{UnitVector3, Vector3};
use serde::{Deserialize, Serialize};
use std::path::Path;
use trueline_geometry::AxisKind;

/// A cell as far as its axes go. The same file describes a cell for `plan`, which checks its own tables.
#[derive(Serialize, Deserialize)]
struct CellFile {
    #[serde(default)]
    axis: Vec<AxisTable>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct AxisTable {
    name: String,
    kind: String,
    carries: String,
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    in_pose: bool,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    direction: Option<[f64; 3]>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    point_mm: Option<[f64; 3]>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    uncertainty: Option<UncertaintyTable>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    limits: Option<LimitsTable>,
}

#[derive(Clone, Copy, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct UncertaintyTable {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    direction_deg: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    point_mm: Option<f64>,
}

/// Keys of a cell beside its axes.
const OF_PLAN: [&str; 13] = [
    "sensor",
    "seam",
    "tool_from_camera",
    "attitude",
    "guess_error",
    "limits",
    "view",
    "noise",
    "rates",
    "arm",
    "spheres",
    "plates",
    "axis",
];

/// Reads the axes of a cell, without values.
///
/// # Errors
/// Refuses broken TOML, unknown keys, impossible or repeated names, directions without length, and an axis within the
/// robot's poses without a stated place.
pub(crate) fn parse(file: &Path, text: &str) -> Result<Vec<AxisRecord>, Error> {
    Ok(planned(file, text)?.into_iter().map(|(axis, _)| axis).collect())
}

/// The same with the limits of each axis in a planned scan.
///
/// # Errors
/// As for a scan, and limits that no axis has.
pub fn planned(file: &Path, text: &str) -> Result<Vec<(AxisRecord, AxisLimits)>, Error> {
    let keys: toml::Table = parse_toml(file, text)?;
    if let Some(unknown) = keys.keys().find(|key| !OF_PLAN.contains(&key.as_str())) {
        let problem = Problem::Toml(format!("unknown table `{unknown}`; axes are `[[axis]]`"));
        return Err(Error::in_file(file, problem));
    }
    let wire: CellFile = parse_toml(file, text)?;
    let mut axes: Vec<(AxisRecord, AxisLimits)> = Vec::with_capacity(wire.axis.len());
    for table in &wire.axis {
        let (axis, limits) = axis(table)
            .and_then(|axis| Ok((axis.clone(), limits(axis.kind, table.limits.as_ref())?)))
            .map_err(|problem| in_toml(file, text, problem))?;
        if axes.iter().any(|(other, _)| other.name == axis.name) {
            let expected = "a name for each axis";
            return Err(in_toml(file, text, Problem::Value { key: "axis.name", expected, found: axis.name }));
        }
        axes.push((axis, limits));
    }
    Ok(axes)
}

fn axis(table: &AxisTable) -> Result<AxisRecord, Problem> {
    if !is_axis_name(&table.name) {
        let expected = "letters, digits, - and _";
        return Err(Problem::Value { key: "axis.name", expected, found: table.name.clone() });
    }
    let unknown = |key: &'static str, expected: &'static str, found: &str| Problem::Value {
        key,
        expected,
        found: format!("\"{found}\""),
    };
    let kind = AxisKind::named(&table.kind)
        .ok_or_else(|| unknown("axis.kind", "\"rotary\" or \"linear\"", &table.kind))?;
    let carries = Carries::named(&table.carries)
        .ok_or_else(|| unknown("axis.carries", "\"part\", \"robot\" or \"sensor\"", &table.carries))?;
    let guess = guess(table)?;
    let is_rotary = kind == AxisKind::Rotary;
    if table.in_pose && guess.is_none_or(|guess| guess.point_m.is_none() && is_rotary) {
        let expected = "direction and point_mm from the controller, because its poses contain this axis";
        return Err(Problem::Value { key: "axis.in_pose", expected, found: "none".to_owned() });
    }
    Ok(AxisRecord { in_pose: table.in_pose, guess, ..AxisRecord::new(&table.name, kind, carries) })
}

fn guess(table: &AxisTable) -> Result<Option<AxisGuess>, Problem> {
    let Some(direction) = table.direction else {
        if table.point_mm.is_some() || table.uncertainty.is_some() {
            let expected = "a direction beside point_mm and uncertainty";
            return Err(Problem::Value { key: "axis.direction", expected, found: "none".to_owned() });
        }
        return Ok(None);
    };
    let finite = |values: &[f64; 3]| values.iter().all(|value| value.is_finite());
    let unit = UnitVector3::try_new(Vector3::from(direction), 1e-6).filter(|_| finite(&direction));
    let direction = unit.ok_or_else(|| Problem::Value {
        key: "axis.direction",
        expected: "three numbers that are not all zero",
        found: format!("{direction:?}"),
    })?;
    if let Some(point_mm) = table.point_mm.filter(|point_mm| !finite(point_mm)) {
        let expected = "three finite numbers";
        return Err(Problem::Value { key: "axis.point_mm", expected, found: format!("{point_mm:?}") });
    }
    let sigma = |value: Option<f64>, key: &'static str, unit: f64| match value {
        Some(sigma) if !(sigma > 0.0 && sigma.is_finite()) => {
            Err(Problem::Value { key, expected: "a number above zero", found: sigma.to_string() })
        }
        sigma => Ok(sigma.map(|sigma| sigma * unit)),
    };
    let stated = table.uncertainty;
    let of_direction = stated.and_then(|stated| stated.direction_deg);
    let of_point = stated.and_then(|stated| stated.point_mm);
    Ok(Some(AxisGuess {
        direction,
        point_m: table.point_mm.map(|point| Vector3::from(point) / MM_PER_M),
        sigma: [
            sigma(of_direction, "axis.uncertainty.direction_deg", 1f64.to_radians())?,
            sigma(of_point, "axis.uncertainty.point_mm", MM_PER_M.recip())?,
        ],
    }))
}

/// The text of a cell that has these axes and nothing else.
pub(crate) fn text(axes: &[AxisRecord]) -> String {
    let table = |axis: &AxisRecord| AxisTable {
        name: axis.name.clone(),
        kind: axis.kind.name().to_owned(),
        carries: axis.carries.name().to_owned(),
        in_pose: axis.in_pose,
        direction: axis.guess.map(|guess| guess.direction.into_inner().into()),
        point_mm: axis.guess.and_then(|guess| guess.point_m).map(|point_m| in_mm(&point_m)),
        uncertainty: axis.guess.filter(|guess| guess.sigma != [None; 2]).map(|guess| UncertaintyTable {
            direction_deg: guess.sigma[0].map(f64::to_degrees),
            point_mm: guess.sigma[1].map(|sigma_m| sigma_m * MM_PER_M),
        }),
        limits: None,
    };
    toml::to_string(&CellFile { axis: axes.iter().map(table).collect() }).unwrap_or_default()
}
