//! The arc in which the sheet cuts a round target: its points, their noise, and polynomials along it.
//!
//! A fit compares the points themselves with the target. What they are off by is smooth along the arc, so a few numbers tell all of it: its
//! coefficients on polynomials that are orthonormal over the points.

use super::target::{RoundTarget, Rows};
use nalgebra::{Matrix3, SMatrix, Vector2, Vector3};
use trueline_geometry::statistics::{lasting, mad_sigma, median};
use trueline_model::SheetShape;

/// Steps of the fit; each gains digits as Newton's do.
const STEPS: usize = 20;
/// The fit ends with a step below this, m.
const SMALL_STEP_M: f64 = 1e-12;
/// An arc is never known better than this, m: it keeps the covariance of exact points invertible.
const LEAST_SIGMA_M: f64 = 1e-9;
/// Points further off an arc than so many times their scatter are not of it.
const ON_ARC: f64 = 5.0;
/// Points that a circle and its scatter need.
pub const FEWEST_POINTS: usize = 8;
/// Points that are left over to show their scatter, at the least.
const LEFT_OVER: usize = 5;
/// Points of an arc that a fit compares, at the most; of more, neighbours are averaged.
const MOST_POINTS: usize = 240;
/// Stretches of an arc that have a noise of their own.
const STRETCHES: usize = 8;
/// The part of a point's error that its polynomial leaves in its residual is at least this.
const LEAST_LEFT: f64 = 0.1;

/// A circle in the sheet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Circle {
    /// Its centre in sheet coordinates, m.
    pub center_m: Vector2<f64>,
    /// Its radius, m.
    pub radius_m: f64,
}

impl Circle {
    /// How far a point is outside, m.
    #[must_use]
    pub fn off(&self, point: &Vector2<f64>) -> f64 {
        (point - self.center_m).norm() - self.radius_m
    }

    /// The circle of least squared distances from points, m; `None` of points on a line.
    #[must_use]
    pub fn of(points: &[Vector2<f64>]) -> Option<Self> {
        let mut circle = Self::algebraic(points)?;
        for _ in 0..STEPS {
            let (mut information, mut pull) = (Matrix3::zeros(), Vector3::zeros());
            for point in points {
                let row = circle.derivative(point);
                information += row * row.transpose();
                pull += row * circle.off(point);
            }
            let step = information.cholesky()?.solve(&-pull);
            circle.center_m += step.fixed_rows::<2>(0);
            circle.radius_m += step.z;
            if step.norm() < SMALL_STEP_M {
                break;
            }
        }
        (circle.radius_m.is_finite() && circle.radius_m > 0.0).then_some(circle)
    }

    /// The circle of least squared p² − 2 c·p − k, by linear equations \[Kasa1976\].
    fn algebraic(points: &[Vector2<f64>]) -> Option<Self> {
        let middle = points.iter().sum::<Vector2<f64>>() / points.len().max(1) as f64;
        let (mut information, mut pull) = (Matrix3::zeros(), Vector3::zeros());
        for point in points {
            let from = point - middle;
            let row = Vector3::new(2.0 * from.x, 2.0 * from.y, 1.0);
            information += row * row.transpose();
            pull += row * from.norm_squared();
        }
        let found = information.try_inverse()? * pull;
        let center = Vector2::new(found.x, found.y);
        let squared = found.z + center.norm_squared();
        (squared > 0.0).then(|| Self { center_m: middle + center, radius_m: squared.sqrt() })
    }

    /// d off / d (centre, radius).
    fn derivative(&self, point: &Vector2<f64>) -> Vector3<f64> {
        let outward = (point - self.center_m).normalize();
        Vector3::new(-outward.x, -outward.y, -1.0)
    }

    /// The angle of each point as seen from the centre, from their middle, rad, where all lie on less than a full turn.
    fn angles_rad(&self, points: &[Vector2<f64>]) -> Vec<f64> {
        let mean = points.iter().map(|p| p - self.center_m).sum::<Vector2<f64>>();
        let angle = |p: &Vector2<f64>| {
            let from = p - self.center_m;
            mean.perp(&from).atan2(mean.dot(&from))
        };
        points.iter().map(angle).collect()
    }

    /// The angle between the outermost points as seen from the centre, rad.
    #[must_use]
    pub fn extent_rad(&self, points: &[Vector2<f64>]) -> f64 {
        let all = self.angles_rad(points).into_iter();
        let (low, high) =
            all.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), a| (low.min(a), high.max(a)));
        high - low
    }

    /// The mean of neighbours, as far off the circle as they are on average.
    fn between(&self, near: &[Vector2<f64>]) -> Vector2<f64> {
        let count = near.len() as f64;
        let mean = near.iter().sum::<Vector2<f64>>() / count;
        let off_m = near.iter().map(|point| self.off(point)).sum::<f64>() / count;
        self.center_m + (mean - self.center_m).normalize() * (self.radius_m + off_m)
    }
}

/// A point of an arc.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ArcPoint {
    /// Where it is in the sheet, m.
    pub at_m: Vector2<f64>,
    /// How it follows the sensor's shape h₁ … h₅, the report being what it is.
    pub d_shape: SMatrix<f64, 2, 5>,
    /// The polynomials at it.
    pub powers: Rows,
    /// Variance of its place square to the arc, m², raised by what neighbours share.
    pub variance: f64,
    /// Its distance from the smooth arc, in standard deviations.
    off: f64,
}

/// What a profile shows of a round target.
#[derive(Clone, Debug, PartialEq)]
pub struct Cut {
    /// What was cut.
    pub target: RoundTarget,
    /// The circle of the arc; of a cylinder it is not quite the arc.
    pub circle: Circle,
    /// Points of the arc, in their order along it.
    pub points: Vec<ArcPoint>,
    /// Root mean square distance of the points from the smooth arc, m.
    pub rms_m: f64,
}

impl Cut {
    /// The cut of points in the order of their columns (sheet coordinates, m); `shape` is that of a sensor that reports what is there.
    /// The scatter of the points gives their noise. Neighbours whose noise is shared count as fewer.
    #[must_use]
    pub fn of(target: RoundTarget, points: &[Vector2<f64>], shape: &SheetShape) -> Option<Self> {
        let circle = Circle::of(points)?;
        let first = Smooth::of(target, &circle, points)?;
        let limit_m = ON_ARC * mad_sigma(&first.off_m).max(LEAST_SIGMA_M);
        let on = points.iter().zip(&first.off_m).filter(|(_, off_m)| off_m.abs() < limit_m);
        let on: Vec<Vector2<f64>> = on.map(|(point, _)| *point).collect();
        let circle = Circle::of(&on)?;
        let on: Vec<Vector2<f64>> =
            on.chunks(on.len().div_ceil(MOST_POINTS).max(1)).map(|near| circle.between(near)).collect();
        let Smooth { off_m, powers } = Smooth::of(target, &circle, &on)?;
        let squares: f64 = off_m.iter().map(|off_m| off_m * off_m).sum();
        let freedom = (on.len() - target.row().rows) as f64;
        let variance = squares / freedom * lasting(&off_m, |a, b| a * b) + LEAST_SIGMA_M.powi(2);
        let left = |powers: &Rows| (1.0 - powers.norm_squared() / on.len() as f64).max(LEAST_LEFT);
        let scatter_m = (squares / freedom).sqrt().max(LEAST_SIGMA_M);
        let all = on.iter().zip(off_m.iter().zip(powers)).map(|(at_m, (off_m, powers))| {
            let off = off_m / (left(&powers).sqrt() * scatter_m);
            Some(ArcPoint { at_m: *at_m, d_shape: shape.d_corrected_d_shape(at_m)?, powers, variance, off })
        });
        let points = all.collect::<Option<Vec<ArcPoint>>>()?;
        Some(Self { target, circle, rms_m: (squares / on.len() as f64).sqrt(), points })
    }

    /// Centre and radius of the circle, m.
    #[must_use]
    pub fn measured(&self) -> Vector3<f64> {
        Vector3::new(self.circle.center_m.x, self.circle.center_m.y, self.circle.radius_m)
    }

    /// The middle of the arc, m.
    #[must_use]
    pub fn middle_m(&self) -> Vector2<f64> {
        self.points.iter().map(|point| point.at_m).sum::<Vector2<f64>>() / self.points.len() as f64
    }

    /// Standard deviations, m: of a sphere's circle, its centre and its radius; of a cylinder's arc, its ends, its middle and its ends.
    #[must_use]
    pub fn sigma_m(&self) -> Vector3<f64> {
        match self.target {
            RoundTarget::Sphere => {
                let of = |point: &ArcPoint| {
                    let row = self.circle.derivative(&point.at_m);
                    row * row.transpose() / point.variance
                };
                let information: Matrix3<f64> = self.points.iter().map(of).sum();
                information
                    .try_inverse()
                    .unwrap_or_default()
                    .diagonal()
                    .map(|variance| variance.max(0.0).sqrt())
            }
            RoundTarget::Cylinder => {
                let count = self.points.len();
                let at = |k: usize| {
                    let ArcPoint { powers, variance, .. } = &self.points[k];
                    (powers.norm_squared() / count as f64 * variance).sqrt()
                };
                Vector3::new(at(0), at(count / 2), at(count - 1))
            }
        }
    }

    /// The same with so many of its points, evenly along it: enough to tell starts apart.
    #[must_use]
    pub(super) fn thinned(&self, count: usize) -> Self {
        let stride = (self.points.len() / count.max(1)).max(1);
        Self { points: self.points.iter().step_by(stride).copied().collect(), ..self.clone() }
    }
}

/// Gives each stretch of the arcs the noise that it has in most cuts of a scan. A sensor whose noise is along the range is better where the
/// surface is steep, and one whose spot smears there is worse.
pub fn share_noise(cuts: &mut [Cut]) {
    let stretch = |k: usize, count: usize| k * STRETCHES / count;
    let of = |j: usize, cut: &Cut| {
        let count = cut.points.len();
        let own = cut.points.iter().enumerate().filter(|(k, _)| stretch(*k, count) == j);
        let squares: Vec<f64> = own.map(|(_, point)| point.off * point.off).collect();
        (!squares.is_empty()).then(|| squares.iter().sum::<f64>() / squares.len() as f64)
    };
    let parts: Vec<f64> =
        (0..STRETCHES).map(|j| median(cuts.iter().filter_map(|cut| of(j, cut))).unwrap_or(1.0)).collect();
    let mean = parts.iter().sum::<f64>() / STRETCHES as f64;
    if mean <= 0.0 {
        return;
    }
    for cut in cuts {
        let count = cut.points.len();
        for (k, point) in cut.points.iter_mut().enumerate() {
            point.variance *= parts[stretch(k, count)] / mean;
        }
    }
}

/// Points beside the smooth arc through them: their circle, and a polynomial off it.
struct Smooth {
    /// Distances from it, m.
    off_m: Vec<f64>,
    /// The polynomials at each point, orthonormal over all.
    powers: Vec<Rows>,
}

impl Smooth {
    fn of(target: RoundTarget, circle: &Circle, points: &[Vector2<f64>]) -> Option<Self> {
        let rows = target.row().rows;
        if points.len() < rows + LEFT_OVER {
            return None;
        }
        let powers = polynomials(&circle.angles_rad(points), rows);
        let mut off_m: Vec<f64> = points.iter().map(|point| circle.off(point)).collect();
        let mean = |off_m: &[f64]| {
            powers.iter().zip(off_m).map(|(p, off_m)| p * *off_m).sum::<Rows>() / points.len() as f64
        };
        let part = mean(&off_m);
        off_m.iter_mut().zip(&powers).for_each(|(off_m, powers)| *off_m -= part.dot(powers));
        part.iter().all(|number| number.is_finite()).then_some(Self { off_m, powers })
    }
}

/// Polynomials of degree 0, 1, … whose products have a mean of one with themselves and of zero with others, over some places.
fn polynomials(places: &[f64], rows: usize) -> Vec<Rows> {
    let most = places.iter().fold(0.0, |most: f64, place| most.max(place.abs()));
    let mut all = vec![Rows::zeros(); places.len()];
    for k in 0..rows {
        for (row, place) in all.iter_mut().zip(places) {
            row[k] = if k == 0 { 1.0 } else { row[k - 1] * place / most };
        }
        let mean =
            |all: &[Rows], j: usize| all.iter().map(|row| row[j] * row[k]).sum::<f64>() / all.len() as f64;
        // The second time takes what was left by rounding.
        for j in (0..k).chain(0..k) {
            let part = mean(&all, j);
            all.iter_mut().for_each(|row| row[k] -= part * row[j]);
        }
        let length = mean(&all, k).sqrt();
        all.iter_mut().for_each(|row| row[k] /= length);
    }
    all
}
