//! The ellipse in which the sheet cuts a cylinder: fitted to an arc, and represented by five points of it with their covariance.
//!
//! About the circle of the arc, with u the distance from its centre in radii, the conic is
//!
//! ```text
//! g(u) = u·u − 1 + α (u₁² − u₂²) + 2 β u₁ u₂ + γ u₁ + δ u₂ + ε = 0
//! ```
//!
//! and the distance of a point from it is g/|∇g| \[Sampson1982\]. A short arc hardly determines the five coefficients, but it
//! determines its own course. The five points represent this course, whatever the ellipse.

use super::cut::Circle;
use super::target::{ROWS, Rows, Square};
use nalgebra::{SMatrix, Vector2};

/// Steps of the fit.
const STEPS: usize = 12;
/// The fit ends with a step below this.
const SMALL_STEP: f64 = 1e-11;
/// Prior size of the five coefficients: an ellipse cut at 45° has α = 1/3.
const USUAL: f64 = 0.3;
/// Scatter below which an arc is exact, in radii.
const EXACT: f64 = 1e-10;
/// Places of the points between the ends of the arc, −1 to 1: Chebyshev nodes, which determine the five coefficients best.
const PLACES: [f64; ROWS] = [-0.951_057, -0.587_785, 0.0, 0.587_785, 0.951_057];

/// A conic near a circle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Conic {
    circle: Circle,
    numbers: Rows,
}

/// Five points of an arc, with their covariance.
#[derive(Clone, Copy, Debug)]
pub(super) struct Supports {
    /// The points, m, and the unit normals there, outward.
    pub points: [[Vector2<f64>; 2]; ROWS],
    /// Covariance of the points along their normals, in units of the variance of a point of the arc.
    pub covariance: Square,
}

impl Conic {
    /// The conic of least squared distances from points; `None` if they are not an arc.
    pub(super) fn of(points: &[Vector2<f64>]) -> Option<Self> {
        let circle = Circle::of(points)?;
        let mut conic = Self { circle, numbers: Rows::zeros() };
        let mut variance = conic.variance(points);
        for _ in 0..STEPS {
            let (information, pull) = conic.normal_equations(points);
            let beforehand = Square::identity() * (variance / (USUAL * USUAL));
            let pull = pull + conic.numbers * (variance / (USUAL * USUAL));
            let step = (information + beforehand).cholesky()?.solve(&-pull);
            conic.numbers += step;
            if !conic.is_ellipse() {
                return None;
            }
            variance = conic.variance(points);
            if step.norm() < SMALL_STEP {
                break;
            }
        }
        Some(conic)
    }

    /// Distance of a point outside the conic, m.
    pub(super) fn off_m(&self, point: &Vector2<f64>) -> f64 {
        let (value, slope) = self.value(&self.scaled(point));
        value / slope.norm() * self.circle.radius_m
    }

    /// Five points of the arc. The last step has no prior: the prior only led to the point of linearisation.
    pub(super) fn supports(&self, points: &[Vector2<f64>]) -> Option<Supports> {
        let (information, pull) = self.normal_equations(points);
        let inverse = information.cholesky()?.inverse();
        let step = -inverse * pull;
        let angle = |p: &Vector2<f64>| self.angle(p, points);
        let (low, high) = points
            .iter()
            .map(angle)
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), a| (low.min(a), high.max(a)));
        let middle = self.middle(points);
        let mut supports = [[Vector2::zeros(); 2]; ROWS];
        let mut follows = Square::zeros();
        for (k, place) in PLACES.into_iter().enumerate() {
            let around = 0.5 * (low + high) + 0.5 * (high - low) * place;
            let ray = nalgebra::Rotation2::new(around) * middle;
            let u = ray * self.reach(&ray)?;
            let (_, slope) = self.value(&u);
            let normal = slope.normalize();
            let row = -powers(&u) / slope.norm();
            let at = self.circle.center_m + (u + normal * row.dot(&step)) * self.circle.radius_m;
            supports[k] = [at, normal];
            follows.set_row(k, &row.transpose());
        }
        Some(Supports { points: supports, covariance: follows * inverse * follows.transpose() })
    }

    fn is_ellipse(&self) -> bool {
        let (alpha, beta) = (self.numbers[0], self.numbers[1]);
        alpha.hypot(beta) < 1.0
    }

    fn scaled(&self, point: &Vector2<f64>) -> Vector2<f64> {
        (point - self.circle.center_m) / self.circle.radius_m
    }

    /// Direction from the circle's centre to the middle of the arc.
    fn middle(&self, points: &[Vector2<f64>]) -> Vector2<f64> {
        points.iter().map(|p| p - self.circle.center_m).sum::<Vector2<f64>>().normalize()
    }

    fn angle(&self, point: &Vector2<f64>, points: &[Vector2<f64>]) -> f64 {
        let (middle, from) = (self.middle(points), point - self.circle.center_m);
        middle.perp(&from).atan2(middle.dot(&from))
    }

    /// g and its gradient.
    fn value(&self, u: &Vector2<f64>) -> (f64, Vector2<f64>) {
        let [alpha, beta, gamma, delta, _]: [f64; ROWS] = self.numbers.into();
        let value = u.norm_squared() - 1.0 + self.numbers.dot(&powers(u));
        let slope = Vector2::new(
            2.0 * (u.x + alpha * u.x + beta * u.y) + gamma,
            2.0 * (u.y - alpha * u.y + beta * u.x) + delta,
        );
        (value, slope)
    }

    /// Where a ray from the circle's centre meets the conic.
    fn reach(&self, ray: &Vector2<f64>) -> Option<f64> {
        let of = powers(ray);
        let [alpha, beta, gamma, delta, epsilon]: [f64; ROWS] = self.numbers.into();
        let a = 1.0 + alpha * of[0] + beta * of[1];
        let (b, c) = (gamma * of[2] + delta * of[3], epsilon - 1.0);
        let root = b * b - 4.0 * a * c;
        (root > 0.0 && a > 0.0).then(|| (root.sqrt() - b) / (2.0 * a))
    }

    /// Normal equations of distances in radii.
    fn normal_equations(&self, points: &[Vector2<f64>]) -> (Square, Rows) {
        let (mut information, mut pull) = (Square::zeros(), Rows::zeros());
        for point in points {
            let u = self.scaled(point);
            let (value, slope) = self.value(&u);
            let length = slope.norm();
            // d (g/|∇g|) = dg/|∇g| − g ∇g·d∇g/|∇g|³.
            let turns = slopes(&u).transpose() * slope;
            let row = powers(&u) / length - turns * (value / length.powi(3));
            information += row * row.transpose();
            pull += row * (value / length);
        }
        (information, pull)
    }

    /// Variance of a point about the conic, in radii squared.
    fn variance(&self, points: &[Vector2<f64>]) -> f64 {
        let squares: f64 = points.iter().map(|p| (self.off_m(p) / self.circle.radius_m).powi(2)).sum();
        (squares / points.len().saturating_sub(ROWS).max(1) as f64).max(EXACT * EXACT)
    }
}

/// dg / d (α, β, γ, δ, ε).
fn powers(u: &Vector2<f64>) -> Rows {
    Rows::from([u.x * u.x - u.y * u.y, 2.0 * u.x * u.y, u.x, u.y, 1.0])
}

/// d ∇g / d (α, β, γ, δ, ε).
fn slopes(u: &Vector2<f64>) -> SMatrix<f64, 2, ROWS> {
    SMatrix::<f64, 2, ROWS>::from_row_slice(&[
        2.0 * u.x,
        2.0 * u.y,
        1.0,
        0.0,
        0.0,
        -2.0 * u.y,
        2.0 * u.x,
        0.0,
        1.0,
        0.0,
    ])
}
