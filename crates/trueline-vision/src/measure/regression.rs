//! Robust straight-line regression of shifts along a segment.

use crate::fastest::fastest;
use nalgebra::{Matrix2, Vector2};

/// Residuals beyond this many standard deviations do not count at all (Tukey's biweight).
const BLIND: f64 = 5.0;
/// The spread of a normal distribution from the median of its absolute values.
const PER_MEDIAN: f64 = 1.4826;
/// Shifts from which a scale is taken at most.
const SAMPLED: usize = 300;
/// A line has converged if it moves by less than this part of the spread: a hundredth of the uncertainty from a thousand
/// shifts, ...
const SETTLED: f64 = 3e-4;
/// ... and one for a start value if it moves by less than this.
const ROUGHLY_SETTLED: f64 = 1e-2;
/// The spread about a line stays that about one beside it by this part of the spread: larger by 5 % at most.
const SAME_SPREAD: f64 = 0.3;
/// Fewest independent shifts for an estimate of the variance.
const FEWEST_INDEPENDENT: f64 = 3.0;
/// A line with this multiple of the variance of lines like it is not chance (χ² of eight over eight exceeds 3 once in 400).
pub(crate) const OWN_NOISE: f64 = 3.0;
/// Number of lags for the correlation.
const LAGS: usize = 32;

/// One shift.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Shift {
    /// Distance along the line, px.
    pub s: f64,
    /// Shift square to the line, px.
    pub shift_px: f64,
    /// Weight; zero without a stripe.
    pub weight: f64,
    /// By how much this shift changes, on average, if the stripe moves by one px: a dark grain of speckle has less information than a
    /// bright one.
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
    /// Inverse of the covariance for independent shifts with a variance of one.
    pub information: Matrix2<f64>,
    /// Standard deviation of one shift, px.
    pub sigma_px: f64,
    /// Shifts that count, by weight.
    pub count: f64,
}

impl Regression {
    /// How many shifts are worth one: neighbours share their speckle.
    #[must_use]
    pub(crate) fn shared(&self) -> f64 {
        (self.covariance.m11 * self.count / (self.sigma_px * self.sigma_px)).max(1.0)
    }

    /// Lᵀ C L with the covariance C and the information A = L Lᵀ: the variance of a shift, and how it differs along the line, without
    /// how many shifts there are and where.
    pub(crate) fn noise(&self) -> Option<Matrix2<f64>> {
        let factor = self.information.cholesky()?.l();
        Some(factor.transpose() * self.covariance * factor)
    }

    /// The same line with another noise.
    pub(crate) fn with_noise(mut self, noise: &Matrix2<f64>) -> Self {
        if let Some(inverse) = self.information.cholesky().and_then(|factor| factor.l().try_inverse()) {
            self.covariance = inverse.transpose() * noise * inverse;
        }
        self
    }

    /// The same with the noise of a line through more shifts of the same stripe: a few that share their speckle do not
    /// determine it. If they scatter clearly more than that, they keep their own.
    pub(crate) fn with_noise_of(self, more: &Self) -> Self {
        match (self.noise(), more.noise()) {
            (Some(own), Some(noise)) if own.trace() <= OWN_NOISE * noise.trace() => self.with_noise(&noise),
            _ => self,
        }
    }

    /// The same with the noise of a line through more shifts if that is larger, as far as chance explains it: the longer
    /// line may be bent.
    pub(crate) fn at_least_noise_of(self, more: &Self) -> Self {
        let [own, noise] = [self, *more].map(|line| line.noise().map_or(0.0, |noise| noise.trace()));
        let factor = if own > 0.0 { (noise / own).clamp(1.0, OWN_NOISE) } else { 1.0 };
        Self { covariance: self.covariance * factor, ..self }
    }

    /// Shift at a distance along the line, px.
    #[must_use]
    pub(crate) fn shift_at(&self, s: f64) -> f64 {
        self.shift_px + self.slope * (s - self.centre)
    }

    /// Its variance, px².
    #[must_use]
    pub(crate) fn variance_at(&self, s: f64) -> f64 {
        let (c, from) = (&self.covariance, s - self.centre);
        c.m11 + 2.0 * c.m12 * from + c.m22 * from * from
    }
}

/// The line alone of a robust regression, and the scatter of the shifts about it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct RobustLine {
    /// Distance along the line about which the regression is done, px.
    pub(crate) centre: f64,
    /// Shift there, px.
    pub(crate) shift_px: f64,
    /// Slope, px per px.
    pub(crate) slope: f64,
    /// Standard deviation of one shift by the median, px.
    scale_px: f64,
}

impl RobustLine {
    /// Shift at a distance along the line, px.
    pub(crate) fn shift_at(&self, s: f64) -> f64 {
        self.shift_px + self.slope * (s - self.centre)
    }
}

/// Fits robustly; memory is kept from one fit to the next.
#[derive(Clone, Debug, Default)]
pub struct Regressor {
    /// The shifts that count, field by field: distance from the centre, shift, response.
    along: Vec<f64>,
    shifts: Vec<f64>,
    responses: Vec<f64>,
    residuals: Vec<f64>,
    sorted: Vec<f64>,
}

impl Regressor {
    /// The line through shifts; `None` with fewer than eight of them, all at one place, or a result of NaN.
    pub fn fit(&mut self, shifts: &[Shift]) -> Option<Regression> {
        let centre = self.take(shifts)?;
        // First the spread about the median; the spread about the following line is as good as the last one's.
        let level = Vector2::new(self.middle_shift(), 0.0);
        let line = self.settle(centre, level, [SETTLED, 0.0])?;
        self.regression(shifts, &line)
    }

    /// The same from a line on that is nearly it: one through nearly the same shifts.
    pub(crate) fn fit_near(&mut self, shifts: &[Shift], near: &RobustLine) -> Option<Regression> {
        let centre = self.take(shifts)?;
        let near = Vector2::new(near.shift_at(centre), near.slope);
        let line = self.settle(centre, near, [SETTLED, SAME_SPREAD])?;
        self.regression(shifts, &line)
    }

    /// The line alone through shifts about an approximate line, to a hundredth of the scatter of one of them.
    pub(crate) fn rough_line(&mut self, shifts: &[Shift]) -> Option<RobustLine> {
        let centre = self.take(shifts)?;
        self.settle(centre, Vector2::zeros(), [ROUGHLY_SETTLED, SAME_SPREAD])
    }

    /// Takes in the shifts that count; their mean distance along the line.
    fn take(&mut self, shifts: &[Shift]) -> Option<f64> {
        for values in [&mut self.along, &mut self.shifts, &mut self.responses] {
            values.resize(shifts.len(), 0.0);
        }
        let mut count = 0;
        // One that does not count is written over by the next: no branch.
        for shift in shifts {
            self.along[count] = shift.s;
            self.shifts[count] = shift.shift_px;
            self.responses[count] = shift.response;
            count += usize::from(shift.weight > 0.0);
        }
        for values in [&mut self.along, &mut self.shifts, &mut self.responses] {
            values.truncate(count);
        }
        if count < 8 {
            return None;
        }
        let centre = self.along.iter().sum::<f64>() / count as f64;
        self.along.iter_mut().for_each(|s| *s -= centre);
        Some(centre)
    }

    /// The line of the last shifts, with its noise from them.
    fn regression(&mut self, shifts: &[Shift], line: &RobustLine) -> Option<Regression> {
        let RobustLine { centre, shift_px, slope, scale_px: sigma } = *line;
        self.residuals.clear();
        self.residuals.extend(
            shifts
                .iter()
                .map(|shift| shift.shift_px - shift.response * (shift_px + slope * (shift.s - centre))),
        );
        let (bread, filling) = self.sandwich(shifts, sigma, centre);
        let (information, bread) = (bread, bread.try_inverse()?);
        let weights = self.sums(Vector2::new(shift_px, slope), sigma)[5];
        let shared = self.correlation(shifts, sigma);
        let covariance = bread * filling * bread * (shared * line_taken_out(weights / shared));
        let sigma_px = self.spread(line);
        Some(Regression { centre, shift_px, slope, covariance, information, sigma_px, count: weights })
    }

    /// Root mean square of the last counting shifts about their line: the scatter of a single shift.
    pub(crate) fn spread(&self, line: &RobustLine) -> f64 {
        let [squares, count] = fastest!(squares_within(
            [&self.along, &self.shifts, &self.responses],
            [line.shift_px, line.slope],
            BLIND * line.scale_px
        ));
        (squares / f64::max(count, 1.0)).sqrt()
    }

    /// Iterates from a line (shift, slope) until it moves by less than a part of the spread. The spread is taken again if
    /// the first step moves the line by more than another part.
    fn settle(
        &mut self,
        centre: f64,
        mut at: Vector2<f64>,
        [settled, same_spread]: [f64; 2],
    ) -> Option<RobustLine> {
        let mut sigma = self.scale(at);
        for step in 0..6 {
            let [one, x, xx, right, right_x, _] = self.sums(at, sigma);
            let next = Matrix2::new(one, x, x, xx).try_inverse()? * Vector2::new(right, right_x);
            if !next.iter().all(|x| x.is_finite()) {
                return None;
            }
            let moved = next - at;
            at = next;
            if step == 0 && moved.x * moved.x + moved.y * moved.y * xx / one > (same_spread * sigma).powi(2) {
                sigma = self.scale(at);
            } else if moved.x.abs() < settled * sigma {
                break;
            }
        }
        Some(RobustLine { centre, shift_px: at.x, slope: at.y, scale_px: sigma })
    }

    /// The median of the shifts.
    fn middle_shift(&mut self) -> f64 {
        let every = every(self.shifts.len());
        self.sorted.clear();
        self.sorted.extend(self.shifts.chunks(every).map(|shifts| shifts[0]));
        median(&mut self.sorted)
    }

    /// Scatter of the shifts about a line, by their median distance from it.
    fn scale(&mut self, at: Vector2<f64>) -> f64 {
        let every = every(self.shifts.len());
        let values =
            self.along.chunks(every).zip(self.shifts.chunks(every)).zip(self.responses.chunks(every));
        let distance = |((x, shift), response): ((&[f64], &[f64]), &[f64])| {
            (shift[0] - response[0] * (at.x + at.y * x[0])).abs()
        };
        self.sorted.clear();
        self.sorted.extend(values.map(distance));
        (PER_MEDIAN * median(&mut self.sorted)).max(1e-6)
    }

    /// Σ wρ, Σ wρx, Σ wρx², Σ we, Σ wxe and Σ w with the biweight about a line.
    fn sums(&self, at: Vector2<f64>, sigma: f64) -> [f64; 6] {
        fastest!(weighted_sums(
            [&self.along, &self.shifts, &self.responses],
            [at.x, at.y],
            1.0 / (BLIND * sigma)
        ))
    }

    /// Σ ψ′ ρ x xᵀ, with the response ρ, and Σ ψ² x xᵀ: the covariance of an M-estimate is A⁻¹ B A⁻¹ \[Huber1964\], for any
    /// distribution of the shifts.
    fn sandwich(&self, shifts: &[Shift], sigma: f64, centre: f64) -> (Matrix2<f64>, Matrix2<f64>) {
        // Of symmetric matrices three sums each.
        let (mut bread, mut filling) = ([0.0; 3], [0.0; 3]);
        let scale = 1.0 / (BLIND * sigma);
        for (shift, residual) in shifts.iter().zip(&self.residuals) {
            let part2 = (residual * scale) * (residual * scale);
            if part2 >= 1.0 || shift.weight == 0.0 {
                continue;
            }
            let (x, inside) = (shift.s - centre, 1.0 - part2);
            let slope = shift.weight * shift.response * inside * (1.0 - 5.0 * part2);
            let psi = shift.weight * residual * inside * inside;
            for ((bread, filling), power) in bread.iter_mut().zip(&mut filling).zip([1.0, x, x * x]) {
                *bread += slope * power;
                *filling += psi * psi * power;
            }
        }
        let [bread, filling] = [bread, filling].map(|[one, x, xx]| Matrix2::new(one, x, x, xx));
        (bread, filling)
    }

    /// 1 + 2 Σ ρ_k: how much more a mean varies than if neighbours were independent \[Bartlett1946\].
    fn correlation(&mut self, shifts: &[Shift], sigma: f64) -> f64 {
        self.sorted.clear();
        self.sorted.extend(shifts.iter().zip(&self.residuals).map(|(shift, residual)| {
            if shift.weight > 0.0 { residual * biweight(residual / sigma) } else { 0.0 }
        }));
        let psi = &self.sorted;
        let at_lag = |lag: usize| fastest!(sum_of_products(psi, &psi[lag..]));
        let none = at_lag(0);
        let mut sum = 1.0;
        for lag in 1..LAGS.min(shifts.len() / 4) {
            let rho = at_lag(lag) / none.max(1e-30);
            // Smaller values are the noise of the estimate: 2 / √n at 1000 shifts.
            if rho < 0.05 {
                break;
            }
            sum += 2.0 * rho;
        }
        sum
    }
}

/// Ratio of a variance to that of the residuals about a line through a number of independent shifts: the line has taken up
/// two of them.
fn line_taken_out(independent: f64) -> f64 {
    let independent = independent.max(FEWEST_INDEPENDENT);
    independent / (independent - 2.0)
}

/// Medians use at most a few hundred shifts, spread evenly. This gives 5 % or so, sufficient for a scale.
fn every(count: usize) -> usize {
    count.div_ceil(SAMPLED)
}

/// Lanes that one instruction adds at once.
const LANES: usize = 4;

/// N sums over the shifts of a function of their place along the line, their shift and their response, in lanes.
#[inline(always)]
fn sums_in_lanes<const N: usize>(
    [along, shifts, responses]: [&[f64]; 3],
    terms: impl Fn(f64, f64, f64) -> [f64; N],
) -> [f64; N] {
    let mut lanes = [[0.0_f64; LANES]; N];
    let add = |lanes: &mut [[f64; LANES]; N], lane: usize, terms: [f64; N]| {
        for (sum, term) in lanes.iter_mut().zip(terms) {
            sum[lane] += term;
        }
    };
    let whole = along.len() / LANES * LANES;
    let fours = along[..whole].chunks_exact(LANES).zip(shifts[..whole].chunks_exact(LANES));
    for ((x, shift), response) in fours.zip(responses[..whole].chunks_exact(LANES)) {
        for lane in 0..LANES {
            add(&mut lanes, lane, terms(x[lane], shift[lane], response[lane]));
        }
    }
    for k in whole..along.len() {
        add(&mut lanes, k - whole, terms(along[k], shifts[k], responses[k]));
    }
    lanes.map(|lane| lane.iter().sum())
}

/// Σ wρ, Σ wρx, Σ wρx², Σ we, Σ wxe and Σ w with the biweight about a line.
#[inline(always)]
fn weighted_sums(rows: [&[f64]; 3], [at, slope]: [f64; 2], scale: f64) -> [f64; 6] {
    sums_in_lanes(rows, |x, shift, response| {
        let off = (shift - response * (at + slope * x)) * scale;
        let inside = (1.0 - off * off).max(0.0);
        let weight = inside * inside;
        let answering = weight * response;
        [answering, answering * x, answering * x * x, weight * shift, weight * shift * x, weight]
    })
}

/// The sum of the squares of the residuals within a limit about a line, and their number.
#[inline(always)]
fn squares_within(rows: [&[f64]; 3], [at, slope]: [f64; 2], limit: f64) -> [f64; 2] {
    sums_in_lanes(rows, |x, shift, response| {
        let off = shift - response * (at + slope * x);
        let counts = f64::from(u8::from(off.abs() < limit));
        [counts * off * off, counts]
    })
}

/// Σ ab of two rows as far as the shorter reaches, in lanes.
#[inline(always)]
fn sum_of_products(a: &[f64], b: &[f64]) -> f64 {
    const LANES: usize = 8;
    let count = a.len().min(b.len());
    let (a, b) = (&a[..count], &b[..count]);
    let mut lanes = [0.0_f64; LANES];
    let rest = count / LANES * LANES;
    for (a, b) in a[..rest].chunks_exact(LANES).zip(b[..rest].chunks_exact(LANES)) {
        for k in 0..LANES {
            lanes[k] += a[k] * b[k];
        }
    }
    lanes.iter().sum::<f64>() + a[rest..].iter().zip(&b[rest..]).map(|(a, b)| a * b).sum::<f64>()
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
