//! Error sizes from the adjusted seam points. The stripes come from the same frames and have the same errors.

use crate::adjustment::error_sizes::Amplitudes;
use crate::problem::unknowns::LINES;
use nalgebra::DMatrix;

/// Sizes of errors that stripes share with the seam points of their frames. The stripes themselves are estimated with white noise.
#[derive(Clone, Copy, Debug)]
pub struct SharedAmplitudes {
    /// Ratio of the variance with correlated noise to that with white noise.
    pub noise_variance: f64,
    /// Whether most of the noise is correlated.
    pub noise_lasts: bool,
    /// Robot error relative to its class.
    pub robot: f64,
    /// Standard deviation of the seam's form beyond its bow, in one direction, m.
    pub form_sigma_m: f64,
}

impl SharedAmplitudes {
    /// Expected sizes, with white noise.
    pub const EXPECTED: Self =
        Self { noise_variance: 1.0, noise_lasts: false, robot: 1.0, form_sigma_m: 0.0 };

    /// From adjusted seam points, with their noise covariance, and that from white noise alone.
    #[must_use]
    pub(crate) fn of(amplitudes: &Amplitudes, noise: &DMatrix<f64>, white: &DMatrix<f64>) -> Self {
        Self {
            noise_variance: times(noise, white),
            noise_lasts: amplitudes.noise_lasts(),
            robot: amplitudes.robot.unwrap_or(1.0),
            form_sigma_m: amplitudes.form_sigma_m,
        }
    }
}

/// Ratio of two covariances of clock and hand-eye, as the geometric mean over components. At least 1.
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
        // The geometric mean of ratios 4 and 9 is 6 for two components. Here LINES components share it.
        lasting[(0, 0)] = 9.0;
        let expected = (((LINES - 1) as f64 * 4f64.ln() + 9f64.ln()) / LINES as f64).exp();
        assert!((times(&lasting, &white) - expected).abs() < 1e-12);
        assert_eq!(times(&white, &lasting), 1.0);
        // A held component has no variance.
        lasting[(1, 1)] = 0.0;
        assert!(times(&lasting, &white) > expected);
    }
}
