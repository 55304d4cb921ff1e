//! Robust straight-line regression of shifts along a piece.

use nalgebra::{Matrix2, Vector2};

/// Residuals beyond this many standard deviations do not count at all (Tukey's biweight).
const BLIND: f64 = 5.0;
/// The spread of a normal distribution from the median of its absolute values.
const PER_MEDIAN: f64 = 1.4826;
/// Neighbours whose correlation is looked at.
const LAGS: usize = 32;

/// One shift.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Shift {
    /// Distance along the line, px.
    pub s: f64,
    /// Shift square to the line, px.
    pub shift_px: f64,
    /// Weight; zero where there is no stripe.
    pub weight: f64,
    /// By how much this shift changes, on average, if the stripe moves by one px: a dark grain of speckle
    /// tells less than a bright one.
    pub response: f64,
}

/// A line through shifts: `shift + slope · (s − centre)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Regression {
    /// Distance along the line about which the regression is done, px.
    pub centre: f64,
    /// Shift there, px.
    pub shift_px: f64,
    /// Slope, px per px.
    pub slope: f64,
    /// Covariance of (shift, slope), with the correlation of neighbours.
    pub covariance: Matrix2<f64>,
    /// Standard deviation of one shift, px.
    pub sigma_px: f64,
    /// Shifts that count, by weight.
    pub count: f64,
}

impl Regression {
    /// Shift at a distance along the line, px.
    #[must_use]
    pub fn shift_at(&self, s: f64) -> f64 {
        self.shift_px + self.slope * (s - self.centre)
    }

    /// Its variance, px².
    #[must_use]
    pub fn variance_at(&self, s: f64) -> f64 {
        let (c, from) = (&self.covariance, s - self.centre);
        c.m11 + 2.0 * c.m12 * from + c.m22 * from * from
    }
}

/// Fits robustly; memory is kept from one fit to the next.
#[derive(Clone, Debug, Default)]
pub struct Regressor {
    residuals: Vec<f64>,
    sorted: Vec<f64>,
}

impl Regressor {
    /// The line through shifts; `None` with fewer than eight of them, or all at one place.
    pub fn fit(&mut self, shifts: &[Shift]) -> Option<Regression> {
        let used = shifts.iter().filter(|shift| shift.weight > 0.0);
        let total: f64 = used.clone().map(|shift| shift.weight).sum();
        if used.clone().count() < 8 {
            return None;
        }
        let centre = used.clone().map(|shift| shift.weight * shift.s).sum::<f64>() / total;
        let (mut at, mut sigma) = (Vector2::new(self.median(used.map(|shift| shift.shift_px)), 0.0), 0.0);
        let mut information = Matrix2::zeros();
        for step in 0..6 {
            self.residuals.clear();
            let residual =
                |shift: &Shift| shift.shift_px - shift.response * (at.x + at.y * (shift.s - centre));
            self.residuals.extend(shifts.iter().map(residual));
            if step < 2 {
                // The median of the first line; the second one's spread is as good as the last one's.
                let used = shifts.iter().zip(&self.residuals).filter(|(shift, _)| shift.weight > 0.0);
                self.sorted.clear();
                self.sorted.extend(used.map(|(_, residual)| residual.abs()));
                sigma = (PER_MEDIAN * median(&mut self.sorted)).max(1e-6);
            }
            let mut right = Vector2::zeros();
            information = Matrix2::zeros();
            for (shift, residual) in shifts.iter().zip(&self.residuals) {
                let weight = shift.weight * biweight(residual / sigma);
                let row = Vector2::new(1.0, shift.s - centre);
                information += row * row.transpose() * (weight * shift.response);
                right += row * (weight * shift.shift_px);
            }
            let next = information.try_inverse()? * right;
            if !next.iter().all(|x| x.is_finite()) {
                return None;
            }
            // A hundredth of what a thousand shifts leave uncertain.
            let settled = step > 0 && (next.x - at.x).abs() < 3e-4 * sigma;
            at = next;
            if settled {
                break;
            }
        }
        let (bread, filling) = self.sandwich(shifts, sigma, centre);
        let bread = bread.try_inverse()?;
        let covariance = bread * filling * bread * self.correlation(shifts, sigma);
        let count = information.m11;
        let sigma_px = (filling.m11 / count).sqrt();
        Some(Regression { centre, shift_px: at.x, slope: at.y, covariance, sigma_px, count })
    }

    /// Σ ψ′ ρ x xᵀ, with the response ρ, and Σ ψ² x xᵀ: the covariance of an M-estimate is A⁻¹ B A⁻¹ \[Huber1964\], whatever the
    /// distribution of the shifts.
    fn sandwich(&self, shifts: &[Shift], sigma: f64, centre: f64) -> (Matrix2<f64>, Matrix2<f64>) {
        let (mut bread, mut filling) = (Matrix2::zeros(), Matrix2::zeros());
        for (shift, residual) in shifts.iter().zip(&self.residuals) {
            let part2 = (residual / (BLIND * sigma)).powi(2);
            if part2 >= 1.0 || shift.weight == 0.0 {
                continue;
            }
            let row = Vector2::new(1.0, shift.s - centre);
            let outer = row * row.transpose();
            bread += outer * (shift.weight * shift.response * (1.0 - part2) * (1.0 - 5.0 * part2));
            filling += outer * (shift.weight * residual * (1.0 - part2).powi(2)).powi(2);
        }
        (bread, filling)
    }

    fn median(&mut self, values: impl Iterator<Item = f64>) -> f64 {
        self.sorted.clear();
        self.sorted.extend(values);
        median(&mut self.sorted)
    }

    /// 1 + 2 Σ ρ_k: how much more a mean varies than if neighbours were independent \[Bartlett1946\].
    fn correlation(&mut self, shifts: &[Shift], sigma: f64) -> f64 {
        self.sorted.clear();
        self.sorted.extend(shifts.iter().zip(&self.residuals).map(|(shift, residual)| {
            if shift.weight > 0.0 { residual * biweight(residual / sigma) } else { 0.0 }
        }));
        let psi = &self.sorted;
        let at_lag = |lag: usize| -> f64 { psi.iter().zip(&psi[lag..]).map(|(a, b)| a * b).sum() };
        let none = at_lag(0);
        let mut sum = 1.0;
        for lag in 1..LAGS.min(shifts.len() / 4) {
            let rho = at_lag(lag) / none.max(1e-30);
            // What is smaller is the noise of the estimate: 2 / √n at 1000 shifts.
            if rho < 0.05 {
                break;
            }
            sum += 2.0 * rho;
        }
        sum
    }
}

fn biweight(sigmas: f64) -> f64 {
    let part = sigmas / BLIND;
    if part.abs() >= 1.0 { 0.0 } else { (1.0 - part * part).powi(2) }
}

/// The median; reorders the values. Zero of none.
pub fn median(values: &mut [f64]) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let half = values.len() / 2;
    *values.select_nth_unstable_by(half, f64::total_cmp).1
}
