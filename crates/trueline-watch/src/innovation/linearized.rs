//! One feature: its residual against a seam, and how everything that is unknown moves it.
//!
//! Local columns: θ (time offset, hand-eye rotation and translation, shape h₁ … h₅), the seam's (θ₂, θ₃, δ₂,
//! δ₃), and its bow (κ₂, κ₃). The seam is displaced by κ ((s/ℓ)² − ⅓) across, with s along it and ℓ half its
//! visible length.
//!
//! r = p − q, the measured minus the predicted point in the sheet. A change of shape moves p alone: with (a, b) the
//! sheet's coordinates from the shape's origin, ∂p/∂h = (a, 0), (0, b), (b, 0), −a (a, b), −b (a, b). The point of
//! the derivative matters. The error of p is the feature's, that of q the robot's, and r has both. A derivative that
//! shares an error with r is biased where the seam hardly moves in the sheet. The best estimate of the true point is
//! p − Σ_f Σ⁻¹ r, with Σ_f the feature's own covariance and Σ all of it. Its error is uncorrelated with r. All else
//! is that of [`trueline_model::sheet_residual`].

use crate::parameters::{CALIBRATION, SHAPE, TIME_OFFSET};
use nalgebra::{Matrix2, Matrix2x4, SMatrix, Vector2};
use trueline_geometry::Line;
use trueline_method::evaluate::placed_features::{PlacedFeature, PlacedFeatures};
use trueline_model::sheet_residual::{SeamInSheet, SeamJacobian};
use trueline_model::{Curvature, LaserSheet};

/// First local column of the seam.
pub const SEAM: usize = CALIBRATION;
/// First local column of the bow.
pub const BOW: usize = SEAM + 4;
/// Number of local columns.
pub const LOCAL: usize = BOW + 2;

/// A seam and how much of it is seen.
#[derive(Clone, Copy, Debug)]
pub struct Seam {
    /// The line.
    pub line: Line,
    /// Its bow, about the line's anchor.
    pub curvature: Curvature,
    /// Prior standard deviation of the bow, m.
    pub bow_sigma_m: f64,
}

impl Seam {
    /// A straight seam with half of its length, m; it may bow as seams do.
    #[must_use]
    pub fn straight(line: Line, half_length_m: f64) -> Self {
        let curvature = Curvature { bow_m: [0.0; 2], half_length_m, middle_m: 0.0 };
        Self { line, curvature, bow_sigma_m: curvature.prior_sigma_m() }
    }
}

/// A feature's residual and its derivatives.
#[derive(Clone, Debug)]
pub struct Linearized {
    /// p − q in the sheet, m.
    pub residual: Vector2<f64>,
    /// d r / d local columns.
    pub jacobian: SMatrix<f64, 2, LOCAL>,
    /// Covariance of the feature itself, m².
    pub covariance: Matrix2<f64>,
    /// How the errors that a whole image shares move it, for one standard deviation of each: robot x, y, z and stamp.
    pub shared: Matrix2x4<f64>,
}

impl Linearized {
    /// Covariance of the residual, m².
    #[must_use]
    pub fn total_covariance(&self) -> Matrix2<f64> {
        self.covariance + self.shared * self.shared.transpose()
    }
}

/// How the shape moves a point at sheet coordinates from the shape's origin (2×5).
#[must_use]
pub(crate) fn d_point_d_shape(at: &Vector2<f64>) -> SMatrix<f64, 2, 5> {
    let (a, b) = (at.x, at.y);
    SMatrix::<f64, 2, 5>::new(a, 0.0, b, -a * a, -b * a, 0.0, b, 0.0, -a * b, -b * b)
}

/// Linearizes one feature at the stored calibration and a seam; `None` if the seam runs along the sheet.
#[must_use]
pub fn linearized(
    of: &PlacedFeatures,
    feature: &PlacedFeature,
    seam: &Seam,
    shape_origin_m: [f64; 2],
) -> Option<Linearized> {
    let sheet: &LaserSheet = &of.sheet;
    let in_sheet = SeamInSheet { line: &seam.line, curvature: &seam.curvature, shape: None };
    let SeamJacobian { straight: parts, d_curvature, .. } =
        in_sheet.linearize(&feature.placement, sheet, &feature.point_in_camera)?;
    let (onto_sheet, links) = (parts.by_shift(), parts.by_links(&feature.placement));
    let mut shared = Matrix2x4::zeros();
    shared.fixed_columns_mut::<3>(0).copy_from(&(onto_sheet * of.noise.robot_sigma_m));
    shared.fixed_columns_mut::<1>(3).copy_from(&(links.column(TIME_OFFSET) * of.noise.stamp_sigma_s));
    let total = feature.covariance + shared * shared.transpose();
    let gain = feature.covariance * total.try_inverse()?;
    let best = sheet.coordinates(&feature.point_in_camera) - gain * parts.residual;
    let mut jacobian = SMatrix::<f64, 2, LOCAL>::zeros();
    jacobian.fixed_columns_mut::<SHAPE>(TIME_OFFSET).copy_from(&links);
    jacobian
        .fixed_columns_mut::<5>(SHAPE)
        .copy_from(&d_point_d_shape(&(best - Vector2::from(shape_origin_m))));
    jacobian.fixed_columns_mut::<4>(SEAM).copy_from(&parts.d_line);
    jacobian.fixed_columns_mut::<2>(BOW).copy_from(&d_curvature);
    Some(Linearized { residual: parts.residual, jacobian, covariance: feature.covariance, shared })
}
