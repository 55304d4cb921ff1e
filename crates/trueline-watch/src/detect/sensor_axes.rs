//! The sensor's own axes, and what a change of the bracket does to a seam point, for words that a person can point at.

use super::change::Change;
use crate::parameters::{ROTATION, TRANSLATION};
use nalgebra::{Matrix3, SMatrix, Vector3};

/// Along the stripe, square to the laser plane (along the seam), and depth, in the tool frame.
#[derive(Clone, Copy, Debug)]
pub struct SensorAxes {
    /// As columns.
    pub tool_from_axes: Matrix3<f64>,
    /// From the camera's origin to the middle of what it sees of the seams, tool axes, m.
    pub camera_to_seam_m: Vector3<f64>,
}

/// Names of the axes.
pub const AXES: [&str; 3] = ["across", "along", "depth"];

impl SensorAxes {
    /// How far a change of the bracket moves a seam point, by axis with its standard deviation, m; `None` along an axis for which
    /// these welds do not show it. Shift and turn by themselves may both be unknown where this is not.
    #[must_use]
    pub fn seam_point(&self, bracket: &Change) -> [Option<[f64; 2]>; 3] {
        // Exp(δ) R p + t + dt moves by δ × R p + dt.
        let mut by_column = SMatrix::<f64, 3, 6>::zeros();
        by_column.fixed_columns_mut::<3>(0).copy_from(&-self.camera_to_seam_m.cross_matrix());
        by_column.fixed_columns_mut::<3>(TRANSLATION - ROTATION).copy_from(&Matrix3::identity());
        let by_axis = self.tool_from_axes.transpose() * by_column;
        [0, 1, 2].map(|axis| bracket.combination(by_axis.row(axis).transpose().as_slice()))
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use crate::detect::change::Confidence;
    use crate::parameters::{Kind, UNITS};
    use crate::quadratic::Quadratic;
    use nalgebra::DMatrix;

    /// A sensor that turns about the seam point leaves it where it is, and welds that see that point alone show its place and
    /// nothing else: the information below is that of a point, J Jᵀ, of rank three.
    #[test]
    fn the_seam_point_is_known_where_shift_and_turn_are_not() {
        let turn = trueline_geometry::so3::exp(&Vector3::new(0.3, -0.5, 0.9)).to_rotation_matrix();
        let axes = SensorAxes {
            tool_from_axes: turn.into_inner(),
            camera_to_seam_m: Vector3::new(0.02, -0.05, 0.13),
        };
        let (delta, shift) = (Vector3::new(1e-3, -2e-3, 5e-4), Vector3::new(2e-4, 1e-4, -3e-4));
        let known = axes.tool_from_axes.transpose() * (delta.cross(&axes.camera_to_seam_m) + shift);
        let sigma_m = 2e-6;
        // By differences, so that no formula of the code is used.
        let moved = |x: &[f64]| {
            let rotated =
                trueline_geometry::so3::exp(&Vector3::new(x[0], x[1], x[2])) * axes.camera_to_seam_m;
            rotated + Vector3::new(x[3], x[4], x[5])
        };
        let units = &UNITS[Kind::Bracket.columns()];
        let jacobian = DMatrix::from_fn(3, 6, |i, j| {
            let step = |h: f64| {
                let mut x = [0.0; 6];
                x[j] = h;
                moved(&x)[i]
            };
            units[j] * (step(1e-6) - step(-1e-6)) / 2e-6 / sigma_m
        });
        let change =
            nalgebra::DVector::from_fn(6, |k, _| if k < 3 { delta[k] } else { shift[k - 3] } / units[k]);
        let matrix = jacobian.transpose() * &jacobian;
        let evidence = Quadratic { vector: &matrix * change, matrix };
        let confidence = Confidence { noise_freedom: 1e6, taught_by: 0, dispersion: 1.0, pieces: 1 };
        let bracket = Change::of(Kind::Bracket, &evidence, None, confidence);
        assert!(bracket.value.iter().all(Option::is_none), "shift and turn are not told apart: {bracket:?}");
        for (found, known) in axes.seam_point(&bracket).into_iter().zip(known.iter()) {
            let [value, sigma] = found.unwrap();
            // A shift of a unit along each axis has one standard deviation of 2 µm; rounding of the differences is 1e-9 of it.
            assert!(
                (value - known).abs() < 1e-9 && (sigma / sigma_m - 1.0).abs() < 1e-6,
                "{value} {known} {sigma}"
            );
        }
    }
}
