//! The circle in which the sheet cuts a sphere: fitted to points, with its covariance.

use nalgebra::{Matrix3, SMatrix, Vector2, Vector3};
use trueline_geometry::statistics::lasting;
use trueline_model::SheetShape;

/// Steps of the fit; each gains digits as Newton's do.
const STEPS: usize = 20;
/// The fit ends with a step below this, m.
const SMALL_STEP_M: f64 = 1e-12;
/// A circle is never known better than this, m: it keeps the covariance of exact points invertible.
const LEAST_SIGMA_M: f64 = 1e-9;
/// Points that a circle and its scatter need.
pub const FEWEST_POINTS: usize = 8;

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

    /// The angle between the outermost points as seen from the centre, rad, where all lie on less than a full turn.
    #[must_use]
    pub fn extent_rad(&self, points: &[Vector2<f64>]) -> f64 {
        let mean = points.iter().map(|p| p - self.center_m).sum::<Vector2<f64>>();
        let angle = |p: &Vector2<f64>| {
            let from = p - self.center_m;
            mean.perp(&from).atan2(mean.dot(&from))
        };
        let (low, high) = points
            .iter()
            .map(angle)
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), a| (low.min(a), high.max(a)));
        high - low
    }
}

/// What a profile shows of a sphere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cut {
    /// The circle.
    pub circle: Circle,
    /// Covariance of its centre (two coordinates of the sheet) and its radius, m².
    pub covariance: Matrix3<f64>,
    /// How centre and radius follow the sensor's shape h₁ … h₅, the report being what it is.
    pub d_shape: SMatrix<f64, 3, 5>,
    /// Points on it.
    pub points: usize,
    /// Root mean square distance of the points from the circle, m.
    pub rms_m: f64,
}

impl Cut {
    /// The cut of points in the order of their columns (sheet coordinates, m); `shape` is that of a sensor that reports what is there.
    /// The scatter of the points gives their noise. Neighbours whose noise is shared count as fewer.
    #[must_use]
    pub fn of(points: &[Vector2<f64>], shape: &SheetShape) -> Option<Self> {
        if points.len() < FEWEST_POINTS {
            return None;
        }
        let circle = Circle::of(points)?;
        let off: Vec<f64> = points.iter().map(|point| circle.off(point)).collect();
        let squares: f64 = off.iter().map(|off| off * off).sum();
        let variance = squares / (points.len() - 3) as f64 * lasting(&off, |a, b| a * b);
        let (mut information, mut pull) = (Matrix3::zeros(), SMatrix::<f64, 3, 5>::zeros());
        for point in points {
            let row = circle.derivative(point);
            information += row * row.transpose();
            let outward = (point - circle.center_m).normalize();
            pull += row * (outward.transpose() * shape.d_corrected_d_shape(point)?);
        }
        let inverse = information.cholesky()?.inverse();
        Some(Self {
            circle,
            covariance: inverse * variance + Matrix3::identity() * LEAST_SIGMA_M.powi(2),
            d_shape: -inverse * pull,
            points: points.len(),
            rms_m: (squares / points.len() as f64).sqrt(),
        })
    }

    /// Centre and radius, m.
    #[must_use]
    pub fn measured(&self) -> Vector3<f64> {
        Vector3::new(self.circle.center_m.x, self.circle.center_m.y, self.circle.radius_m)
    }

    /// Standard deviations of centre and radius, m.
    #[must_use]
    pub fn sigma_m(&self) -> Vector3<f64> {
        self.covariance.diagonal().map(f64::sqrt)
    }
}
