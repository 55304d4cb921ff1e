//! Selection of the distortion model by the pictures.

use crate::projection::CAMERA_SIZE;

/// A family of lens distortions, each holding the one before.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum DistortionModel {
    /// None.
    None,
    /// Radial k₁.
    K1,
    /// Radial k₁, k₂.
    K1K2,
    /// Radial k₁, k₂ and tangential p₁, p₂.
    K1K2P1P2,
    /// All five: k₁, k₂, p₁, p₂, k₃.
    Five,
}

impl DistortionModel {
    /// All, from the simplest.
    pub const ALL: [Self; 5] = [Self::None, Self::K1, Self::K1K2, Self::K1K2P1P2, Self::Five];

    /// The coefficients in words.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::K1 => "k1",
            Self::K1K2 => "k1,k2",
            Self::K1K2P1P2 => "k1,k2,p1,p2",
            Self::Five => "k1,k2,p1,p2,k3",
        }
    }

    /// Number of coefficients.
    #[must_use]
    pub fn size(self) -> usize {
        match self {
            Self::None => 0,
            Self::K1 => 1,
            Self::K1K2 => 2,
            Self::K1K2P1P2 => 4,
            Self::Five => 5,
        }
    }

    /// Camera parameters that the model holds at zero.
    #[must_use]
    pub fn fixed(self) -> Vec<usize> {
        (4 + self.size()..CAMERA_SIZE).collect()
    }
}

/// Fit of one model to the pictures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Evidence {
    /// The model.
    pub model: DistortionModel,
    /// Root mean square distance of corners from where the model puts them, px.
    pub rms_px: f64,
    /// n ln(Σr²/n) + 2 × coefficients, with n residuals \[Akaike1974\]: the least is the one that predicts best.
    pub akaike: f64,
}

impl Evidence {
    /// The evidence of `residuals` numbers with a sum of squares in px², which `coefficients` numbers were fitted to.
    #[must_use]
    pub fn new(model: DistortionModel, coefficients: usize, sum_of_squares: f64, residuals: usize) -> Self {
        let n = residuals as f64;
        Self {
            model,
            // Two numbers for each corner.
            rms_px: (2.0 * sum_of_squares / n).sqrt(),
            akaike: n * (sum_of_squares / n).ln() + 2.0 * coefficients as f64,
        }
    }
}
