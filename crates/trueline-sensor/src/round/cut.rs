//! The arc in which the sheet cuts a round target: fitted to points, with its covariance.

use super::conic::Conic;
use super::target::{ROWS, RoundTarget, Rows, Square};
use nalgebra::{Matrix3, SMatrix, Vector2, Vector3};
use trueline_geometry::statistics::{lasting, mad_sigma};
use trueline_model::SheetShape;

/// Maximum number of steps; the fit converges quadratically.
const STEPS: usize = 20;
/// The fit ends with a step below this, m.
const SMALL_STEP_M: f64 = 1e-12;
/// Least standard deviation of a circle, m: it keeps the covariance of exact points invertible.
const LEAST_SIGMA_M: f64 = 1e-9;
/// Points farther from an ellipse than this multiple of their scatter do not belong to it.
const ON_CONIC: f64 = 5.0;
/// Least number of points for a circle and its scatter.
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
    /// Distance of a point outside the circle, m.
    #[must_use]
    pub fn off(&self, point: &Vector2<f64>) -> f64 {
        (point - self.center_m).norm() - self.radius_m
    }

    /// The circle of least squared distances from points, m; `None` for points on a line.
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

    /// The angle between the outermost points as seen from the centre, rad, if all lie on less than a full turn.
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

/// The cut of a round target in a profile.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cut {
    /// The target.
    pub target: RoundTarget,
    /// The circle of the arc; for a cylinder it is an approximation.
    pub circle: Circle,
    /// Points of a cylinder's arc, m, and the outward unit normals there. Unused for a sphere.
    pub supports: [[Vector2<f64>; 2]; ROWS],
    /// Covariance, m². For a sphere: of its circle's centre (two coordinates of the sheet) and radius. For a cylinder: of its
    /// points along their normals.
    pub covariance: Square,
    /// Derivatives of these numbers by the sensor's shape h₁ … h₅, with the sensor's report fixed.
    pub d_shape: SMatrix<f64, ROWS, 5>,
    /// The middle of the arc, m.
    pub middle_m: Vector2<f64>,
    /// Number of points on it.
    pub points: usize,
    /// Root mean square distance of the points from the arc, m.
    pub rms_m: f64,
}

impl Cut {
    /// The cut from points in the order of their columns (sheet coordinates, m); `shape` corrects the sensor's report. The
    /// scatter of the points gives their noise. Neighbours with shared noise count as fewer.
    #[must_use]
    pub fn of(target: RoundTarget, points: &[Vector2<f64>], shape: &SheetShape) -> Option<Self> {
        if points.len() < FEWEST_POINTS {
            return None;
        }
        match target {
            RoundTarget::Sphere => Self::of_circle(points, shape),
            RoundTarget::Cylinder => Self::of_ellipse(points, shape),
        }
    }

    fn of_circle(points: &[Vector2<f64>], shape: &SheetShape) -> Option<Self> {
        let circle = Circle::of(points)?;
        let noise = Noise::of(points, RoundTarget::Sphere, |point| circle.off(point));
        let (mut information, mut pull) = (Matrix3::zeros(), SMatrix::<f64, 3, 5>::zeros());
        for point in points {
            let row = circle.derivative(point);
            information += row * row.transpose();
            let outward = (point - circle.center_m).normalize();
            pull += row * (outward.transpose() * shape.d_corrected_d_shape(point)?);
        }
        let inverse = information.cholesky()?.inverse();
        let (mut covariance, mut d_shape) = (Square::identity(), SMatrix::<f64, ROWS, 5>::zeros());
        let of_circle = inverse * noise.variance + Matrix3::identity() * LEAST_SIGMA_M.powi(2);
        covariance.fixed_view_mut::<3, 3>(0, 0).copy_from(&of_circle);
        d_shape.fixed_rows_mut::<3>(0).copy_from(&(-inverse * pull));
        Some(Self {
            target: RoundTarget::Sphere,
            circle,
            supports: [[Vector2::zeros(); 2]; ROWS],
            covariance,
            d_shape,
            middle_m: middle(points),
            points: points.len(),
            rms_m: noise.rms_m,
        })
    }

    fn of_ellipse(points: &[Vector2<f64>], shape: &SheetShape) -> Option<Self> {
        let conic = Conic::of(points)?;
        let off_m: Vec<f64> = points.iter().map(|point| conic.off_m(point)).collect();
        let limit_m = ON_CONIC * mad_sigma(&off_m).max(LEAST_SIGMA_M);
        let on = points.iter().zip(&off_m).filter(|(_, off_m)| off_m.abs() < limit_m);
        let points: Vec<Vector2<f64>> = on.map(|(point, _)| *point).collect();
        if points.len() < FEWEST_POINTS {
            return None;
        }
        let conic = Conic::of(&points)?;
        let noise = Noise::of(&points, RoundTarget::Cylinder, |point| conic.off_m(point));
        let found = conic.supports(&points)?;
        let mut d_shape = SMatrix::<f64, ROWS, 5>::zeros();
        for (k, [point, normal]) in found.points.iter().enumerate() {
            // The shape moves the points along with the surface there.
            d_shape.set_row(k, &(normal.transpose() * shape.d_corrected_d_shape(point)?));
        }
        Some(Self {
            target: RoundTarget::Cylinder,
            circle: Circle::of(&points)?,
            supports: found.points,
            covariance: found.covariance * noise.variance + Square::identity() * LEAST_SIGMA_M.powi(2),
            d_shape,
            middle_m: middle(&points),
            points: points.len(),
            rms_m: noise.rms_m,
        })
    }

    /// Centre and radius of the circle, m.
    #[must_use]
    pub fn measured(&self) -> Vector3<f64> {
        Vector3::new(self.circle.center_m.x, self.circle.center_m.y, self.circle.radius_m)
    }

    /// Standard deviations, m. For a sphere: of its circle's centre and radius. For a cylinder: of its arc's ends and middle.
    #[must_use]
    pub fn sigma_m(&self) -> Vector3<f64> {
        let of: Rows = self.covariance.diagonal().map(f64::sqrt);
        match self.target {
            RoundTarget::Sphere => Vector3::new(of[0], of[1], of[2]),
            RoundTarget::Cylinder => Vector3::new(of[0].max(of[4]), of[2], of[0].max(of[4])),
        }
    }
}

fn middle(points: &[Vector2<f64>]) -> Vector2<f64> {
    points.iter().sum::<Vector2<f64>>() / points.len() as f64
}

/// Scatter of points about their arc.
struct Noise {
    /// Variance of a point, m², increased by the noise that neighbours share.
    variance: f64,
    rms_m: f64,
}

impl Noise {
    fn of(points: &[Vector2<f64>], target: RoundTarget, off_m: impl Fn(&Vector2<f64>) -> f64) -> Self {
        let off: Vec<f64> = points.iter().map(off_m).collect();
        let squares: f64 = off.iter().map(|off| off * off).sum();
        let freedom = (points.len() - target.row().rows) as f64;
        Self {
            variance: squares / freedom * lasting(&off, |a, b| a * b),
            rms_m: (squares / points.len() as f64).sqrt(),
        }
    }
}
