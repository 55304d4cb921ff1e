//! Robust losses, four at once. The scalar form is [`trueline_lsq::Loss`].

use super::lanes::Lanes;
use trueline_lsq::Loss;

/// ρ and the weight ρ′ of squared residuals.
#[inline(always)]
pub(super) fn weigh<const FUSED: bool>(loss: Loss, squared: Lanes<FUSED>) -> (Lanes<FUSED>, Lanes<FUSED>) {
    let splat = Lanes::splat;
    match loss {
        Loss::Squared => (squared, splat(1.0)),
        Loss::GemanMcClure { scale } => {
            let falling = splat(1.0) / splat(1.0).plus_product(squared, splat(1.0 / (scale * scale)));
            (squared * falling, falling * falling)
        }
        Loss::Tukey { scale } => {
            let c2 = scale * scale;
            let mut left = splat(1.0).plus_product(squared, splat(-1.0 / c2));
            for l in &mut left.0 {
                *l = l.max(0.0);
            }
            let weight = left * left;
            (splat(c2 / 3.0) * (splat(1.0) - weight * left), weight)
        }
        Loss::Huber { .. } | Loss::Cauchy { .. } => {
            (squared.map(|s| loss.value(s)), squared.map(|s| loss.weight(s)))
        }
    }
}
