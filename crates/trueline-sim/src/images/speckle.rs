//! Speckle: the intensity of a random complex field of limited bandwidth.
//!
//! A field with a real and an imaginary part of white noise smoothed by a Gaussian of σ has the correlation
//! exp(−r²/4σ²). Its intensity is exponentially distributed with the square of that, exp(−r²/2σ²), as the covariance
//! of its unit mean \[Goodman2007, §3\].

use crate::noise::Noise;

const WIDTH: usize = 4096;
const HEIGHT: usize = 1024;

/// A periodic pattern, entered at a random place for each picture.
#[derive(Clone, Debug)]
pub(crate) struct Speckle {
    intensity: Vec<f32>,
}

impl Speckle {
    /// The pattern of a contrast and a correlation length (1/e of the intensity's covariance), px.
    #[must_use]
    pub(crate) fn new(contrast: f64, length_px: f64, seed: u64) -> Self {
        let mut noise = Noise::new(seed, 10);
        let kernel = kernel(length_px / std::f64::consts::SQRT_2);
        let mut intensity = vec![0.0_f32; WIDTH * HEIGHT];
        for _part in 0..2 {
            let white: Vec<f32> = (0..WIDTH * HEIGHT).map(|_| noise.normal(1.0) as f32).collect();
            let field = smoothed(&white, &kernel);
            for (sum, value) in intensity.iter_mut().zip(&field) {
                *sum += value * value;
            }
        }
        // The kernel keeps the variance of white noise at one, so that the sum of two squares has mean two.
        for value in &mut intensity {
            *value = 1.0 + contrast as f32 * (0.5 * *value - 1.0);
        }
        Self { intensity }
    }

    /// Factor of the brightness at a pixel, with a place where the picture's corner lies in the pattern.
    #[must_use]
    pub(crate) fn at(&self, column: usize, row: usize, corner: [usize; 2]) -> f32 {
        let (x, y) = ((column + corner[0]) % WIDTH, (row + corner[1]) % HEIGHT);
        self.intensity[y * WIDTH + x]
    }

    /// A place for a picture's corner.
    pub(crate) fn corner(noise: &mut Noise) -> [usize; 2] {
        [WIDTH, HEIGHT].map(|n| noise.uniform(0.0, n as f64) as usize)
    }
}

/// Gaussian taps with squares that sum to one along each axis.
fn kernel(sigma_px: f64) -> Vec<f32> {
    let reach = (4.0 * sigma_px).ceil() as i64;
    let taps: Vec<f64> = (-reach..=reach).map(|k| (-0.5 * (k as f64 / sigma_px).powi(2)).exp()).collect();
    let norm = taps.iter().map(|t| t * t).sum::<f64>().sqrt();
    taps.iter().map(|t| (t / norm) as f32).collect()
}

fn smoothed(white: &[f32], kernel: &[f32]) -> Vec<f32> {
    let reach = kernel.len() / 2;
    let mut across = vec![0.0_f32; white.len()];
    for (row, out) in white.chunks_exact(WIDTH).zip(across.chunks_exact_mut(WIDTH)) {
        for (k, tap) in kernel.iter().enumerate() {
            for (x, value) in out.iter_mut().enumerate() {
                *value += tap * row[(x + k + WIDTH - reach) % WIDTH];
            }
        }
    }
    let mut both = vec![0.0_f32; white.len()];
    for (y, out) in both.chunks_exact_mut(WIDTH).enumerate() {
        for (k, tap) in kernel.iter().enumerate() {
            let source = (y + k + HEIGHT - reach) % HEIGHT * WIDTH;
            for (value, input) in out.iter_mut().zip(&across[source..source + WIDTH]) {
                *value += tap * input;
            }
        }
    }
    both
}
