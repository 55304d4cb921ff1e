//! A straight face of a profile, and its measurement.

use super::bow::{BeyondLine, Bow, Place};
use super::straight_line::StraightLine;
use crate::measure::regression::{Regression, Shift};
use nalgebra::Vector2;

/// Noise is not taken to be smaller, mm: profilers print 0.1 µm.
pub(super) const LEAST_SIGMA_MM: f64 = 1e-4;

/// Measurement of a straight face: two points with independent and equally large errors perpendicular to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FaceSupport {
    /// The points (x, z), the one nearer to the seam first, mm.
    pub points_mm: [Vector2<f64>; 2],
    /// Standard deviation of each square to the face, mm.
    pub sigma_mm: f64,
}

/// The line of a face, and the scatter of its points about it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct RoughFace {
    pub(super) line: StraightLine,
    pub(super) sigma_mm: f64,
}

/// A straight face: a point, its direction and the regression of the shifts square to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Face {
    pub(super) about: RoughDirection,
    pub(super) regression: Regression,
    /// Its line.
    pub(super) line: StraightLine,
    /// The bow that was taken out of it.
    pub(super) bow: Option<Bow>,
}

impl Face {
    /// A face from shifts about a direction.
    pub(super) fn of(about: RoughDirection, regression: Regression) -> Self {
        let line = about.line([regression.centre, regression.shift_px], regression.slope);
        Self { about, regression, line, bow: None }
    }

    /// The same face, with one end (0 to the left, 1 to the right) further along x.
    pub(super) fn with_end_moved(&self, end: usize, by_x_mm: f64) -> Self {
        let Some(bow) = &self.bow else { return *self };
        let mut ends = bow.place.ends();
        ends[end] += by_x_mm * self.along_per_x();
        self.over(&Place::between(ends[0], ends[1]))
    }

    /// The line with equal weights of another place along the same bowed surface.
    pub(super) fn over(&self, place: &Place) -> Self {
        let Some(bow) = &self.bow else { return *self };
        let ([level, turn], bow) = bow.over(place);
        let Regression { centre, shift_px, slope, .. } = self.regression;
        let regression = Regression {
            shift_px: shift_px + level + turn * place.of_one(centre),
            slope: slope + turn / place.half,
            ..self.regression
        };
        Self { bow: Some(bow), ..Self::of(self.about, regression) }
    }

    /// Coordinate along it at a place along the profile.
    pub(super) fn along_at(&self, x_mm: f64) -> f64 {
        let Regression { centre, shift_px, .. } = self.regression;
        centre + (x_mm - self.about.at(centre, shift_px).x) * self.along_per_x()
    }

    /// How far one goes along the rough direction for a millimetre along the profile.
    fn along_per_x(&self) -> f64 {
        let RoughDirection { along, .. } = self.about;
        1.0 / (along.x - along.y * self.regression.slope)
    }

    /// The tangent of the face, its bow with it, beside a point.
    pub(super) fn tangent_beside(&self, point: &Vector2<f64>) -> StraightLine {
        let s = self.about.shift(point).s;
        let BeyondLine { shift_mm, slope, .. } = self.beyond_line(s);
        let on_it = [s, self.regression.shift_at(s) + shift_mm];
        self.about.line(on_it, self.regression.slope + slope)
    }

    /// Variance of the face, its bow with it, beside a point, mm².
    pub(super) fn bowed_variance_at(&self, point: &Vector2<f64>) -> f64 {
        self.variance_at(point) + self.beyond_line(self.about.shift(point).s).variance_mm2
    }

    fn beyond_line(&self, s: f64) -> BeyondLine {
        let Some(bow) = &self.bow else { return BeyondLine::default() };
        bow.beyond_line(bow.place.of_one(s), self.regression.variance_at(bow.place.middle))
    }

    /// Variance of the line at a point of it, mm².
    pub(super) fn variance_at(&self, point: &Vector2<f64>) -> f64 {
        self.regression.variance_at(self.about.shift(point).s).max(LEAST_SIGMA_MM.powi(2))
    }

    /// The line at a place along the profile.
    pub(super) fn at_x(&self, x_mm: f64) -> Option<Vector2<f64>> {
        let Regression { centre, shift_px, .. } = self.regression;
        let (anchor, direction) = (self.about.at(centre, shift_px), self.direction());
        let steps = (x_mm - anchor.x) / direction.x;
        steps.is_finite().then(|| anchor + direction * steps)
    }

    /// Distance of a point from the line, signed.
    pub(super) fn off(&self, point: &Vector2<f64>) -> f64 {
        self.line.off(point)
    }

    /// Unit direction of the line.
    pub(super) fn direction(&self) -> Vector2<f64> {
        self.about.direction(self.regression.slope)
    }

    /// The support points of the face, as of a stripe in a picture. Errors of the line at two distances x, y from the middle
    /// of the regression covary by m₁₁ + m₁₂ (x + y) + m₂₂ x y. This vanishes for x, y = x₀ ± d with x₀ = −m₁₂/m₂₂ and d² =
    /// (m₁₁ − m₁₂²/m₂₂)/m₂₂. On an even face with equal errors they are ℓ/√3 from its middle. On a face with its bow removed
    /// they are put there. The scatter in one profile would move them along the line, away from the line's crossings with
    /// the surface. A profile without any noise has no information on it: then likewise.
    pub(super) fn support(&self, seam: &Vector2<f64>, half_length_mm: f64) -> FaceSupport {
        let Regression { centre, covariance, slope, .. } = &self.regression;
        let variance = covariance.m11 - covariance.m12 * covariance.m12 / covariance.m22;
        let half = (variance / covariance.m22).sqrt();
        let (middle, half) = match self.bow {
            Some(Bow { place, .. }) => (place.middle - centre, place.half / 3_f64.sqrt()),
            None if half > 0.0 && half.is_finite() => (-covariance.m12 / covariance.m22, half),
            None => (0.0, half_length_mm / 3_f64.sqrt()),
        };
        let at = |from_centre: f64| {
            let s = centre + from_centre;
            self.about.at(s, self.regression.shift_at(s))
        };
        let mut points_mm = [at(middle - half), at(middle + half)];
        if (points_mm[0] - seam).norm_squared() > (points_mm[1] - seam).norm_squared() {
            points_mm.swap(0, 1);
        }
        let sigma_mm = ((2.0 * variance.max(0.0)).sqrt() / slope.hypot(1.0)).max(LEAST_SIGMA_MM);
        FaceSupport { points_mm, sigma_mm }
    }
}

/// A point of a run of points and their approximate direction, as coordinates: the place along it, and the shift from it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct RoughDirection {
    pub(super) origin: Vector2<f64>,
    pub(super) along: Vector2<f64>,
}

impl RoughDirection {
    /// Coordinates of a point: along it, and its shift.
    pub(super) fn shift(&self, point: &Vector2<f64>) -> Shift {
        let from = point - self.origin;
        Shift {
            s: self.along.dot(&from),
            shift_px: square_to(&self.along).dot(&from),
            weight: 1.0,
            response: 1.0,
        }
    }

    /// The point at a distance along it, with a shift.
    pub(super) fn at(&self, along_mm: f64, shift_mm: f64) -> Vector2<f64> {
        self.origin + self.along * along_mm + square_to(&self.along) * shift_mm
    }

    /// The unit direction of a line of a slope about it.
    pub(super) fn direction(&self, slope: f64) -> Vector2<f64> {
        (self.along + square_to(&self.along) * slope).normalize()
    }

    /// The line through such a point, of a slope.
    pub(super) fn line(&self, [along_mm, shift_mm]: [f64; 2], slope: f64) -> StraightLine {
        StraightLine::through(&self.at(along_mm, shift_mm), square_to(&self.direction(slope)))
    }
}

pub(super) fn square_to(direction: &Vector2<f64>) -> Vector2<f64> {
    Vector2::new(-direction.y, direction.x)
}
