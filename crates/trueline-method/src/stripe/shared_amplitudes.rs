//! Sizes of errors by the adjusted seam points. The stripes are of the same frames, and have the same errors.

use crate::adjustment::answer::Amplitudes;
use crate::problem::unknowns::LINES;
use nalgebra::DMatrix;

/// Sizes of errors that stripes share with the seam points of their frames: they are estimated as if their noise were white.
#[derive(Clone, Copy, Debug)]
pub struct SharedAmplitudes {
    /// How many times as large the variance is by noise that lasts.
    pub noise_variance: f64,
    /// Whether most of the noise lasts.
    pub noise_lasts: bool,
    /// How many times as far off as its class the robot is.
    pub robot: f64,
}

impl SharedAmplitudes {
    /// All of them as expected, with white noise.
    pub const EXPECTED: Self = Self { noise_variance: 1.0, noise_lasts: false, robot: 1.0 };

    /// Of adjusted seam points whose covariance by noise is the first, where white noise alone would make it the second.
    #[must_use]
    pub(crate) fn of(amplitudes: &Amplitudes, noise: &DMatrix<f64>, white: &DMatrix<f64>) -> Self {
        Self {
            noise_variance: times(noise, white),
            noise_lasts: amplitudes.noise_lasts(),
            robot: amplitudes.robot.unwrap_or(1.0),
        }
    }
}

/// How many times as large one covariance of clock and hand-eye is as another, on the average over their components; 1 at least.
fn times(one: &DMatrix<f64>, other: &DMatrix<f64>) -> f64 {
    let of_component = (0..LINES).filter(|k| one[(*k, *k)] > 0.0 && other[(*k, *k)] > 0.0);
    let logs: Vec<f64> = of_component.map(|k| (one[(k, k)] / other[(k, k)]).ln()).collect();
    (logs.iter().sum::<f64>() / logs.len().max(1) as f64).exp().max(1.0)
}

#[cfg(test)]
mod tests {
    use super::times;
    use crate::problem::unknowns::LINES;
    use nalgebra::DMatrix;

    #[test]
    fn noise_that_lasts_widens_and_never_narrows() {
        let white = DMatrix::<f64>::identity(LINES, LINES);
        let mut lasting = &white * 4.0;
        // 4 and 9 times a variance are 6 times it on the geometric average of two, but LINES components share it.
        lasting[(0, 0)] = 9.0;
        let expected = (((LINES - 1) as f64 * 4f64.ln() + 9f64.ln()) / LINES as f64).exp();
        assert!((times(&lasting, &white) - expected).abs() < 1e-12);
        assert_eq!(times(&white, &lasting), 1.0);
        // What is held has no variance.
        lasting[(1, 1)] = 0.0;
        assert!(times(&lasting, &white) > expected);
    }
}
