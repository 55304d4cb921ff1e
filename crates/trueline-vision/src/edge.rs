//! Where the stripe on a plate ends, to a fraction of a pixel.
//!
//! The amplitude along the stripe is that of the plate up to the edge and none beyond, blurred by the lens.
//! Speckle makes it vary by its own size where there is light and hardly where there is none: with both
//! variances measured, every place of the edge has a likelihood, and its mean and spread are the answer.

use crate::stripe::Cut;

/// Blurs of the edge that are tried, px: the lens blurs little, but a seam that crosses the stripe at a slant
/// ends it at one flank before the other.
const BLURS_PX: [f64; 6] = [0.7, 1.1, 1.7, 2.6, 4.0, 6.0];
/// Cuts further than this many blurs from a place are all plate or all nothing.
const SHARP: f64 = 3.5;
/// Step between the places that are tried, px.
const STEP_PX: f64 = 0.2;
/// Cuts on each side that an edge needs.
const FEWEST: usize = 10;

/// An edge of the stripe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Edge {
    /// Where, along the line, px.
    pub s: f64,
    /// Its standard deviation, px.
    pub sigma_px: f64,
}

/// The end of the stripe: light before, none after. `cuts` rise along the line; the edge is looked for
/// within `search` (px).
#[must_use]
pub fn end(cuts: &[Cut], search: [f64; 2]) -> Option<Edge> {
    let before: Vec<f64> = amplitudes(cuts, |s| s < search[0]);
    let after: Vec<f64> = amplitudes(cuts, |s| s > search[1]);
    if before.len() < FEWEST || after.len() < FEWEST {
        return None;
    }
    let (plate, spread) = mean_and_variance(&before);
    let (rest, dark) = mean_and_variance(&after);
    // An edge is where the light goes out.
    if rest > 0.5 * plate {
        return None;
    }
    let (spread, dark) = (spread + 1e-4 * plate * plate, dark + 1e-4 * plate * plate);
    let correlation = correlation(&before);
    let cost = |cut: &Cut, light: f64| {
        let variance = spread * light * light + dark;
        (cut.own_amplitude - rest - (plate - rest) * light).powi(2) / variance + variance.ln()
    };
    let near: Vec<&Cut> = cuts.iter().filter(|cut| (search[0]..=search[1]).contains(&cut.s)).collect();
    // Cost of the cuts before each, if all of them are plate, and of those from each on, if none is.
    let sums = |light: f64| -> Vec<f64> {
        let mut sum = 0.0;
        let mut sums = vec![0.0];
        for cut in &near {
            sum += cost(cut, light);
            sums.push(sum);
        }
        sums
    };
    let (plates, rests) = (sums(1.0), sums(0.0));
    let places = ((search[1] - search[0]) / STEP_PX) as usize;
    let mut costs = Vec::with_capacity(BLURS_PX.len() * (places + 1));
    for blur_px in BLURS_PX {
        for k in 0..=places {
            let place = search[0] + k as f64 * STEP_PX;
            let from = near.partition_point(|cut| cut.s < place - SHARP * blur_px);
            let to = near.partition_point(|cut| cut.s <= place + SHARP * blur_px);
            let mixed: f64 = near[from..to].iter().map(|cut| cost(cut, light((place - cut.s) / blur_px))).sum();
            let total = plates[from] + mixed + rests[near.len()] - rests[to];
            costs.push((place, total / correlation));
        }
    }
    Some(weigh(&costs))
}

/// Mean and spread of the places, each with the likelihood exp(−cost / 2).
fn weigh(costs: &[(f64, f64)]) -> Edge {
    let least = costs.iter().fold(f64::INFINITY, |least, (_, cost)| least.min(*cost));
    let weight = |cost: f64| (-0.5 * (cost - least)).exp();
    let total: f64 = costs.iter().map(|(_, cost)| weight(*cost)).sum();
    let s = costs.iter().map(|(place, cost)| place * weight(*cost)).sum::<f64>() / total;
    let variance = costs.iter().map(|(place, cost)| (place - s).powi(2) * weight(*cost)).sum::<f64>() / total;
    Edge { s, sigma_px: (variance + STEP_PX * STEP_PX / 12.0).sqrt() }
}

/// Part of the plate's light at a number of blurs before the edge: a smooth step, within 0.01 of the normal one.
fn light(before: f64) -> f64 {
    1.0 / (1.0 + (-1.702 * before).exp())
}

fn amplitudes(cuts: &[Cut], which: impl Fn(f64) -> bool) -> Vec<f64> {
    cuts.iter().filter(|cut| which(cut.s)).map(|cut| cut.own_amplitude).collect()
}

fn mean_and_variance(values: &[f64]) -> (f64, f64) {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    (mean, values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (count - 1.0))
}

/// 1 + 2 Σ ρ_k over the first neighbours: speckle is wider than a pixel.
fn correlation(values: &[f64]) -> f64 {
    let (mean, variance) = mean_and_variance(values);
    let mut sum = 1.0;
    for lag in 1..values.len() / 4 {
        let products = values.windows(lag + 1).map(|pair| (pair[0] - mean) * (pair[lag] - mean));
        let rho = products.sum::<f64>() / (values.len() as f64 * variance).max(1e-12);
        if rho < 0.1 {
            break;
        }
        sum += 2.0 * rho;
    }
    sum
}
