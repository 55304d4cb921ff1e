//! Comparison of two cameras from two halves of the pictures, relative to their uncertainties.

use super::distortion_model::DistortionModel;
use super::field::{Field, Sensitivity};
use super::fit::{CameraFit, FEWEST_PICTURES, fit};
use crate::board::{Board, View};
use crate::projection::{CAMERA_SIZE, to_vector};
use nalgebra::{DMatrix, DVector};

/// The comparison of two halves.
#[derive(Clone, Debug)]
pub struct CrossValidation {
    /// How far pixels of one half's camera are from the other's, freed of rotation.
    pub difference: Field,
    /// Difference expected from the two covariances, root mean square over the picture, px.
    pub expected_px: f64,
    /// Squared difference of all parameters by the covariance of that difference, over their number: near one where the
    /// stated covariance is honest.
    pub normalized: f64,
    /// Number of parameters.
    pub parameters: usize,
}

/// Halves that differ by more than this multiple of the expected difference are not explained by chance.
pub const AGREES: f64 = 1.5;

/// Standard deviations that a normal number exceeds once in 1000.
const ONCE_IN_1000: f64 = 3.09;

impl CrossValidation {
    /// Whether the probability of such a difference of all parameters by noise is below 1 in 1000: χ² by its cube root,
    /// which is nearly normal \[WilsonHilferty1931\]. A few pictures may by chance differ by twice their expectation.
    #[must_use]
    pub fn is_beyond_chance(&self) -> bool {
        let spread = 2.0 / (9.0 * self.parameters as f64);
        self.normalized.cbrt() - (1.0 - spread) > ONCE_IN_1000 * spread.sqrt()
    }

    /// The difference of the halves as a part of its expectation.
    #[must_use]
    pub fn ratio(&self) -> f64 {
        self.difference.rms_px() / self.expected_px
    }
}

/// Fits the even and the odd pictures apart. `None` if there are too few pictures for that, or one half does not fix
/// the camera.
#[must_use]
pub fn halves(
    size: [u32; 2],
    board: &Board,
    views: &[View],
    model: DistortionModel,
) -> Option<CrossValidation> {
    if views.len() < 2 * FEWEST_PICTURES {
        return None;
    }
    let half = |remainder: usize| -> Option<CameraFit> {
        let chosen: Vec<View> = views.iter().skip(remainder).step_by(2).cloned().collect();
        fit(size, board, &chosen, Some(model)).ok()
    };
    let (even, odd) = (half(0)?, half(1)?);
    let difference = to_vector(&even.state.camera) - to_vector(&odd.state.camera);
    let covariance = even.covariance + odd.covariance;
    let free: Vec<usize> = (0..CAMERA_SIZE).filter(|k| covariance[(*k, *k)] > 0.0).collect();
    let of_free = DMatrix::from_fn(free.len(), free.len(), |i, j| covariance[(free[i], free[j])]);
    let step = DVector::from_iterator(free.len(), free.iter().map(|k| difference[*k]));
    let normalized = step.dot(&of_free.cholesky()?.solve(&step)) / free.len() as f64;
    let sensitivity = Sensitivity::of(&even.state.camera);
    // Both axes together, as the difference is.
    let expected_px = sensitivity.uncertainty(&covariance).rms_px() * std::f64::consts::SQRT_2;
    Some(CrossValidation {
        difference: sensitivity.movement(&difference),
        expected_px,
        normalized,
        parameters: free.len(),
    })
}
