//! The drawing of a seam as a file: CSV of points, or DXF.

use crate::dialect::plain_csv;
use crate::error::{Error, Problem};
use crate::{dxf, reference_file, source_file};
use std::path::Path;
use trueline_geometry::Polyline;

/// Reads the curve of a drawing, in the part's own frame, m. A `.csv` file holds points along it (`x_mm,y_mm,z_mm`), a
/// `.dxf` file connected lines, arcs, polylines and splines.
///
/// # Errors
/// A file that is missing or broken, of another kind, or with no curve or several in it.
pub fn read(file: &Path) -> Result<Polyline, Error> {
    let is = |end: &str| file.extension().is_some_and(|extension| extension.eq_ignore_ascii_case(end));
    if is("csv") {
        let bytes = source_file::named(source_file::bytes(file))?;
        return reference_file::parse_points(file, &plain_csv(file, bytes, None)?.0);
    }
    if is("dxf") {
        return parse_dxf(file, &source_file::named(source_file::bytes(file))?);
    }
    let what = match file.extension().and_then(|extension| extension.to_str()) {
        Some(other) => format!("a drawing of kind `{other}`"),
        None => "a drawing of an unknown kind".to_owned(),
    };
    let hint = "export the seam from the CAD program as DXF (polyline, arcs or spline), or as points in a CSV: x_mm,y_mm,z_mm";
    Err(Error::unreadable(file, what, hint))
}

/// The curve of a drawing in DXF, m.
///
/// # Errors
/// A drawing that is broken, or with no curve or several in it.
pub fn parse_dxf(file: &Path, bytes: &[u8]) -> Result<Polyline, Error> {
    Polyline::new(dxf::points(file, bytes)?).ok_or_else(|| Error::in_file(file, Problem::NoRows))
}
