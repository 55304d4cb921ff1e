//! Lines that are held where a drawing, or a measurement of the part, has them.
//!
//! Only a target of known place makes a translation observable at a constant attitude. The uncertainty of the place enters every result, as for all
//! held quantities (consider covariance). If the tilts of a scan determine the line better than the drawing does, the scan is better without the
//! drawing.

use crate::config::DrawnLine;
use crate::error::Error;
use crate::problem::parameters::{Parameters, line_index};
use crate::solve::fit::Fit;
use crate::solve::solver::Solver;

/// The unknowns of these lines.
///
/// # Errors
/// [`Error::NoSuchLine`] for a line that the scan does not have.
pub fn components(drawn: &[DrawnLine], lines: usize) -> Result<Vec<usize>, Error> {
    if let Some(missing) = drawn.iter().find(|drawn| drawn.line >= lines) {
        return Err(Error::NoSuchLine { line: missing.line, lines });
    }
    Ok(drawn.iter().flat_map(|drawn| line_index(drawn.line)..line_index(drawn.line + 1)).collect())
}

/// Standard deviation of each: rad about both cross axes, m along them.
#[must_use]
pub fn sigmas(drawn: &[DrawnLine]) -> Vec<(usize, f64)> {
    let of_line = |drawn: &DrawnLine| {
        let [turn, offset] = [drawn.direction_sigma_rad, drawn.offset_sigma_m];
        let first = line_index(drawn.line);
        [turn, turn, offset, offset].into_iter().enumerate().map(move |(k, sigma)| (first + k, sigma))
    };
    drawn.iter().flat_map(of_line).collect()
}

/// The fit with the lines where they are drawn. The solver holds them.
///
/// # Errors
/// Those of [`Solver::fit`].
pub(crate) fn fit_to(solver: &Solver<'_>, near: Fit, drawn: &[DrawnLine]) -> Result<Fit, Error> {
    if drawn.is_empty() {
        return Ok(near);
    }
    let mut start = Parameters { curvatures: Vec::new(), shape: None, ..near.parameters().clone() };
    for DrawnLine { line, line_in_base, .. } in drawn {
        let found = &start.lines[*line];
        let agrees = line_in_base.direction().dot(&found.direction()) >= 0.0;
        let towards = if agrees { *line_in_base } else { line_in_base.reversed() };
        start.lines[*line] = towards.anchored_near(found.anchor());
    }
    solver.fit(start)
}
