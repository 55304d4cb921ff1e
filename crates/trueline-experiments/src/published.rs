//! The paper's published figures, for comparison with simulated ones.

use nalgebra::Vector3;
use trueline_geometry::{OrthonormalLine, so3};

/// A row of Table I \[Yang2025\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PublishedRow {
    /// The method as the paper names it.
    pub method: &'static str,
    /// Calibration time, s: "within".
    pub within_s: f64,
    /// RMSE, m.
    pub rmse_m: f64,
    /// MAE, m.
    pub mae_m: f64,
    /// Remark on its oddity.
    pub remark: &'static str,
}

/// Table I \[Yang2025\].
pub const TABLE_I: [PublishedRow; 3] = [
    PublishedRow { method: "Proposed method", within_s: 60.0, rmse_m: 0.173e-3, mae_m: 0.112e-3, remark: "" },
    PublishedRow {
        method: "Proposed method w/o temporal calibration",
        within_s: 60.0,
        rmse_m: 1.17e-3,
        mae_m: 1.24e-3,
        remark: "as printed; no data have a mean above their root mean square, and 1.17 mm are 6.76 times 0.173 mm, not the 5.76 of \
                 the text",
    },
    PublishedRow {
        method: "Fast calibration [34]",
        within_s: 120.0,
        rmse_m: 0.163e-3,
        mae_m: 0.155e-3,
        remark: "",
    },
];

/// RMSE of the straight weld with the time offset compensated, m (Fig. 9).
pub const STRAIGHT_RMSE_M: f64 = 0.17e-3;
/// Start of the paper's line: ω of φ₀ = [ω, m], rad.
pub const LINE_START_RAD: [f64; 3] = [0.169084, -0.000782, 0.0197593];
/// And its distance from the base's origin, m.
pub(crate) const LINE_START_M: f64 = 1.15286;

/// The paper's φ₀.
#[must_use]
pub(crate) fn line_start() -> OrthonormalLine {
    OrthonormalLine { rotation: so3::exp(&Vector3::from(LINE_START_RAD)), distance: LINE_START_M }
}

/// Time offset that the real scan converged to, s (Fig. 6).
pub const TIME_OFFSET_S: f64 = 0.01773;
/// RMSE that it converged to, m (Fig. 6; the repository's own figure shows 0.32751 mm).
pub const RMSE_M: f64 = 0.32715e-3;
/// Largest error of the hand-eye translation, m (Sect. IV-A).
pub const TRANSLATION_ERROR_M: f64 = 0.20e-3;
/// Largest error of the time offset, s (Sect. IV-A).
pub(crate) const TIME_OFFSET_ERROR_S: f64 = 1e-3;
