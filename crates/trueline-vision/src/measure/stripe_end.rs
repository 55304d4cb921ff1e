//! Where the stripe on a plate ends, to a fraction of a pixel.
//!
//! The stripe is looked at in bands along it. In each, the light is that of the plate up to the edge and none
//! beyond; since the edge may cross the stripe at a slant, its place may differ from band to band in
//! proportion. Speckled light has a gamma distribution \[Goodman2007, §3\] whose shape is measured on the
//! plate: a dark grain before the edge is no surprise, a bright one beyond it is. Every place and slant has a
//! likelihood then, and the mean and spread of the places are the answer.

/// Bands across the stripe.
pub const BANDS: usize = 6;
/// Part of the stripe's reach that the bands cover, on each side of its middle.
pub const COVERED: f64 = 0.7;
/// Blur of the edge by lens and pixels, px.
const BLUR_PX: f64 = 0.9;
/// Sections further than this from a place are all plate or all nothing, px.
const SHARP_PX: f64 = 3.2;
/// Steps between the places that are tried, px: first all along, then near the best.
const STEPS_PX: [f64; 2] = [1.0, 0.25];
/// How far from the best first place the second search goes, px.
const NEAR_PX: f64 = 6.0;
/// Slants that are tried: px along for each px across.
const SLANTS: [f64; 9] = [-1.6, -1.1, -0.7, -0.35, 0.0, 0.35, 0.7, 1.1, 1.6];
/// Sections on the plate, and beyond its edge, that are needed.
const FEWEST: [usize; 2] = [8, 3];
/// What the shape of the step is uncertain by, px: blur that is not the one assumed, a seam that is not straight.
const MODEL_PX: f64 = 0.15;
/// The most even light that is believed: shape of the gamma distribution.
const EVENEST: f64 = 10.0;
/// Light beyond the edge is taken to be at least this part of the plate's: lenses stray some.
const LEAST_DARK: f64 = 0.03;
/// Part of the plate's light that may be left beyond an edge.
const LEFT: f64 = 0.5;

/// The light of one section through the stripe, band by band, in levels.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BandSection {
    /// Distance along the line, px.
    pub s: f64,
    /// Mean light of each band, from the negative side of the line's normal to the positive.
    pub light: [f64; BANDS],
}

/// An edge of the stripe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Edge {
    /// Where it crosses the line, along it, px.
    pub s: f64,
    /// Its standard deviation, px.
    pub sigma_px: f64,
}

/// One band: its light on the plate and beyond, and the sums of costs along it.
#[derive(Clone, Debug, Default)]
struct Band {
    distance_px: f64,
    plate: f64,
    dark: f64,
    shape: f64,
    light: Vec<f64>,
    /// Cost of all sections before each, were they plate; of all before each, were they dark.
    as_plate: Vec<f64>,
    as_dark: Vec<f64>,
}

/// Finds ends of stripes; memory is kept from one to the next.
#[derive(Clone, Debug, Default)]
pub struct EndFinder {
    /// The light that is looked at, by rising distance along the line.
    pub sections: Vec<BandSection>,
    bands: [Band; BANDS],
    stations: Vec<f64>,
    costs: Vec<(f64, f64)>,
}

impl EndFinder {
    /// The end of the stripe in `sections`: light before, none after. The edge is looked for within `search` (px);
    /// `width_px` is that of a band, and `used` says which bands are looked at.
    ///
    /// `None` if the light does not end there, or too little of it is seen on either side.
    pub fn end(&mut self, search: [f64; 2], width_px: f64, used: [bool; BANDS]) -> Option<Edge> {
        let first = self.sections.partition_point(|section| section.s < search[0]);
        let last = self.sections.partition_point(|section| section.s <= search[1]);
        if first < FEWEST[0] || self.sections.len() - last < FEWEST[1] {
            return None;
        }
        for (number, band) in self.bands.iter_mut().enumerate().filter(|(number, _)| used[*number]) {
            band.measure(&self.sections, number, [first, last], width_px)?;
        }
        self.stations.clear();
        self.stations.extend(self.sections[first..last].iter().map(|section| section.s));
        let correlation = correlation(&self.sections[..first]);
        let rough = self.weigh([search[0], search[1], STEPS_PX[0]], used, correlation);
        let reach = NEAR_PX.max(4.0 * rough.sigma_px);
        let near = [(rough.s - reach).max(search[0]), (rough.s + reach).min(search[1]), STEPS_PX[1]];
        Some(self.weigh(near, used, correlation))
    }

    /// Mean and spread of the places, each with its likelihood exp(−cost / 2), summed over slants.
    fn weigh(&mut self, [from, to, step]: [f64; 3], used: [bool; BANDS], correlation: f64) -> Edge {
        let places = ((to - from) / step) as usize + 1;
        self.costs.clear();
        for slant in SLANTS {
            for k in 0..places {
                let place = from + k as f64 * step;
                let bands = self.bands.iter().zip(used).filter(|(_, used)| *used);
                let costs =
                    bands.map(|(band, _)| band.cost_of(&self.stations, place + slant * band.distance_px));
                self.costs.push((place, costs.sum::<f64>() / correlation));
            }
        }
        let least = self.costs.iter().fold(f64::INFINITY, |least, (_, cost)| least.min(*cost));
        let (mut total, mut mean, mut square) = (0.0, 0.0, 0.0);
        for (place, cost) in &self.costs {
            let weight = (-0.5 * (cost - least)).exp();
            total += weight;
            mean += weight * (place - from);
            square += weight * (place - from).powi(2);
        }
        let (mean, square) = (mean / total, square / total);
        let variance = (square - mean * mean).max(0.0) + step * step / 12.0;
        Edge { s: from + mean, sigma_px: (variance + MODEL_PX * MODEL_PX).sqrt() }
    }
}

impl Band {
    /// Takes over a band's light; `None` if it does not fall from the plate to what is beyond.
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
        self.light.extend(sections[first..last].iter().map(light));
        let (mut plates, mut darks) = (0.0, 0.0);
        self.as_plate.clear();
        self.as_dark.clear();
        for k in 0..=self.light.len() {
            self.as_plate.push(plates);
            self.as_dark.push(darks);
            if let Some(light) = self.light.get(k) {
                plates += self.cost(*light, 1.0);
                darks += self.cost(*light, 0.0);
            }
        }
        Some(())
    }

    /// Twice the negative logarithm of a gamma distribution, where a part of the plate's light falls.
    fn cost(&self, light: f64, part: f64) -> f64 {
        let mean = self.plate * part + self.dark;
        2.0 * self.shape * (mean.ln() + (light.max(0.0) + self.dark) / mean)
    }

    /// Cost of an edge at a place.
    fn cost_of(&self, stations: &[f64], place: f64) -> f64 {
        let from = stations.partition_point(|s| *s < place - SHARP_PX);
        let to = stations.partition_point(|s| *s <= place + SHARP_PX);
        let mixed = (from..to).map(|k| self.cost(self.light[k], lit((place - stations[k]) / BLUR_PX)));
        self.as_plate[from] + mixed.sum::<f64>() + self.as_dark[stations.len()] - self.as_dark[to]
    }
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
