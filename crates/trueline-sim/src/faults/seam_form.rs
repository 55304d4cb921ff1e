//! Seams that are not straight.

use super::fault::{Fault, SeamForm};
use crate::noise::Noise;
use crate::scenario::Scenario;
use nalgebra::Vector3;

/// Displacement of the seam from its straight line, by the place on it.
pub(crate) struct SeamForms {
    /// Unit vectors in base: sideways, and towards the sensor.
    axes: [Vector3<f64>; 2],
    half_length_m: f64,
    sagitta_m: [f64; 2],
    wobbles: Vec<Wobble>,
}

impl SeamForms {
    pub(crate) fn of(scenario: &Scenario, faults: &[Fault], seed: u64) -> Self {
        let along = scenario.seam_direction();
        let approach = scenario.cell.approach.into_inner();
        let height = (along * along.dot(&approach) - approach).normalize();
        let mut forms = Self {
            axes: [along.cross(&height), height],
            half_length_m: 0.5 * scenario.scan.length_m,
            sagitta_m: [0.0; 2],
            wobbles: Vec::new(),
        };
        for (index, fault) in faults.iter().enumerate() {
            match *fault {
                Fault::Seam(SeamForm::BowAcross { sagitta_m }) => forms.sagitta_m[0] += sagitta_m,
                Fault::Seam(SeamForm::BowHeight { sagitta_m }) => forms.sagitta_m[1] += sagitta_m,
                Fault::Seam(SeamForm::Wobble { sigma_m, correlation_length_m }) => {
                    let noise = Noise::for_fault(seed, index);
                    let reach_m = forms.half_length_m + WOBBLE_MARGIN_M;
                    forms.wobbles.push(Wobble::new(
                        noise,
                        [sigma_m, 0.5 * sigma_m],
                        correlation_length_m,
                        reach_m,
                    ));
                }
                _ => {}
            }
        }
        forms
    }

    pub(crate) fn is_straight(&self) -> bool {
        self.sagitta_m == [0.0; 2] && self.wobbles.is_empty()
    }

    /// Displacement in base of the seam at a place along the line, counted from the middle of the scan, m.
    pub(crate) fn displacement(&self, along_m: f64) -> Vector3<f64> {
        let mut both = [0, 1].map(|axis| arc(self.sagitta_m[axis], self.half_length_m, along_m));
        for wobble in &self.wobbles {
            let [across, height] = wobble.at(along_m);
            both[0] += across;
            both[1] += height;
        }
        self.axes[0] * both[0] + self.axes[1] * both[1]
    }

    /// A displacement across the seam and in height, in base.
    pub(crate) fn in_base(&self, [across_m, height_m]: [f64; 2]) -> Vector3<f64> {
        self.axes[0] * across_m + self.axes[1] * height_m
    }
}

/// Height of a circular arc over the tangent in its middle, m.
fn arc(sagitta_m: f64, half_length_m: f64, along_m: f64) -> f64 {
    if sagitta_m == 0.0 {
        return 0.0;
    }
    let radius_m = 0.5 * (half_length_m * half_length_m / sagitta_m + sagitta_m);
    radius_m - radius_m.signum() * (radius_m * radius_m - along_m * along_m).max(0.0).sqrt()
}

/// The scan's own swings reach beyond its length by less than this, m.
const WOBBLE_MARGIN_M: f64 = 0.25;
/// Steps of the table in a correlation length.
const STEPS: f64 = 20.0;

/// An Ornstein–Uhlenbeck process of the place, tabulated.
pub(crate) struct Wobble {
    start_m: f64,
    step_m: f64,
    values_m: Vec<[f64; 2]>,
}

impl Wobble {
    pub(crate) fn new(mut noise: Noise, sigma_m: [f64; 2], correlation_length_m: f64, reach_m: f64) -> Self {
        let step_m = correlation_length_m / STEPS;
        let keep = (-1.0 / STEPS).exp();
        let fresh = (1.0 - keep * keep).sqrt();
        let mut value = sigma_m.map(|sigma| noise.normal(sigma));
        let count = (2.0 * reach_m / step_m).ceil() as usize + 2;
        let values_m = (0..count)
            .map(|_| {
                let now = value;
                value = [0, 1].map(|axis| keep * value[axis] + noise.normal(fresh * sigma_m[axis]));
                now
            })
            .collect();
        Self { start_m: -reach_m, step_m, values_m }
    }

    pub(crate) fn at(&self, along_m: f64) -> [f64; 2] {
        let last = self.values_m.len() - 2;
        let position = ((along_m - self.start_m) / self.step_m).clamp(0.0, last as f64 + 1.0);
        let index = (position.floor() as usize).min(last);
        let part = position - index as f64;
        let [from, to] = [self.values_m[index], self.values_m[index + 1]];
        [0, 1].map(|axis| from[axis] + part * (to[axis] - from[axis]))
    }
}
