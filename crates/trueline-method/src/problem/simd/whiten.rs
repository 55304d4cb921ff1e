//! The whiteners of all observations for given noise levels.

use super::displacement_rows::DisplacementRows;
use super::lanes::{Lanes, WIDTH};
use super::samples::Samples;
use super::sweep::Visit;
use super::view::{Modelled, Seen};
use crate::input::noise_levels::{NoiseLevels, Whitener};
use crate::input::observations::Observation;

/// Collects whiteners of [`NoiseLevels::covariance`], four at once.
pub(crate) struct Whitening<'a> {
    list: &'a [Observation],
    noise: NoiseLevels,
    /// One for each observation. The coarse one if it cannot be placed.
    pub whiteners: Vec<Whitener>,
}

impl<'a> Whitening<'a> {
    /// No values yet.
    pub(crate) fn new(list: &'a [Observation], noise: &NoiseLevels) -> Self {
        let whiteners = vec![Whitener([0.0; 3]); list.len()];
        Self { list, noise: *noise, whiteners }
    }

    fn coarse(&mut self, index: usize) {
        self.whiteners[index] = self.noise.coarse_whitener(self.list[index].covariance);
    }
}

impl Visit for Whitening<'_> {
    const TO_LINE: bool = false;

    #[inline(always)]
    fn samples<const FUSED: bool, M: Modelled>(
        &mut self,
        _line: usize,
        samples: &Samples,
        seen: &Seen<FUSED, M::Rows<FUSED>>,
    ) {
        let mut feature = [[0.0; WIDTH]; 3];
        for lane in 0..WIDTH {
            let covariance = self.list[samples.index[lane] as usize].covariance;
            for (target, value) in feature.iter_mut().zip(covariance) {
                target[lane] = value;
            }
        }
        let splat = Lanes::<FUSED>::splat;
        let (robot, stamp) =
            (splat(self.noise.robot_sigma_m.powi(2)), splat(self.noise.stamp_sigma_s.powi(2)));
        let ([by_x, by_y], by_robot) = (seen.by_time_offset(), seen.rows.products());
        let by_stamp = [by_x * by_x, by_x * by_y, by_y * by_y];
        let entry =
            |k: usize| Lanes(feature[k]).plus_product(robot, by_robot[k]).plus_product(stamp, by_stamp[k]);
        let (xx, xy, yy) = (entry(0), entry(1), entry(2));
        // The Cholesky factor of Σ, inverted: see `Whitener::of`.
        let factor = splat(self.noise.factor);
        let l11 = xx.sqrt();
        let l21 = xy / l11;
        let l22 = (yy - l21 * l21).sqrt();
        let w11 = splat(1.0) / (l11 * factor);
        let w21 = -(l21 / (l11 * l22 * factor));
        let w22 = splat(1.0) / (l22 * factor);
        for lane in 0..samples.count as usize {
            let index = samples.index[lane] as usize;
            let values = [w11, w21, w22].map(|w| w.0[lane]);
            if seen.usable[lane] && values.iter().all(|w| w.is_finite()) {
                self.whiteners[index] = Whitener(values.map(|w| w as f32));
            } else {
                self.coarse(index);
            }
        }
    }

    #[inline(always)]
    fn unplaced(&mut self, index: usize) {
        self.coarse(index);
    }
}
