//! Lines that are held where a drawing, or a measurement of the part, has them.
//!
//! Only a target of known place shows a translation at a constant attitude. How well the place is known goes into every ± as for
//! all that is held (its consider covariance). A scan whose tilts show the line better than the
//! drawing does is better off without it.

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

/// How well each of them is known: rad about both cross axes, m along them.
#[must_use]
pub fn sigmas(drawn: &[DrawnLine]) -> Vec<(usize, f64)> {
    let of_line = |drawn: &DrawnLine| {
        let [turn, offset] = [drawn.direction_sigma_rad, drawn.offset_sigma_m];
        let first = line_index(drawn.line);
        [turn, turn, offset, offset].into_iter().enumerate().map(move |(k, sigma)| (first + k, sigma))
    };
    drawn.iter().flat_map(of_line).collect()
}

/// The fit with the lines where they are drawn; the solver holds them.
///
/// # Errors
/// As [`Solver::fit`].
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
