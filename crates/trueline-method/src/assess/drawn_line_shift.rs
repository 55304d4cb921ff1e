//! Distance of a line from its drawing, estimated by a scan without the drawing.

use crate::assess::sensor_shape::WALD_LIMIT;
use crate::config::DrawnLine;
use nalgebra::{DMatrix, DVector, Matrix4, Vector4};
use trueline_geometry::Line;

/// A line that differs from its drawing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DrawnLineShift {
    /// Its number among the features.
    pub line: usize,
    /// Distance between the scan's line and the drawn one at the middle of the scan, m, with its standard deviation from scan and drawing.
    pub beside_m: Option<(f64, f64)>,
    /// Angle between them, rad, with its standard deviation.
    pub turned_rad: Option<(f64, f64)>,
}

impl DrawnLineShift {
    /// `found` is the scan's line with the covariance of its tangent (two turns, rad, two offsets, m). `seen` states which components are
    /// observable. `None` if dᵀ C⁻¹ d of these is within the limit used for a sensor's shape.
    #[must_use]
    pub fn of(drawn: &DrawnLine, found: &Line, covariance: &Matrix4<f64>, seen: [bool; 4]) -> Option<Self> {
        let step = step(drawn, found);
        let [turn, offset] = [drawn.direction_sigma_rad, drawn.offset_sigma_m].map(|sigma| sigma * sigma);
        let of_both = covariance + Matrix4::from_diagonal(&Vector4::new(turn, turn, offset, offset));
        let told: Vec<usize> = (0..4).filter(|k| seen[*k]).collect();
        let off = DVector::from_fn(told.len(), |i, _| step[told[i]]);
        let known = DMatrix::from_fn(told.len(), told.len(), |i, j| of_both[(told[i], told[j])]);
        let wald = off.dot(&known.cholesky()?.solve(&off));
        // If one of a pair is unobservable, neither length nor direction is known.
        let pair = |first: usize| {
            let way = Vector4::from_fn(|k, _| if k == first || k == first + 1 { step[k] } else { 0.0 });
            let length = way.norm();
            let is_told = seen[first] && seen[first + 1] && length > 0.0;
            is_told.then(|| (length, way.dot(&(of_both * way)).max(0.0).sqrt() / length))
        };
        let shift = Self { line: drawn.line, beside_m: pair(2), turned_rad: pair(0) };
        (!told.is_empty() && wald > WALD_LIMIT).then_some(shift)
    }
}

/// The drawn line in the tangent of the found one: turns about its cross axes, rad, and offsets along them at the middle of the scan, m.
fn step(drawn: &DrawnLine, found: &Line) -> Vector4<f64> {
    let direction = drawn.line_in_base.direction();
    let towards = if direction.dot(&found.direction()) < 0.0 { -direction } else { direction };
    let turn = found.direction().cross(&towards);
    let angle_rad = turn.norm().atan2(found.direction().dot(&towards));
    let turn = turn.try_normalize(f64::MIN_POSITIVE).unwrap_or_default() * angle_rad;
    let offset = found.offset_of(drawn.line_in_base.anchored_near(found.anchor()).anchor());
    let axes = found.axes();
    Vector4::new(turn.dot(&axes.column(1)), turn.dot(&axes.column(2)), offset.x, offset.y)
}
