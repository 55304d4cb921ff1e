//! The stripe's cross-section, learnt from the picture, and the weights that find its middle best.
//!
//! With levels I(d) = A P(d) + noise of variance V(d), the estimate of a shift that has the least variance
//! weighs each level by −P′(d)/V(d). Under full speckle V = P², and the flanks count far more than in a
//! centre of gravity; under read noise V is constant, and this is a fit of the profile. P and V are what the
//! picture itself shows on average along a piece, folded about the middle, so that the weights are odd and a
//! symmetric stripe of any shape is found without bias.

/// Bins for a pixel of distance.
const PER_PX: f64 = 8.0;
/// The widest half that is stored, px.
const MOST_PX: f64 = 40.0;
const BINS: usize = (MOST_PX * PER_PX) as usize;
/// Where the profile has fallen to this part of its peak it ends.
const END: f64 = 0.002;
/// Standard deviation that is assumed at least, as a part of the peak. Where there is no speckle, the pixel
/// grid and the shape of the profile matter more than noise, and all of the flanks is used alike; where it is
/// fully developed, the far flanks tell most, down to the noise of the camera.
const LEAST_SIGMA_CLEAN: f64 = 0.1;
const LEAST_SIGMA: f64 = 0.005;
/// Variance of the ridge, as a part of its square, at which speckle is taken as fully developed.
const FULL_CONTRAST: f64 = 0.3;

/// Weights of a level.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Weights {
    /// What finds the middle: negative on the negative side.
    pub odd: f32,
    /// The profile: what finds the amplitude.
    pub profile: f32,
    /// What the level adds to the change of the odd sum when the stripe moves: a grain of speckle of factor
    /// f moves as f P(d − e), by f P · (−P′/P).
    pub response: f32,
}

/// Profile and weights by distance from the middle.
#[derive(Clone, Debug)]
pub struct Template {
    /// Half of what is looked at, px.
    pub reach_px: f64,
    /// By distance: see [`Weights`].
    weights: Vec<Weights>,
    /// ∫ −w P′ over both sides: what a shift of one px adds to the weighted sum at amplitude one.
    pub gain: f64,
    /// ∫ P² over both sides.
    pub energy: f64,
}

impl Template {
    /// A Gaussian with weights that see far: for a line that is known to a few px only.
    #[must_use]
    pub fn gaussian(sigma_px: f64) -> Self {
        let sigma = sigma_px.clamp(0.7, MOST_PX / 4.0);
        let profile: Vec<f64> = distances().map(|d| (-0.5 * (d / sigma).powi(2)).exp()).collect();
        let weights: Vec<f64> = distances().map(|d| d * (-0.5 * (d / (1.2 * sigma)).powi(2)).exp()).collect();
        Self::new(3.0 * sigma, &profile, &weights)
    }

    /// From the mean of the levels (amplitude one) and their variance by distance.
    fn best(profile: &[f64], variance: &[f64]) -> Option<Self> {
        let peak = profile.iter().take(PER_PX as usize).fold(0.0_f64, |top, p| top.max(*p));
        let end = profile.iter().position(|p| *p < END * peak).unwrap_or(BINS - 1);
        if peak <= 0.0 || end < 2 {
            return None;
        }
        let contrast = (variance[0] / (FULL_CONTRAST * peak * peak)).min(1.0);
        let floor = LEAST_SIGMA.powi(2) + (1.0 - contrast) * LEAST_SIGMA_CLEAN.powi(2);
        let weights: Vec<f64> = (0..BINS)
            .map(|k| {
                let (before, after) = (k.saturating_sub(1), (k + 1).min(BINS - 1));
                let slope = (profile[after] - profile[before]) * PER_PX / (after - before) as f64;
                (-slope).max(0.0) / (variance[k] + floor * peak * peak)
            })
            .collect();
        Some(Self::new((end as f64 + 0.5) / PER_PX, profile, &weights))
    }

    fn new(reach_px: f64, profile: &[f64], weights: &[f64]) -> Self {
        let bins = ((reach_px * PER_PX).ceil() as usize).clamp(2, BINS);
        // Weights fade out at the end, so that no pixel enters or leaves all at once.
        let fade = |k: usize| {
            let part = (k as f64 + 0.5) / bins as f64;
            1.0 - part.powi(4)
        };
        let odd: Vec<f64> = (0..bins).map(|k| weights[k] * fade(k)).collect();
        let slope = |k: usize| {
            let (before, after) = (k.saturating_sub(1), (k + 1).min(BINS - 1));
            (profile[after] - profile[before]) * PER_PX / (after - before) as f64
        };
        let gain = (0..bins).map(|k| -odd[k] * slope(k)).sum::<f64>() * 2.0 / PER_PX;
        let energy = profile[..bins].iter().map(|p| p * p).sum::<f64>() * 2.0 / PER_PX;
        let weights = (0..bins).map(|k| {
            let steepness = if profile[k] > 0.0 { -slope(k) / profile[k] } else { 0.0 };
            Weights {
                odd: odd[k] as f32,
                profile: profile[k] as f32,
                response: (odd[k] * steepness / gain) as f32,
            }
        });
        Self { reach_px: bins as f64 / PER_PX, weights: weights.collect(), gain, energy }
    }

    /// Weights at a signed distance within reach, px.
    #[inline]
    #[must_use]
    pub fn at(&self, distance_px: f32) -> Weights {
        let bin = ((distance_px.abs() * PER_PX as f32) as usize).min(self.weights.len() - 1);
        let weights = self.weights[bin];
        Weights { odd: weights.odd.copysign(distance_px), ..weights }
    }
}

fn distances() -> impl Iterator<Item = f64> {
    (0..BINS).map(|k| (k as f64 + 0.5) / PER_PX)
}

/// Adds up levels by distance from the middle.
#[derive(Clone, Debug)]
pub struct Stack {
    count: Vec<f32>,
    sum: Vec<f32>,
    squares: Vec<f32>,
}

impl Default for Stack {
    fn default() -> Self {
        Self { count: vec![0.0; BINS], sum: vec![0.0; BINS], squares: vec![0.0; BINS] }
    }
}

impl Stack {
    /// Forgets all.
    pub fn clear(&mut self) {
        for values in [&mut self.count, &mut self.sum, &mut self.squares] {
            values.fill(0.0);
        }
    }

    /// Adds a level (amplitude one) at a distance, px.
    #[inline]
    pub fn add(&mut self, distance_px: f32, level: f32) {
        let bin = ((distance_px.abs() * PER_PX as f32) as usize).min(BINS - 1);
        self.count[bin] += 1.0;
        self.sum[bin] += level;
        self.squares[bin] += level * level;
    }

    /// The template of what was added; `None` if there is no peak in the middle.
    #[must_use]
    pub fn template(&self) -> Option<Template> {
        let mean = |values: &[f32]| -> Vec<f64> {
            let smooth = |k: usize, of: &[f32]| -> f64 {
                // Triangular, over a pixel to each side: narrower than any stripe that is resolved.
                let width = (0.75 * PER_PX) as i64;
                (-width..=width)
                    .map(|j| {
                        // Folded: the other side of the middle is this one.
                        let at = (k as i64 + j).max(-(k as i64 + j) - 1) as usize;
                        let weight = (width + 1 - j.abs()) as f64;
                        weight * f64::from(*of.get(at).unwrap_or(&0.0))
                    })
                    .sum()
            };
            (0..BINS)
                .map(|k| {
                    let count = smooth(k, &self.count);
                    if count > 0.0 { smooth(k, values) / count } else { 0.0 }
                })
                .collect()
        };
        let (profile, squares) = (mean(&self.sum), mean(&self.squares));
        let variance: Vec<f64> = profile.iter().zip(&squares).map(|(p, q)| (q - p * p).max(0.0)).collect();
        Template::best(&profile, &variance)
    }
}

