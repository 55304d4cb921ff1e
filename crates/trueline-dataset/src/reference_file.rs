//! The true form of a seam as a file: CSV of points, or TOML with lines or a circle.

use crate::dialect::plain_csv;
use crate::error::{Error, Problem};
use crate::sensor_toml::parse_toml;
use crate::source_file;
use crate::table::{ColumnSpec, Table, optional, required};
use crate::toml_place::in_toml;
use crate::unit::{MM_PER_M, Quantity};
use nalgebra::{UnitVector3, Vector3};
use serde::Deserialize;
use std::path::Path;
use trueline_geometry::{Circle, Line, Polyline};

/// Content of a reference file.
#[derive(Clone, Debug, PartialEq)]
pub enum Reference {
    /// Straight seams, in the order of the features' `line`.
    Lines(Vec<Line>),
    /// A round seam.
    Circle(Circle),
    /// A seam of any form.
    Curve(Polyline),
}

/// `truth.toml` is a reference too; its other keys are of no interest here.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ReferenceFile {
    #[serde(default)]
    lines: Vec<LineTable>,
    circle: Option<CircleTable>,
    #[serde(rename = "time_offset_s")]
    _time_offset_s: Option<f64>,
    #[serde(rename = "tool_from_camera")]
    _tool_from_camera: Option<toml::Table>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct LineTable {
    point_mm: [f64; 3],
    direction: [f64; 3],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CircleTable {
    centre_mm: [f64; 3],
    axis: [f64; 3],
    radius_mm: f64,
}

/// `sigma` is that of `export --as curve-csv`: a reference counts as exact.
const COLUMNS: [ColumnSpec<'static>; 4] = [
    required("x", Quantity::Length),
    required("y", Quantity::Length),
    required("z", Quantity::Length),
    optional("sigma", Quantity::Length),
];

/// Reads a reference. A `.csv` file holds points along the seam (`x_mm,y_mm,z_mm`). Other files are TOML with
/// `[[lines]]` (`point_mm`, `direction`) or `[circle]` (`centre_mm`, `axis`, `radius_mm`). All are in base.
///
/// # Errors
/// A file that is missing or broken, or that names no form or two.
pub fn read(file: &Path) -> Result<Reference, Error> {
    let bytes =
        source_file::bytes_if_there(file)?.ok_or_else(|| Error::in_file(file, Problem::MissingReference))?;
    if file.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("csv")) {
        return parse_points(file, &plain_csv(file, bytes, None)?.0).map(Reference::Curve);
    }
    parse_toml_reference(file, &crate::folder::utf8(file, bytes)?)
}

/// Points along a curve, m.
pub(crate) fn parse_points(file: &Path, bytes: &[u8]) -> Result<Polyline, Error> {
    let mut table = Table::open(file, bytes, &COLUMNS)?;
    let mut points = Vec::new();
    while table.next_row()? {
        let mut point = Vector3::zeros();
        for (column, value) in point.iter_mut().enumerate() {
            *value = table.required_number(column)?;
        }
        if points.last() == Some(&point) {
            return Err(table.error(Problem::PointRepeated));
        }
        points.push(point);
    }
    Polyline::new(points).ok_or_else(|| Error::in_file(file, Problem::NoRows))
}

fn parse_toml_reference(file: &Path, text: &str) -> Result<Reference, Error> {
    let wire: ReferenceFile = parse_toml(file, text)?;
    let at = |problem| in_toml(file, text, problem);
    let expected = "`[[lines]]` or `[circle]`";
    match (wire.lines.is_empty(), wire.circle) {
        (false, None) => {
            let lines: Result<_, Problem> = wire
                .lines
                .iter()
                .map(|line| {
                    let direction = unit("lines.direction", line.direction)?;
                    Ok(Line::new(point("lines.point_mm", line.point_mm)?, &direction))
                })
                .collect();
            Ok(Reference::Lines(lines.map_err(at)?))
        }
        (true, Some(circle)) => circle_from(&circle).map(Reference::Circle).map_err(at),
        (true, None) => Err(at(Problem::Value { key: "lines", expected, found: "neither".to_owned() })),
        (false, Some(_)) => Err(at(Problem::Value { key: "lines", expected, found: "both".to_owned() })),
    }
}

fn circle_from(wire: &CircleTable) -> Result<Circle, Problem> {
    let axis = unit("circle.axis", wire.axis)?;
    Circle::new(point("circle.centre_mm", wire.centre_mm)?, axis, wire.radius_mm / MM_PER_M).ok_or_else(
        || Problem::Value {
            key: "circle.radius_mm",
            expected: "a number above zero",
            found: wire.radius_mm.to_string(),
        },
    )
}

fn point(key: &'static str, mm: [f64; 3]) -> Result<Vector3<f64>, Problem> {
    if mm.iter().all(|x| x.is_finite()) {
        return Ok(Vector3::from(mm) / MM_PER_M);
    }
    Err(Problem::Value { key, expected: "finite numbers", found: format!("{mm:?}") })
}

fn unit(key: &'static str, direction: [f64; 3]) -> Result<UnitVector3<f64>, Problem> {
    UnitVector3::try_new(Vector3::from(direction), 1e-6)
        .filter(|u| u.iter().all(|x| x.is_finite()))
        .ok_or_else(|| Problem::Value { key, expected: "a direction", found: format!("{direction:?}") })
}
