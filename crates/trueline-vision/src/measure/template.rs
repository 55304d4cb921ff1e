//! The stripe's cross-section, learnt from the picture, and the weights that find its middle best.
//!
//! With levels I(d) = A P(d) + noise of variance V(d), the estimate of a shift that has the least variance weighs
//! each level by −P′(d)/V(d). Under full speckle V = P², and the flanks count far more than in a centre of gravity;
//! under read noise V is constant, and this is a fit of the profile. P and V are the picture's own averages along a
//! segment, folded about the middle. So the weights are odd, and a symmetric stripe of any shape is found without
//! bias.

/// Bins for a pixel of distance.
const PER_PX: f64 = 8.0;
/// The widest half that is stored, px.
const MOST_PX: f64 = 32.0;
const BINS: usize = (MOST_PX * PER_PX) as usize;
/// Bins of the first pixel from the middle that must have been met.
const MOST_PHASES: usize = 6;
/// Entries of the table of weights for a bin, interpolated. A stripe along a row of pixels meets the same few phases
/// of the pixel grid everywhere, and rounding there is a bias.
const FINE: usize = 4;
const ENTRIES: usize = 2 * BINS * FINE;
/// One entry in whole numbers, and its bits.
const ONE_BITS: u32 = 32;
const ONE: f64 = (1_u64 << ONE_BITS) as f64;
/// A profile ends at this part of its peak.
const END: f64 = 0.002;
/// Standard deviation that is assumed at least, as a part of the peak. Without speckle, the pixel grid and the shape
/// of the profile matter more than noise, and all of the flanks is used equally. With fully developed speckle, the
/// far flanks have the most information, down to the noise of the camera.
const LEAST_SIGMA_CLEAN: f64 = 0.1;
const LEAST_SIGMA: f64 = 0.005;
/// Assumed in addition for a saturated ridge: the lens's stray light from such brightness is some hundredths of full scale,
/// and is not the stripe's own.
const LEAST_SIGMA_SATURATED: f64 = 0.02;
/// Variance of the stripe's light, as a part of its square, above which speckle outweighs the rest. A lens, or pixels that
/// were added up, leave a part of fully developed speckle, which has a variance of one. It is that where the light is at
/// least this part of the peak: a ridge that is saturated shows no speckle, its shoulders do.
const FULL_CONTRAST: f64 = 0.05;
const SHOULDER: f64 = 0.5;
/// Standard deviation of the distances of pooled levels, px: a slope turns it into a variance that is not speckle. A
/// triangle of 0.75 px to each side has 0.75 / √6 = 0.31 px; the line is known to about 0.1 px.
const TOGETHER_PX: f64 = 0.35;

/// Levels of its peak for the comparison of a profile's widths. Their ratio is √(ln 0.8 / ln 0.3) in a normal
/// distribution, and √((1 − 0.8²) / (1 − 0.3²)) in half of an ellipse.
const SHOULDER_HEIGHTS: [f64; 2] = [0.8, 0.3];
const NORMAL: f64 = 0.4305;
const DISC: f64 = 0.6290;

/// Weight of a level, by distance from the middle:
///
/// 0. odd: weight for the middle, negative on the negative side;
/// 1. the profile: weight for the amplitude;
/// 2. response: the level's contribution to the change of the odd sum when the stripe moves. A grain of speckle of
///    factor f moves as f P(d − e), by f P · (−P′/P);
/// 3. odd, of the ridge alone: finds the same middle of a symmetric stripe as the first does.
pub type Weights = [f32; 4];

/// Profile and weights by distance from the middle.
#[derive(Clone, Debug)]
pub struct Template {
    /// Half of the sampled range, px.
    pub reach_px: f64,
    /// From −reach to +reach; beyond it zero.
    weights: [Weights; ENTRIES],
    /// ∫ −w P′ over both sides: change of the weighted sum by a shift of one px at amplitude one.
    pub gain: f64,
    /// ∫ P² over both sides.
    pub energy: f64,
    /// Width of the profile at four fifths of its peak, as a part of that at three tenths.
    shoulders: f64,
    /// Width at half of the peak, px.
    width_px: f64,
}

impl Template {
    /// A Gaussian with wide weights: for a line known to a few px only.
    #[must_use]
    pub fn gaussian(sigma_px: f64) -> Self {
        let sigma = sigma_px.clamp(0.7, MOST_PX / 4.0);
        let profile = bins(|d| (-0.5 * (d / sigma).powi(2)).exp());
        let weights = bins(|d| d * (-0.5 * (d / (1.2 * sigma)).powi(2)).exp());
        Self::new(3.0 * sigma, &profile, &weights)
    }

    /// From the mean of the levels (amplitude one) and their variance by distance.
    fn best(profile: &[f64; BINS], variance: &[f64; BINS]) -> Option<Self> {
        let peak = profile.iter().take(PER_PX as usize).fold(0.0_f64, |top, p| top.max(*p));
        let end = profile.iter().position(|p| *p < END * peak).unwrap_or(BINS - 1);
        if peak <= 0.0 || end < 2 {
            return None;
        }
        let [contrast, on_ridge] = [contrast2(profile, variance, peak), variance[0] / (peak * peak)]
            .map(|squared| (squared / FULL_CONTRAST).min(1.0));
        let floor = LEAST_SIGMA.powi(2)
            + (1.0 - contrast) * LEAST_SIGMA_CLEAN.powi(2)
            + (contrast - on_ridge).max(0.0) * LEAST_SIGMA_SATURATED.powi(2);
        let weights =
            std::array::from_fn(|k| (-slope(profile, k)).max(0.0) / (variance[k] + floor * peak * peak));
        Some(Self::new((end as f64 + 0.5) / PER_PX, profile, &weights))
    }

    fn new(reach_px: f64, profile: &[f64; BINS], weights: &[f64; BINS]) -> Self {
        let bins = ((reach_px * PER_PX).ceil() as usize).clamp(2, BINS - 1);
        // Weights fade out at the end, so that no pixel enters or leaves all at once.
        let fade = |k: usize| {
            let part = (k as f64 + 0.5) / bins as f64;
            1.0 - part.powi(4)
        };
        let odd: [f64; BINS] = std::array::from_fn(|k| if k < bins { weights[k] * fade(k) } else { 0.0 });
        let gain = (0..bins).map(|k| -odd[k] * slope(profile, k)).sum::<f64>() * 2.0 / PER_PX;
        let energy = profile[..bins].iter().map(|p| p * p).sum::<f64>() * 2.0 / PER_PX;
        let ridge = ridge_weights(profile, bins);
        let ridge_gain = (0..bins).map(|k| -ridge[k] * slope(profile, k)).sum::<f64>() * 2.0 / PER_PX;
        let at_bin = |k: usize| -> [f64; 4] {
            let steepness = if profile[k] > 0.0 { -slope(profile, k) / profile[k] } else { 0.0 };
            [odd[k], profile[k], odd[k] * steepness / gain, ridge[k] * gain / ridge_gain]
        };
        let mut signed = [[0.0_f32; 4]; ENTRIES];
        for entry in 0..bins * FINE {
            let place = (entry as f64 + 0.5) / FINE as f64 - 0.5;
            let (low, part) = (place.floor(), place - place.floor());
            let (below, above) = (at_bin(low.max(0.0) as usize), at_bin((low + 1.0) as usize));
            // Across the middle the odd weights change their sign, and the others are even.
            let mirrored = if low < 0.0 { -1.0 } else { 1.0 };
            let mix = |which: usize, sign: f64| sign * below[which] * (1.0 - part) + above[which] * part;
            let [odd, profile, response, ridge] =
                [mix(0, mirrored), mix(1, 1.0), mix(2, 1.0), mix(3, mirrored)];
            for (at, side) in [(bins * FINE - 1 - entry, -1.0), (bins * FINE + entry, 1.0)] {
                signed[at] = [side * odd, profile, response, side * ridge].map(|weight| weight as f32);
            }
        }
        let shoulders = half_width(profile, SHOULDER_HEIGHTS[0]) / half_width(profile, SHOULDER_HEIGHTS[1]);
        let width_px = 2.0 * half_width(profile, 0.5) / PER_PX;
        Self { reach_px: bins as f64 / PER_PX, weights: signed, gain, energy, shoulders, width_px }
    }

    /// Similarity of the profile to a line behind a lens out of focus, which makes an even disc of a point. Zero is a
    /// normal distribution, one is half of an ellipse.
    #[must_use]
    pub(crate) fn flatness(&self) -> f64 {
        ((self.shoulders - NORMAL) / (DISC - NORMAL)).clamp(0.0, 1.0)
    }

    /// Width at half of the profile's height, px.
    #[must_use]
    pub(crate) fn width_px(&self) -> f64 {
        self.width_px
    }

    /// Sums of levels with each weight. Levels are of pixels from a first signed distance on in steps of `step_px`, which
    /// may be negative; beyond reach they have no weight.
    #[inline(always)]
    #[must_use]
    pub fn weigh(&self, first_px: f64, step_px: f64, levels: impl Iterator<Item = f32>) -> Weights {
        let per_px = PER_PX * FINE as f64 * ONE;
        // Whole numbers: to make one of a fraction takes longer than all the rest. Negative places are far beyond the last
        // entry.
        let mut place = ((first_px + self.reach_px) * per_px) as i64;
        let step = (step_px * per_px) as i64;
        // Pixels in turn, for each sum has to wait for the one before.
        let mut sums = [[0.0_f32; 4]; 2];
        for (number, level) in levels.enumerate() {
            let weights = self.weights.get((place >> ONE_BITS) as usize).unwrap_or(&[0.0; 4]);
            let sums = &mut sums[number % 2];
            for k in 0..4 {
                sums[k] += weights[k] * level;
            }
            place = place.wrapping_add(step);
        }
        std::array::from_fn(|k| sums[0][k] + sums[1][k])
    }
}

/// The greatest variance of the light as a part of its square, ridge and shoulders, without the part of the slope.
fn contrast2(profile: &[f64; BINS], variance: &[f64; BINS], peak: f64) -> f64 {
    let bright = (0..BINS).take_while(|k| profile[*k] > SHOULDER * peak);
    let squared = bright.map(|k| {
        let of_slope = slope(profile, k) * TOGETHER_PX;
        (variance[k] - of_slope * of_slope) / (profile[k] * profile[k])
    });
    squared.fold(0.0, f64::max)
}

/// A function of the distance, in the middle of each bin.
fn bins(of: impl Fn(f64) -> f64) -> [f64; BINS] {
    std::array::from_fn(|k| of((k as f64 + 0.5) / PER_PX))
}

/// Place at which a profile has fallen to a part of its peak, in bins.
fn half_width(profile: &[f64; BINS], part: f64) -> f64 {
    let height = part * profile[0];
    let below = profile.iter().position(|p| *p < height).unwrap_or(BINS - 1).max(1);
    let (before, after) = (profile[below - 1], profile[below]);
    below as f64 - 0.5 + (before - height) / (before - after).max(f64::MIN_POSITIVE)
}

/// Weights that see the ridge and hardly the flanks.
fn ridge_weights(profile: &[f64; BINS], bins: usize) -> [f64; BINS] {
    let shoulder = profile[..bins].iter().position(|p| *p < (-0.5_f64).exp() * profile[0]).unwrap_or(bins);
    std::array::from_fn(|k| {
        let part = (k as f64 + 0.5) / shoulder.max(1) as f64;
        if k < bins { part * (-part * part).exp() } else { 0.0 }
    })
}

/// Slope of a profile, per px.
fn slope(profile: &[f64; BINS], k: usize) -> f64 {
    let (before, after) = (k.saturating_sub(1), (k + 1).min(BINS - 1));
    (profile[after] - profile[before]) * PER_PX / (after - before) as f64
}

/// Adds up levels by distance from the middle.
#[derive(Clone, Debug)]
pub struct Stack {
    /// Count, sum and sum of squares by distance.
    sums: [[f32; 4]; BINS],
}

impl Default for Stack {
    fn default() -> Self {
        Self { sums: [[0.0; 4]; BINS] }
    }
}

impl Stack {
    /// Forgets all.
    pub fn clear(&mut self) {
        self.sums.fill([0.0; 4]);
    }

    /// Adds a level (amplitude one) at a distance, px.
    #[inline]
    pub fn add(&mut self, distance_px: f32, level: f32) {
        let bin = ((distance_px.abs() * PER_PX as f32) as usize).min(BINS - 1);
        for (sum, term) in self.sums[bin].iter_mut().zip([1.0, level, level * level, 0.0]) {
            *sum += term;
        }
    }

    /// Whether levels were added at all phases of the pixel grid, or nearly. A stripe that runs along a row of pixels to
    /// within a fraction of one meets one phase only, and between its pixels the profile is not seen.
    #[must_use]
    pub(crate) fn meets_all_phases(&self) -> bool {
        let seen = self.sums[..PER_PX as usize].iter().filter(|[count, ..]| *count > 0.0).count();
        seen >= MOST_PHASES
    }

    /// The template of the added sections; `None` if there is no peak in the middle.
    #[must_use]
    pub fn template(&self) -> Option<Template> {
        // Triangular, over three quarters of a pixel to each side: narrower than any stripe that is resolved.
        let width = (0.75 * PER_PX) as i64;
        let smooth = |k: usize, which: usize| -> f64 {
            let weighed = (-width..width + 1).map(|j| {
                // Folded: the other side of the middle is this one.
                let at = k as i64 + j;
                let at = if at < 0 { -at - 1 } else { at } as usize;
                (width + 1 - j.abs()) as f64 * f64::from(self.sums.get(at).map_or(0.0, |sums| sums[which]))
            });
            weighed.sum()
        };
        let mean = |which: usize| -> [f64; BINS] {
            std::array::from_fn(|k| {
                let count = smooth(k, 0);
                if count > 0.0 { smooth(k, which) / count } else { 0.0 }
            })
        };
        let (profile, squares) = (mean(1), mean(2));
        let variance = std::array::from_fn(|k| (squares[k] - profile[k] * profile[k]).max(0.0));
        Template::best(&profile, &variance)
    }
}
