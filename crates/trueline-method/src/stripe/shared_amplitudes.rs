//! Noise of seam points that lasts from one to the next: stripes of the same frames have it too.

use crate::adjustment::answer::Amplitudes;
use crate::problem::unknowns::LINES;
use nalgebra::DMatrix;

/// Noise of seam points that lasts from one to the next; so does that of the stripes of the same frames, which are estimated as if it were white.
#[derive(Clone, Copy, Debug)]
pub struct Lasting {
    /// How many times the variance of white noise it makes.
    pub variance: f64,
    /// Whether most of the noise lasts.
    pub is_most: bool,
}

impl Lasting {
    /// All of it is white.
    pub const NOT: Self = Self { variance: 1.0, is_most: false };

    /// Of adjusted seam points whose covariance by noise is the first, where white noise alone would make it the second.
    #[must_use]
    pub(crate) fn of(amplitudes: &Amplitudes, noise: &DMatrix<f64>, white: &DMatrix<f64>) -> Self {
        Self { variance: times(noise, white), is_most: amplitudes.noise_lasts() }
    }
}

/// How many times as large one covariance of clock and hand-eye is as another, on the average over their components; 1 at least.
fn times(one: &DMatrix<f64>, other: &DMatrix<f64>) -> f64 {
    let of_component = (0..LINES).filter(|k| one[(*k, *k)] > 0.0 && other[(*k, *k)] > 0.0);
    let logs: Vec<f64> = of_component.map(|k| (one[(k, k)] / other[(k, k)]).ln()).collect();
    (logs.iter().sum::<f64>() / logs.len().max(1) as f64).exp().max(1.0)
}
