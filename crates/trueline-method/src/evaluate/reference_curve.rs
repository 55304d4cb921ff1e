//! Reference of a seam: a given line, circle or curve, or the best fit.

use nalgebra::Vector3;
use trueline_geometry::{Circle, Line, Plane, Polyline, fit};

/// A seam's true form.
#[derive(Clone, Debug, PartialEq)]
pub enum ReferenceCurve {
    /// Straight.
    Line(Line),
    /// Round.
    Circle(Circle),
    /// Any form, given point by point.
    Curve(Polyline),
    /// Anything in a plane. Only the distance from the plane is an error.
    Plane(Plane),
}

/// The fitted form.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Form {
    /// The simplest form that the points confirm.
    #[default]
    Auto,
    /// A line.
    Line,
    /// A circle.
    Circle,
    /// A plane.
    Plane,
}

/// A circle must reduce the distance of the points to this fraction of a line's. The wobble from a wrong calibration is no reason for a circle.
const NEARER: f64 = 0.5;
/// Points are on neither line nor circle if their typical distance exceeds this fraction of their extent. No calibration is that wrong.
const NEITHER: f64 = 0.02;

impl ReferenceCurve {
    /// The name for a person.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Line(_) => "line",
            Self::Circle(_) => "circle",
            Self::Curve(_) => "curve",
            Self::Plane(_) => "plane",
        }
    }

    /// Unit direction of the reference at its point nearest to a given one. `None` without a direction.
    #[must_use]
    pub fn direction_at(&self, point: &Vector3<f64>) -> Option<Vector3<f64>> {
        match self {
            Self::Line(line) => Some(line.direction()),
            Self::Circle(circle) => {
                let radial = circle.nearest(point) - circle.centre();
                circle.axis().cross(&radial).try_normalize(1e-12)
            }
            Self::Curve(curve) => {
                let ends = curve.points().windows(2).min_by(|a, b| {
                    let middle = |ends: &[Vector3<f64>]| ((ends[0] + ends[1]) / 2.0 - point).norm();
                    middle(a).total_cmp(&middle(b))
                })?;
                (ends[1] - ends[0]).try_normalize(1e-12)
            }
            Self::Plane(_) => None,
        }
    }

    /// Vector from the nearest point of the reference to a point, m. `None` beyond the ends of an open curve.
    #[must_use]
    pub fn deviation(&self, point: &Vector3<f64>) -> Option<Vector3<f64>> {
        match self {
            Self::Line(line) => Some(point - line.anchored_near(point).anchor()),
            Self::Circle(circle) => Some(point - circle.nearest(point)),
            Self::Curve(curve) => {
                let nearest = curve.nearest(point);
                (!nearest.beyond_end).then(|| point - nearest.point)
            }
            Self::Plane(plane) => Some(plane.normal().into_inner() * plane.signed_distance(point)),
        }
    }

    /// Distance of a point, m, including the ends of an open curve.
    #[must_use]
    pub(crate) fn distance_with_ends(&self, point: &Vector3<f64>) -> f64 {
        match self {
            Self::Curve(curve) => (point - curve.nearest(point).point).norm(),
            other => other.deviation(point).map_or(f64::INFINITY, |deviation| deviation.norm()),
        }
    }

    /// The best fit to points with outliers. `None` if there are too few for that form.
    #[must_use]
    pub fn fitted(points: &[Vector3<f64>], form: Form) -> Option<Self> {
        let line = || (points.len() > 2).then(|| fit::robust_line(points)).flatten().map(Self::Line);
        let circle = || (points.len() > 3).then(|| fit::robust_circle(points)).flatten().map(Self::Circle);
        let plane =
            || (points.len() > 3).then(|| fit::robust_plane(points)).flatten().map(|f| Self::Plane(f.plane));
        match form {
            Form::Line => line(),
            Form::Circle => circle(),
            Form::Plane => plane(),
            Form::Auto => {
                let curve = match (line()?, circle()) {
                    (line, Some(circle)) if circle.spread(points) < NEARER * line.spread(points) => circle,
                    (line, _) => line,
                };
                let off = curve.spread(points) > NEITHER * extent(points);
                if off { plane() } else { Some(curve) }
            }
        }
    }

    /// Median distance of points, m.
    fn spread(&self, points: &[Vector3<f64>]) -> f64 {
        let distances = points.iter().filter_map(|p| self.deviation(p)).map(|d| d.norm());
        crate::order_statistics::median(distances).unwrap_or(f64::INFINITY)
    }
}

/// The longest side of the points' bounding box, m.
fn extent(points: &[Vector3<f64>]) -> f64 {
    let first = points.first().copied().unwrap_or_default();
    let (low, high) = points.iter().fold((first, first), |(low, high), p| (low.inf(p), high.sup(p)));
    (high - low).max()
}
