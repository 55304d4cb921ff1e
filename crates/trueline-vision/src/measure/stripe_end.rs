//! End of the stripe on a plate, to a fraction of a pixel.
//!
//! The stripe is processed in bands along it. In each, the light is that of the plate up to the edge and none beyond.
//! The edge may cross the stripe at a slant, so its place may differ from band to band in proportion. Speckled light
//! has a gamma distribution \[Goodman2007, §3\] with a shape measured on the plate: a dark grain before the edge is
//! normal, a bright one beyond it is not. The blur of the edge by lens and plate is unknown as well: an edge that is
//! assumed too sharp moves outward by about its blur. Every place, slant and blur has a likelihood then, and the mean
//! and spread of the places are the answer.

use crate::fastest::fastest;
use crate::measure::end_fit::{EndLight, refine};
pub use crate::measure::end_light::{BANDS, BandSection, Edge};
use crate::not_found::NotFound;

/// Part of the stripe's reach that the bands cover, on each side of its middle.
pub(crate) const COVERED: f64 = 0.7;
/// The least blur of an edge, px: a pixel's width and the interpolation are 0.41 px. Larger trial blurs are in thicknesses
/// (standard deviations) of the stripe. A blur of the end blurs the stripe's flanks as well, so more than one is a rounded
/// or worn edge.
const LEAST_BLUR_PX: f64 = 0.5;
const BLUR_SIGMAS: [f64; BLURS - 1] = [0.35, 0.7, 1.0, 1.4, 2.0, 3.0];
const BLURS: usize = 7;
/// Prior cost of each, as twice the negative logarithm of its likelihood. A lens blurs the stripe's flanks as it does
/// its end, so more than one thickness needs a worn edge.
const BLUR_COSTS: [f64; BLURS] = [0.0, 0.0, 0.0, 1.0, 5.0, 7.0, 9.0];
/// An edge with more blur than this, in thicknesses of the stripe and px, cannot be measured.
const MOST_BLUR_SIGMAS: f64 = 2.5;
const MOST_BLUR_PX: f64 = 6.5;
/// Sections further than this from a place, in blurs, are all plate or all nothing.
const SHARP_BLURS: f64 = 3.55;
/// Steps between the places that are tried, px and blurs: first all along, then near the best.
const STEPS_PX: [f64; 2] = [1.0, 0.25];
const STEP_BLURS: [f64; 2] = [0.5, 0.15];
/// How far from the best first place the second search goes, px.
const NEAR_PX: f64 = 6.0;
/// A blur is dropped if its best place costs this much more than the best of all.
const UNLIKELY: f64 = 12.0;
/// Entries of the table of a step's light, for each blur of distance.
const PER_BLUR: f64 = 32.0;
const ENTRIES: usize = 2 * (SHARP_BLURS * PER_BLUR) as usize + 2;
/// Slants that are tried: px along for each px across.
const SLANTS: [f64; 9] = [-1.6, -1.1, -0.7, -0.35, 0.0, 0.35, 0.7, 1.1, 1.6];
/// Sections on the plate, and beyond its edge, that are needed.
const FEWEST: [usize; 2] = [8, 3];
/// Length of stripe before the first place, for comparison with the light around the edge, px.
const COMPARED_PX: f64 = 60.0;
/// Uncertainty from the shape of the step, px and blurs: asymmetric, or a seam that is not straight.
const MODEL_PX: f64 = 0.15;
const MODEL_BLURS: f64 = 0.2;
/// The most even light that is believed: shape of the gamma distribution.
const EVENEST: f64 = 10.0;
/// Light beyond the edge is taken to be at least this part of the plate's: lenses stray some.
const LEAST_DARK: f64 = 0.08;
/// Part of the plate's light that may be left beyond an edge.
pub(crate) const LEFT: f64 = 0.5;

/// One band: its light on the plate and beyond, and the sums of costs along it.
#[derive(Clone, Debug, Default)]
struct Band {
    distance_px: f64,
    plate: f64,
    dark: f64,
    shape: f64,
    /// Light over the darkest that is expected, section by section.
    light: Vec<f64>,
    /// By the distance before the edge: logarithm and inverse of the mean light.
    steps: Vec<[f64; 2]>,
    /// Cost of all sections before each, were they plate; of all before each, were they dark.
    as_plate: Vec<f64>,
    as_dark: Vec<f64>,
    /// Cost of an edge at places of equal steps, and the first of these.
    by_place: Vec<f64>,
    first_place: f64,
}

/// Inputs of the search: place, bands, thickness of the stripe.
#[derive(Clone, Copy, Debug)]
pub struct EndSearch {
    /// First and last place, px along the line.
    pub within: [f64; 2],
    /// Width of a band, px.
    pub band_px: f64,
    /// The bands in use.
    pub used: [bool; BANDS],
    /// Thickness of the stripe, px.
    pub sigma_px: f64,
}

/// Finds ends of stripes; memory is kept from one to the next.
#[derive(Clone, Debug, Default)]
pub struct EndFinder {
    /// The sampled light, by rising distance along the line.
    pub sections: Vec<BandSection>,
    bands: [Band; BANDS],
    stations: Vec<f64>,
    costs: Vec<PlaceCost>,
    /// Sums over the bands of one slant, place by place.
    sums: Vec<f64>,
}

/// A blur that is tried.
struct Blur {
    px: f64,
    step_px: f64,
    /// Its cost beforehand.
    prior: f64,
    /// How many pixels a grain of speckle covers.
    correlation: f64,
}

/// One place and blur with its cost, and its share of the prior.
#[derive(Clone, Copy, Debug)]
struct PlaceCost {
    place: f64,
    blur_px: f64,
    step_px: f64,
    cost: f64,
}

impl EndFinder {
    /// The end of the stripe in `sections`: light before, none after.
    ///
    /// # Errors
    /// Light that does not end there, or too slowly for an edge; too little of it on either side.
    pub fn end(&mut self, search: &EndSearch) -> Result<Edge, NotFound> {
        let near = self.near_end(search)?;
        self.refined(search, &near)
    }

    /// The end near another one, with the correlation of neighbours' speckle.
    ///
    /// # Errors
    /// Light that ends too slowly for an edge.
    pub(crate) fn refined(&self, search: &EndSearch, near: &Edge) -> Result<Edge, NotFound> {
        let [plate, beyond] = self.split(search.within);
        let &EndSearch { used, band_px, sigma_px, .. } = search;
        let light = EndLight { sections: &self.sections, plate, beyond, used, band_px, sigma_px };
        clear(refine(&light, near).unwrap_or(*near), sigma_px)
    }

    /// Sections before the first place, and before the last one.
    fn split(&self, within: [f64; 2]) -> [usize; 2] {
        [
            self.sections.partition_point(|section| section.s < within[0]),
            self.sections.partition_point(|section| section.s <= within[1]),
        ]
    }

    /// The approximate end, without the correlation of neighbours' speckle, in a fraction of the time.
    ///
    /// # Errors
    /// As [`Self::end`].
    pub fn near_end(&mut self, search: &EndSearch) -> Result<Edge, NotFound> {
        let [first, last] = self.split(search.within);
        let beyond = self.sections.len() - last;
        if first < FEWEST[0] || beyond < FEWEST[1] {
            let visible = first as f64 / self.sections.len().max(1) as f64;
            return Err(NotFound::TooLittle { visible, needed: LEFT });
        }
        let used = search.used;
        // The light of the plate at its end may differ from that further back.
        let near = self.sections.partition_point(|section| section.s < search.within[0] - COMPARED_PX);
        let (sections, first, last) = (&self.sections[near..], first - near, last - near);
        for (number, band) in self.bands.iter_mut().enumerate().filter(|(number, _)| used[*number]) {
            band.measure(sections, number, [first, last], search.band_px).ok_or(NotFound::GoesOn)?;
        }
        self.stations.clear();
        self.stations.extend(sections[first..last].iter().map(|section| section.s));
        let correlation = correlation(&sections[..first]);
        clear(self.most_likely(search, correlation), search.sigma_px)
    }

    /// All blurs all along first, then the likely ones near the best place.
    fn most_likely(&mut self, search: &EndSearch, correlation: f64) -> Edge {
        let mut best = [f64::INFINITY; BLURS];
        let blurs = |step: usize| {
            blurs_px(search.sigma_px).into_iter().zip(BLUR_COSTS).map(move |(px, prior)| {
                let step_px = STEPS_PX[step].max(STEP_BLURS[step] * px);
                Blur { px, step_px, prior, correlation }
            })
        };
        self.costs.clear();
        for (best, blur) in best.iter_mut().zip(blurs(0)) {
            let from = self.costs.len();
            self.try_places(search.used, search.within, 2, &blur);
            *best = self.costs[from..].iter().fold(f64::INFINITY, |least, tried| least.min(tried.cost));
        }
        let rough = self.mean();
        let least = best.iter().copied().fold(f64::INFINITY, f64::min);
        let reach = NEAR_PX.max(4.0 * rough.sigma_px);
        let near = [(rough.s - reach).max(search.within[0]), (rough.s + reach).min(search.within[1])];
        self.costs.clear();
        for (_, blur) in best.into_iter().zip(blurs(1)).filter(|(best, _)| *best < least + UNLIKELY) {
            self.try_places(search.used, near, 1, &blur);
        }
        self.mean()
    }

    /// Adds the costs of all places, and of a subset of slants, of one blur. A band's evidence on a place does not depend
    /// on the slant: it is computed once, and interpolated between two places for each.
    fn try_places(&mut self, used: [bool; BANDS], [from, to]: [f64; 2], every: usize, blur: &Blur) {
        let Blur { px: blur_px, step_px, prior, correlation } = *blur;
        let places = ((to - from) / step_px) as usize + 1;
        let steepest = SLANTS[SLANTS.len() - 1];
        for (_, band) in used.into_iter().zip(&mut self.bands).filter(|(used, _)| *used) {
            let beside = (steepest * band.distance_px.abs() / step_px) as usize + 2;
            band.first_place = from - beside as f64 * step_px;
            band.by_place.clear();
            let count = places + 2 * beside + 1;
            fastest!(add_costs(band, &self.stations, [step_px, blur_px], count));
        }
        for slant in SLANTS.into_iter().step_by(every) {
            self.sums.clear();
            self.sums.resize(places, 0.0);
            for (_, band) in used.into_iter().zip(&self.bands).filter(|(used, _)| *used) {
                let at = (from + slant * band.distance_px - band.first_place) / step_px;
                let second = at as usize;
                fastest!(add_between(&mut self.sums, &band.by_place[second - 1..], cubic(at.fract())));
            }
            self.costs.extend(self.sums.iter().enumerate().map(|(k, sum)| PlaceCost {
                place: from + k as f64 * step_px,
                blur_px,
                step_px,
                cost: prior + sum / correlation,
            }));
        }
    }

    /// Mean and spread of the places, each with its likelihood exp(−cost / 2), summed over slants and blurs.
    fn mean(&self) -> Edge {
        let least = self.costs.iter().fold(f64::INFINITY, |least, tried| least.min(tried.cost));
        let origin = self.costs.first().map_or(0.0, |tried| tried.place);
        let (mut total, mut mean, mut square, mut blur_px, mut step_px) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for tried in &self.costs {
            let weight = tried.step_px * (-0.5 * (tried.cost - least)).exp();
            let place = tried.place - origin;
            total += weight;
            mean += weight * place;
            square += weight * place * place;
            blur_px += weight * tried.blur_px;
            step_px += weight * tried.step_px;
        }
        let (mean, square) = (mean / total, square / total);
        let (blur_px, step_px) = (blur_px / total, step_px / total);
        let variance = (square - mean * mean).max(0.0) + step_px * step_px / 12.0;
        let model = MODEL_PX.hypot(MODEL_BLURS * (blur_px - LEAST_BLUR_PX));
        Edge { s: origin + mean, sigma_px: (variance + model * model).sqrt(), blur_px, rounded_px: 0.0 }
    }
}

/// An edge that is not blurred too much for a stripe of a thickness.
fn clear(edge: Edge, sigma_px: f64) -> Result<Edge, NotFound> {
    let most_px = MOST_BLUR_PX.max(MOST_BLUR_SIGMAS * sigma_px);
    if edge.blur_px > most_px {
        return Err(NotFound::NoClearEnd { fades_px: edge.blur_px, most_px });
    }
    Ok(edge)
}

/// The blurs that are tried, px.
fn blurs_px(sigma_px: f64) -> [f64; BLURS] {
    std::array::from_fn(
        |k| {
            if k == 0 { LEAST_BLUR_PX } else { LEAST_BLUR_PX.max(BLUR_SIGMAS[k - 1] * sigma_px) }
        },
    )
}

impl Band {
    /// Stores a band's light; `None` if it does not fall from the plate to the dark beyond.
    fn measure(
        &mut self,
        sections: &[BandSection],
        number: usize,
        [first, last]: [usize; 2],
        width_px: f64,
    ) -> Option<()> {
        let light = |section: &BandSection| section.light[number];
        let (plate, variance) = mean_and_variance(sections[..first].iter().map(light));
        let (rest, noise) = mean_and_variance(sections[last..].iter().map(light));
        if plate <= 0.0 || rest > LEFT * plate {
            return None;
        }
        self.distance_px = (number as f64 + 0.5 - 0.5 * BANDS as f64) * width_px;
        self.plate = plate;
        self.dark = (rest.abs() + noise.sqrt()).max(LEAST_DARK * plate);
        self.shape = (plate * plate / variance.max(1e-9)).clamp(0.5, EVENEST);
        self.light.clear();
        self.light.extend(sections[first..last].iter().map(|section| light(section).max(0.0) + self.dark));
        self.tabulate();
        let [all, none] = [self.plate + self.dark, self.dark].map(step);
        let (mut plates, mut darks) = (0.0, 0.0);
        self.as_plate.clear();
        self.as_dark.clear();
        for k in 0..=self.light.len() {
            self.as_plate.push(plates);
            self.as_dark.push(darks);
            if let Some(light) = self.light.get(k) {
                plates += self.cost(*light, all);
                darks += self.cost(*light, none);
            }
        }
        Some(())
    }

    /// The table of the step's light, by the distance before the edge.
    fn tabulate(&mut self) {
        self.steps.clear();
        self.steps.extend((0..ENTRIES).map(|k| {
            let before = k as f64 / PER_BLUR - SHARP_BLURS;
            step(self.plate * lit(before) + self.dark)
        }));
    }

    /// Twice the negative logarithm of a gamma distribution of a mean.
    fn cost(&self, light: f64, [logarithm, inverse]: [f64; 2]) -> f64 {
        2.0 * self.shape * (logarithm + light * inverse)
    }
}

/// Adds the costs of an edge of some blur at places of equal steps.
#[inline(always)]
fn add_costs(band: &mut Band, stations: &[f64], [step_px, blur_px]: [f64; 2], count: usize) {
    let Band { light, steps, as_plate, as_dark, by_place, first_place, shape, .. } = band;
    let Some(steps) = steps.first_chunk::<ENTRIES>() else { return };
    let (reach, per_px) = (SHARP_BLURS * blur_px, PER_BLUR / blur_px);
    let (mut from, mut to) = (0, 0);
    for k in 0..count {
        let place = *first_place + k as f64 * step_px;
        // Places rise, and stations do.
        from += stations[from..].iter().take_while(|s| **s < place - reach).count();
        to += stations[to..].iter().take_while(|s| **s <= place + reach).count();
        let mixed = costs_between(&light[from..to], &stations[from..to], steps, [place + reach, per_px]);
        by_place.push(as_plate[from] + 2.0 * *shape * mixed + as_dark[stations.len()] - as_dark[to]);
    }
}

/// Costs of sections near an edge, in lanes: each sum has to wait for the one before.
#[inline(always)]
fn costs_between(
    light: &[f64],
    stations: &[f64],
    steps: &[[f64; 2]; ENTRIES],
    [end, per_px]: [f64; 2],
) -> f64 {
    const LANES: usize = 4;
    let mut lanes = [0.0_f64; LANES];
    let cost = |light: f64, s: f64| {
        let entry = ((end - s) * per_px) as i32;
        let [logarithm, inverse] = steps[entry.clamp(0, ENTRIES as i32 - 1) as usize];
        logarithm + light * inverse
    };
    let whole = light.len() / LANES * LANES;
    for (light, stations) in light[..whole].chunks_exact(LANES).zip(stations[..whole].chunks_exact(LANES)) {
        for k in 0..LANES {
            lanes[k] += cost(light[k], stations[k]);
        }
    }
    let rest = light[whole..].iter().zip(&stations[whole..]).map(|(light, s)| cost(*light, *s));
    lanes.iter().sum::<f64>() + rest.sum::<f64>()
}

/// Adds to each sum the value between the second and the third of four costs in a row.
#[inline(always)]
fn add_between(sums: &mut [f64], costs: &[f64], weights: [f64; 4]) {
    let count = sums.len();
    let Some(costs) = costs.get(..count + 3) else { return };
    for k in 0..count {
        let around = &costs[k..k + 4];
        sums[k] +=
            weights[0] * around[0] + weights[1] * around[1] + weights[2] * around[2] + weights[3] * around[3];
    }
}

/// Weights of four values in a row at a part of the way from the second to the third (Catmull and Rom's cubic).
fn cubic(part: f64) -> [f64; 4] {
    let (one, two, three) = (part, part * part, part * part * part);
    [
        0.5 * (2.0 * two - one - three),
        0.5 * (2.0 - 5.0 * two + 3.0 * three),
        0.5 * (one + 4.0 * two - 3.0 * three),
        0.5 * (three - two),
    ]
}

/// Logarithm and inverse of a mean.
fn step(mean: f64) -> [f64; 2] {
    [mean.ln(), mean.recip()]
}

/// Part of the plate's light at a number of blurs before the edge: a smooth step, within 0.01 of the normal one.
fn lit(before: f64) -> f64 {
    1.0 / (1.0 + (-1.702 * before).exp())
}

fn mean_and_variance(values: impl Iterator<Item = f64> + Clone) -> (f64, f64) {
    let count = values.clone().count() as f64;
    let mean = values.clone().sum::<f64>() / count;
    (mean, values.map(|value| (value - mean).powi(2)).sum::<f64>() / (count - 1.0).max(1.0))
}

/// How many pixels a grain of speckle covers: (1 + 2 Σ ρ) along the sections times the same across the bands.
fn correlation(plate: &[BandSection]) -> f64 {
    let means: [f64; BANDS] = std::array::from_fn(|b| {
        plate.iter().map(|section| section.light[b]).sum::<f64>() / plate.len() as f64
    });
    let off = |k: usize, b: usize| (plate[k].light[b] - means[b]) / means[b].abs().max(1e-9);
    let mut none = 0.0;
    let mut beside = 0.0;
    for k in 0..plate.len() {
        none += (0..BANDS).map(|b| off(k, b).powi(2)).sum::<f64>();
        beside +=
            (1..BANDS).map(|b| off(k, b) * off(k, b - 1)).sum::<f64>() * BANDS as f64 / (BANDS - 1) as f64;
    }
    let mut along = 1.0;
    for lag in 1..plate.len() / 4 {
        let products = (lag..plate.len()).flat_map(|k| (0..BANDS).map(move |b| off(k, b) * off(k - lag, b)));
        let rho = products.sum::<f64>() / none.max(1e-12);
        if rho < 0.1 {
            break;
        }
        along += 2.0 * rho;
    }
    along * (1.0 + 2.0 * (beside / none.max(1e-12)).clamp(0.0, 1.0))
}
