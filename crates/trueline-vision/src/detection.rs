//! Findings in a picture of a joint: its seam points, and the stripes on its plates.

use crate::lens::Lens;
use crate::measure::stripe_meter::Fit;
use crate::seam::{GRID_SIGMA_PX, Seam};
use nalgebra::Vector2;
use trueline_dataset::{Feature, FrameStamp, Measured, PlateStripe};

/// Findings in one picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Detection {
    /// The seam point; of a joint with two lines, that of line 0.
    pub seam: Seam,
    /// The point of line 1: the other shoulder of a groove, the foot of a step.
    pub second: Option<Seam>,
    /// The stripes on the plates of the joint, by number of the plate, if it has plates and they are visible. For a single
    /// plate the number is 0.
    pub plates: [Option<StripeSupport>; 2],
}

impl From<Seam> for Detection {
    fn from(seam: Seam) -> Self {
        Self { seam, second: None, plates: [None; 2] }
    }
}

impl Detection {
    /// The seam points by number of their line.
    pub fn seams(&self) -> impl Iterator<Item = &Seam> {
        std::iter::once(&self.seam).chain(&self.second)
    }

    /// The features that a calibration takes in, one a line.
    pub fn features(&self, stamp: &FrameStamp) -> impl Iterator<Item = Feature> {
        let stamp = *stamp;
        self.seams().zip(0..).map(move |(seam, line)| Feature { line, ..seam.feature(&stamp) })
    }

    /// The stripes on its plates, for `stripes.csv`.
    pub fn stripes(&self, stamp: &FrameStamp) -> impl Iterator<Item = PlateStripe> {
        let FrameStamp { stamp_ns, frame, .. } = *stamp;
        self.plates.into_iter().zip(0..).filter_map(move |(support, plate)| {
            let StripeSupport { points_px, sigma_px } = support?;
            Some(PlateStripe {
                stamp_ns,
                frame: Some(frame),
                plate,
                points: points_px.map(|point| Measured::Pixel(point.into())),
                sigma: sigma_px,
            })
        })
    }

    /// The same, found in a picture with pixels of `factor` × `factor` of this lens's.
    pub(crate) fn unbinned(self, factor: usize) -> Self {
        Self {
            seam: self.seam.unbinned(factor),
            second: self.second.map(|seam| seam.unbinned(factor)),
            plates: self.plates.map(|plate| plate.map(|plate| plate.unbinned(factor))),
        }
    }
}

/// Measurement of a straight stripe: two points with independent and equally large errors perpendicular to the stripe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StripeSupport {
    /// Distorted pixels, the one nearer to the seam first.
    pub points_px: [Vector2<f64>; 2],
    /// Standard deviation of each square to the stripe, px.
    pub sigma_px: f64,
}

impl StripeSupport {
    /// The support points of a fitted stripe. Along it, errors of the line at two distances x, y from the middle of the
    /// regression covary by m₁₁ + m₁₂ (x + y) + m₂₂ x y; they vanish, and are equally large, for x, y = x₀ ± d with
    /// x₀ = −m₁₂ / m₂₂ and d² = (m₁₁ − m₁₂² / m₂₂) / m₂₂. For an even stripe of length 2ℓ that is d = ℓ / √3. `None` if the regression
    /// does not determine it.
    pub(crate) fn of(fit: &Fit, seam: &Vector2<f64>, lens: &Lens) -> Option<Self> {
        let covariance = &fit.regression.covariance;
        let middle = -covariance.m12 / covariance.m22;
        let variance = covariance.m11 - covariance.m12 * covariance.m12 / covariance.m22;
        let half = (variance / covariance.m22).sqrt();
        if !(half > 0.0 && half.is_finite()) {
            return None;
        }
        let mut ideal = [middle - half, middle + half].map(|s| fit.line.at(s));
        if (ideal[0] - seam).norm_squared() > (ideal[1] - seam).norm_squared() {
            ideal.swap(0, 1);
        }
        let [a, b] = ideal.map(|at| lens.distorted(&at));
        // A distance perpendicular to the line in the ideal picture is scaled by 1 / |J⁻ᵀ n| in the distorted one.
        let scale = |jacobian: &nalgebra::Matrix2<f64>| {
            let back = jacobian.try_inverse()?;
            Some((back.transpose() * fit.line.normal()).norm().recip())
        };
        let scale = (scale(&a.1)? * scale(&b.1)?).sqrt();
        let sigma_px = (2.0 * variance + GRID_SIGMA_PX * GRID_SIGMA_PX).sqrt() * scale;
        Some(Self { points_px: [a.0, b.0], sigma_px })
    }

    fn unbinned(self, factor: usize) -> Self {
        let k = factor as f64;
        Self {
            points_px: self.points_px.map(|at| (at * k).add_scalar(0.5 * (k - 1.0))),
            sigma_px: self.sigma_px * k,
        }
    }
}

/// The stripes on two plates by number of the plate. Number 0 is the one further to the left in the sheet, or further up
/// if the sheet stands upright in the picture.
pub(crate) fn plates_in_order(
    fits: [&Fit; 2],
    seam: &Vector2<f64>,
    lens: &Lens,
) -> [Option<StripeSupport>; 2] {
    let supports = fits.map(|fit| StripeSupport::of(fit, seam, lens));
    // The point of a fitted line is the middle of the stripe on it.
    let sideways = fits.map(|fit| lens.sideways_m(&fit.line.point));
    match (supports, sideways) {
        ([Some(a), Some(b)], [Some(left), Some(right)]) if left <= right => [Some(a), Some(b)],
        ([Some(a), Some(b)], [Some(_), Some(_)]) => [Some(b), Some(a)],
        _ => [None; 2],
    }
}
