//! The end of a stripe at a nearly known place, by generalized least squares: the correlation of neighbouring pixels'
//! speckle is included.
//!
//! A lens that blurs the plate's edge by w blurs the grains of speckle as well. So the light of neighbours is correlated,
//! and grains before the edge have an effect beyond it. With grains that are small against the blur the light at x and y has
//! the covariance
//!
//! ```text
//! c² A² exp(−(x − y)² / (2ℓ²)) Q(((x + y) / 2 − e) / (ℓ / 2)),   ℓ² = 2w²,
//! ```
//!
//! where e is the edge, A the plate's light, c its contrast and Q the part of a normal distribution that lies beyond.
//! Weighed by its inverse the place is within a tenth of the Cramér–Rao bound for an unknown blur. Light that is treated as
//! independent gives twice that.

use crate::measure::end_light::{BANDS, BandSection, Edge};
use nalgebra::{Matrix3, SMatrix, SymmetricEigen, Vector3};
use std::ops::Range;

/// Places along the edge at which the light is taken, and how many of them a blur holds.
const PLACES: usize = 20;
const PER_BLUR: f64 = 2.0;
/// The fewest of them on each side of the edge.
const FEWEST: usize = 4;
/// Largest number of Gauss–Newton steps; factors of each step, with and without a turn back; limit of convergence, as
/// a part of the standard deviation.
const MOST_STEPS: usize = 14;
const SHORTER: f64 = 0.5;
const LONGER: f64 = 1.5;
const SETTLED: f64 = 0.1;
/// Prior of the slant, px along for each px across; and of the blur, as a part of it.
const SLANT: f64 = 0.8;
const MOST_SLANT: f64 = 2.0;
const BLUR: f64 = 0.7;
/// Prior of other light than the stripe's, as parts of the plate's: the same all along, and from place to place.
const STRAY: f64 = 0.02;
const UNEVEN: f64 = 0.004;
/// How well the light along the plate predicts that at its end, as a part of it, besides speckle.
const FADES: f64 = 0.05;
/// A grain is as long as the blur makes it, or by at most this factor longer or shorter than is measured.
const GRAIN: f64 = 1.6;
/// Part of their speckle that neighbouring bands do not share.
const OWN: f64 = 0.005;
/// The least of (σ₀ / σ)², σ₀ the stripe's thickness before the lens.
const NARROWEST: f64 = 0.2;
/// Largest squared contrast of speckle in a band. Weighted least squares need only means and covariances, whatever the
/// distribution, but grains with little blur are sharper than the covariance above.
const MOST_CONTRAST2: f64 = 0.4;
/// Squares of residuals over their expectation beyond which they are not chance: there is another object.
const MISFIT: f64 = 6.0;
/// An edge that is so far from the first one, in its standard deviations, is another.
const FAR: f64 = 5.0;
/// Uncertainty from the shape of the step, px and blurs: asymmetric, or a seam that is not straight. Behind a lens that
/// makes an even disc of a point, out of focus, the edge is found 0.24 blurs too far out. Lenses are between that and a
/// normal distribution: 0.24 / √3.
const MODEL_PX: f64 = 0.15;
const MODEL_BLURS: f64 = 0.14;
/// The sharpest blur, px.
const SHARPEST_PX: f64 = 0.5;

/// The light of a plate in bands, before its end and around it.
pub(crate) struct EndLight<'a> {
    pub(crate) sections: &'a [BandSection],
    /// Sections that are surely of the plate: the first ones.
    pub(crate) plate: usize,
    /// Sections from this one on are surely beyond its edge.
    pub(crate) beyond: usize,
    pub(crate) used: [bool; BANDS],
    pub(crate) band_px: f64,
    /// Thickness of the stripe, px.
    pub(crate) sigma_px: f64,
}

type Bands = SMatrix<f64, BANDS, 1>;
type Places = SMatrix<f64, PLACES, 1>;
type Covariance = SMatrix<f64, PLACES, PLACES>;

/// The unknowns: place and logarithm of the blur, px, and slant.
#[derive(Clone, Copy)]
struct Guess {
    place: f64,
    slant: f64,
    blur_px: f64,
}

/// Properties of the plate: mean light of each band, contrast and length of grains, the variance of the dark.
struct Plate {
    light: Bands,
    contrast2: f64,
    grain_px: f64,
    /// Grains in a row on it.
    grains: f64,
    dark_variance: f64,
}

/// The edge near a first one; `None` if there is too little light, or it does not look like an edge.
pub(crate) fn refine(light: &EndLight<'_>, first: &Edge) -> Option<Edge> {
    let spacing = light.spacing()?;
    let plate = light.plate(spacing)?;
    let mut at = Guess { place: first.s, slant: 0.0, blur_px: first.blur_px };
    let (mut part, mut before) = (1.0_f64, 0.0);
    for number in 0..MOST_STEPS {
        let step = light.step(&plate, &at, first.blur_px, spacing)?;
        if step.is_settled() || number == MOST_STEPS - 1 {
            return step.edge(&at, step.change.x.abs());
        }
        // The expected light moves with the edge: whole steps may oscillate.
        part = if step.change.x * before < 0.0 { SHORTER * part } else { (LONGER * part).min(1.0) };
        before = step.change.x;
        at = at.moved(&(part * step.change));
        if !at.place.is_finite() || (at.place - first.s).abs() > FAR * first.sigma_px {
            return None;
        }
    }
    None
}

struct Step {
    change: Vector3<f64>,
    covariance: Matrix3<f64>,
    misfit: f64,
}

impl Step {
    /// Whether all of it is small against its standard deviation: a place that rests may still move with slant and
    /// blur.
    fn is_settled(&self) -> bool {
        let variances = self.covariance.diagonal();
        self.change
            .iter()
            .zip(&variances)
            .all(|(change, variance)| change * change < SETTLED * SETTLED * variance)
    }

    /// The edge at a place from which the next one is `off_px` away.
    fn edge(&self, at: &Guess, off_px: f64) -> Option<Edge> {
        let variance = self.covariance.m11 * self.misfit.max(1.0);
        if self.misfit > MISFIT || off_px * off_px > variance {
            return None;
        }
        let model = MODEL_PX.hypot(MODEL_BLURS * at.blur_px).hypot(off_px);
        let sigma_px = variance.sqrt().hypot(model);
        Some(Edge { s: at.place, sigma_px, blur_px: at.blur_px, rounded_px: 0.0 })
    }
}

impl Guess {
    fn moved(&self, change: &Vector3<f64>) -> Self {
        // No further at once than a straight line is like a step.
        let place = self.place + change.x.clamp(-2.0 * self.blur_px, 2.0 * self.blur_px);
        let slant = (self.slant + change.y.clamp(-0.5, 0.5)).clamp(-MOST_SLANT, MOST_SLANT);
        let blur_px = (self.blur_px * change.z.clamp(-0.5, 0.5).exp()).max(SHARPEST_PX);
        Self { place, slant, blur_px }
    }
}

/// A step of light at the sampled places; zero at others.
struct Shape {
    places: Range<usize>,
    width: f64,
    /// Part of the plate's light.
    lit: Places,
    /// Its change if the edge moves by one px, and if the blur grows by its own size.
    bell: Places,
    wider: Places,
}

impl Shape {
    fn new(at: &Guess, places: Range<usize>, width: f64) -> Self {
        // The mean over a place is blurred by its width.
        let own = (at.blur_px * at.blur_px + width * width / 12.0).sqrt();
        let (mut lit, mut bell, mut wider) = (Places::zeros(), Places::zeros(), Places::zeros());
        for k in places.clone() {
            let t = offset(k, width) / own;
            lit[k] = beyond(t);
            bell[k] = (-0.5 * t * t).exp() / (std::f64::consts::TAU.sqrt() * own);
            wider[k] = bell[k] * offset(k, width) * (at.blur_px / own).powi(2);
        }
        Self { places, width, lit, bell, wider }
    }

    /// Covariance of other light than the stripe's: a common part, the camera's noise, and an uneven part.
    fn stray(&self, same: f64, noise: f64, most: f64) -> Covariance {
        let own = noise + (UNEVEN * most).powi(2);
        Covariance::from_fn(|j, k| {
            let both = self.places.contains(&j) && self.places.contains(&k);
            f64::from(u8::from(both)) * same + if j == k { own } else { 0.0 }
        })
    }
}

impl EndLight<'_> {
    /// Sections are equally far from each other.
    fn spacing(&self) -> Option<f64> {
        let (first, last) = (self.sections.first()?, self.sections.last()?);
        let spacing = (last.s - first.s) / (self.sections.len() - 1) as f64;
        (spacing > 0.0).then_some(spacing)
    }

    fn distance_px(&self, band: usize) -> f64 {
        (band as f64 + 0.5 - 0.5 * BANDS as f64) * self.band_px
    }

    fn plate(&self, spacing: f64) -> Option<Plate> {
        let used = || (0..BANDS).filter(|band| self.used[*band]);
        let plate = &self.sections[..self.plate];
        let dark = &self.sections[self.beyond..];
        let mean = |sections: &[BandSection], band: usize| {
            sections.iter().map(|section| section.light[band]).sum::<f64>() / sections.len() as f64
        };
        let light = Bands::from_fn(|band, _| if self.used[band] { mean(plate, band) } else { 0.0 });
        if used().any(|band| light[band] <= 0.0) {
            return None;
        }
        let off = |k: usize, band: usize| plate[k].light[band] / light[band] - 1.0;
        let at_lag = |lag: usize| {
            let products =
                (lag..plate.len()).flat_map(|k| used().map(move |band| off(k, band) * off(k - lag, band)));
            products.sum::<f64>() / (plate.len() * used().count()) as f64
        };
        let contrast2 = at_lag(0).max(1e-6);
        if contrast2 > MOST_CONTRAST2 {
            return None;
        }
        let mut sum = 1.0;
        for rho in (1..plate.len() / 4).map(|lag| at_lag(lag) / contrast2).take_while(|rho| *rho > 0.1) {
            sum += 2.0 * rho;
        }
        // Σ exp(−x² / 2ℓ²) = √2π ℓ.
        let grain_px = (sum * spacing / std::f64::consts::TAU.sqrt()).max(SHARPEST_PX);
        let grains = plate.len() as f64 / sum;
        let squares = used().map(|band| {
            let mean = mean(dark, band);
            dark.iter().map(|section| (section.light[band] - mean).powi(2)).sum::<f64>()
        });
        let dark_variance = squares.sum::<f64>() / (dark.len() * used().count()) as f64;
        // About their own mean grains scatter by less.
        let contrast2 = contrast2 / (1.0 - 1.0 / grains.max(2.0));
        Some(Plate { light, contrast2, grain_px, grains, dark_variance })
    }

    /// One step: correction of a guess from the light.
    fn step(&self, plate: &Plate, at: &Guess, blur_before_px: f64, spacing: f64) -> Option<Step> {
        let grain_px =
            (at.blur_px * std::f64::consts::SQRT_2).clamp(plate.grain_px / GRAIN, plate.grain_px * GRAIN);
        let plate = &Plate { grain_px, ..*plate };
        let width = spacing.max(at.blur_px / PER_BLUR);
        let shape = Shape::new(at, self.places(at, width)?, width);
        let residuals = self.residuals(plate, at, &shape, spacing);
        let along = covariance_along(plate, at, &shape);
        let across = self.covariance_across(plate, at);
        let most = plate.light.max();
        let stray = shape.stray((STRAY * most).powi(2), plate.dark_variance * spacing / width, most);
        let (mut information, mut right, mut squares) = (Matrix3::zeros(), Vector3::zeros(), 0.0);
        let slopes = Bands::from_fn(|band, _| plate.light[band] * self.distance_px(band));
        for mode in 0..BANDS {
            let vector = across.eigenvectors.column(mode);
            let [amplitude, slope] = [vector.dot(&plate.light), vector.dot(&slopes)];
            let unsure = shape.lit * shape.lit.transpose() * (FADES * amplitude).powi(2);
            let covariance = along * across.eigenvalues[mode].max(0.0) + unsure + stray;
            let residual = residuals * vector;
            let columns = SMatrix::<f64, PLACES, 3>::from_columns(&[
                shape.bell * amplitude,
                shape.bell * slope,
                shape.wider * amplitude,
            ]);
            let weighed = covariance.cholesky()?;
            let solved = weighed.solve(&columns);
            information += columns.transpose() * solved;
            right += solved.transpose() * residual;
            squares += residual.dot(&weighed.solve(&residual));
        }
        let values = self.used.iter().filter(|used| **used).count() * shape.places.len();
        let prior = Vector3::new(0.0, SLANT.powi(-2), BLUR.powi(-2));
        information += Matrix3::from_diagonal(&prior);
        right.y -= prior.y * at.slant;
        right.z -= prior.z * (at.blur_px / blur_before_px).ln();
        let covariance = information.try_inverse()?;
        Some(Step { change: covariance * right, covariance, misfit: squares / values as f64 })
    }

    /// The light of each band, place by place, less its expectation.
    fn residuals(
        &self,
        plate: &Plate,
        at: &Guess,
        shape: &Shape,
        spacing: f64,
    ) -> SMatrix<f64, PLACES, BANDS> {
        SMatrix::from_fn(|k, band| {
            if !self.used[band] || !shape.places.contains(&k) {
                return 0.0;
            }
            let s = at.place + at.slant * self.distance_px(band) + offset(k, shape.width);
            self.mean_light(band, s, shape.width, spacing) - plate.light[band] * shape.lit[k]
        })
    }

    /// Places about the edge that all bands reach.
    fn places(&self, at: &Guess, width: f64) -> Option<Range<usize>> {
        let (first, last) = (self.sections.first()?.s, self.sections.last()?.s);
        let slanted =
            (0..BANDS).filter(|band| self.used[*band]).map(|band| at.slant * self.distance_px(band));
        let [least, most] =
            slanted.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], s| [s.min(a), s.max(b)]);
        let reached = |k: &usize| {
            let middle = at.place + offset(*k, width);
            middle + least - width > first && middle + most + width < last
        };
        let mut all = (0..PLACES).filter(reached);
        let from = all.next()?;
        let to = all.next_back()? + 1;
        (from + FEWEST <= PLACES / 2 && to >= PLACES / 2 + FEWEST).then_some(from..to)
    }

    /// Mean light of a band over a stretch about `s`.
    fn mean_light(&self, band: usize, s: f64, width: f64, spacing: f64) -> f64 {
        let origin = self.sections[0].s;
        let [from, to] = [s - 0.5 * width, s + 0.5 * width].map(|s| (s - origin) / spacing + 0.5);
        let (mut sum, mut total) = (0.0, 0.0);
        for k in from.floor().max(0.0) as usize..=(to as usize).min(self.sections.len() - 1) {
            let overlap = ((k + 1) as f64).min(to) - (k as f64).max(from);
            if overlap > 0.0 {
                sum += overlap * self.sections[k].light[band];
                total += overlap;
            }
        }
        sum / total.max(1e-12)
    }

    /// Covariance of the bands' light on the plate, split into independent parts.
    fn covariance_across(&self, plate: &Plate, at: &Guess) -> SymmetricEigen<f64, nalgebra::Const<BANDS>> {
        // All bands share the grains of a stripe that is narrow against the blur: the shared part of exp(−(a² + b²) / 2σ²)
        // in the stripe's light is not of the grains.
        let narrow = (1.0 - 0.5 * (plate.grain_px / self.sigma_px).powi(2)).max(NARROWEST);
        SymmetricEigen::new(SMatrix::<f64, BANDS, BANDS>::from_fn(|a, b| {
            let apart = (self.distance_px(a) - self.distance_px(b)) / plate.grain_px;
            let shared = (-0.5 * apart * apart * (narrow + at.slant * at.slant)).exp();
            let own = if a == b { OWN } else { 0.0 };
            plate.contrast2 * plate.light[a] * plate.light[b] * (shared + own)
        }))
    }
}

/// Covariance of the light along a band, for a plate's light and contrast of one.
fn covariance_along(plate: &Plate, at: &Guess, shape: &Shape) -> Covariance {
    let scale = (0.5 * plate.grain_px).max(at.blur_px * std::f64::consts::FRAC_1_SQRT_2);
    // Both depend on the difference and the sum of the places alone.
    let near: [f64; PLACES] =
        std::array::from_fn(|apart| (-0.5 * (apart as f64 * shape.width / plate.grain_px).powi(2)).exp());
    let before: [f64; 2 * PLACES] =
        std::array::from_fn(|sum| beyond(0.5 * (sum as f64 + 1.0 - PLACES as f64) * shape.width / scale));
    Covariance::from_fn(|j, k| {
        if !(shape.places.contains(&j) && shape.places.contains(&k)) {
            return 0.0;
        }
        near[j.abs_diff(k)] * before[j + k] + shape.lit[j] * shape.lit[k] / plate.grains
    })
}

/// Distance of a place from the edge, px.
fn offset(place: usize, width: f64) -> f64 {
    (place as f64 + 0.5 - 0.5 * PLACES as f64) * width
}

/// Part of a normal distribution that lies beyond a place, to 2e-7 \[Abramowitz1964, 26.2.17\].
fn beyond(t: f64) -> f64 {
    let k = 1.0 / (1.0 + 0.231_641_9 * t.abs());
    let series = k
        * (0.319_381_530
            + k * (-0.356_563_782 + k * (1.781_477_937 + k * (-1.821_255_978 + k * 1.330_274_429))));
    let tail = series * (-0.5 * t * t).exp() / std::f64::consts::TAU.sqrt();
    if t > 0.0 { tail } else { 1.0 - tail }
}
