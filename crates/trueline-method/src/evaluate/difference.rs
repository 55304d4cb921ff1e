//! Difference of two calibrations of one sensor: whether anything moved, and the effect at the seam.
//!
//! The difference of the seven numbers (time offset, rotation about the tool's axes, translation) is compared with the sum of both covariances. Its
//! effect on a seam point is averaged over the field of the laser plane.

use crate::problem::parameters::{ROTATION, TIME_OFFSET, TRANSLATION};
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};
use std::f64::consts::FRAC_1_SQRT_2;
use trueline_dataset::Guess;
use trueline_geometry::so3;

/// Numbers of a calibration without its lines.
pub const ANSWERS: usize = 7;

/// Standard deviations above which something has moved. Chance exceeds it in one comparison of a thousand.
pub const MOVED_Z: f64 = 3.09;

/// A calibration with its covariance.
#[derive(Clone, Debug, PartialEq)]
pub struct Estimate {
    /// Time offset and hand-eye transform.
    pub parameters: Guess,
    /// Covariance of time offset (s), rotation (rad, about the tool's axes) and translation (m).
    pub covariance: SMatrix<f64, ANSWERS, ANSWERS>,
}

/// The part of the laser plane that is evaluated, and its use.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Field {
    /// Width along the stripe, m.
    pub width_m: f64,
    /// Depth along the range, m.
    pub depth_m: f64,
    /// Distance of its middle from the sensor, m.
    pub stand_off_m: f64,
    /// Speed along the seam, m/s.
    pub speed_m_s: f64,
}

/// Difference of two calibrations, second minus first.
#[derive(Clone, Debug, PartialEq)]
pub struct Difference {
    /// Time offset, s.
    pub time_offset_s: f64,
    /// Rotation about the tool's axes, rad.
    pub rotation_rad: Vector3<f64>,
    /// Translation, m.
    pub translation_m: Vector3<f64>,
    /// Standard deviations of the seven numbers, in the order of [`Estimate::covariance`].
    pub sigma: SVector<f64, ANSWERS>,
    /// RMS shift of a seam point over the field at the working speed, m.
    pub seam_shift_rms_m: f64,
    /// Its standard deviation from noise, m.
    pub seam_shift_sigma_m: f64,
    /// Largest shift in the field, m.
    pub seam_shift_largest_m: f64,
    /// χ² of the seven numbers as the deviate of a normal distribution.
    pub z: f64,
    /// The same for the time offset alone, signed.
    pub z_time: f64,
    /// The same for the six numbers of the transform.
    pub z_hand_eye: f64,
}

impl Difference {
    /// Whether anything has moved.
    #[must_use]
    pub fn moved(&self) -> bool {
        self.z > MOVED_Z
    }

    /// Probability of a larger difference by chance, 0 to 1.
    #[must_use]
    pub fn chance(&self) -> f64 {
        0.5 * libm::erfc(self.z * FRAC_1_SQRT_2)
    }

    /// Whether the time offset has changed.
    #[must_use]
    pub fn timing_moved(&self) -> bool {
        self.z_time.abs() > MOVED_Z
    }

    /// Whether the hand-eye transform has changed.
    #[must_use]
    pub fn bracket_moved(&self) -> bool {
        self.z_hand_eye > MOVED_Z
    }
}

/// Compares two calibrations. `None` if their covariances are not positive definite.
#[must_use]
pub fn between(first: &Estimate, second: &Estimate, field: &Field) -> Option<Difference> {
    let (a, b) = (&first.parameters, &second.parameters);
    let rotation_rad = so3::log(&(b.tool_from_camera.rotation * a.tool_from_camera.rotation.inverse()));
    let translation_m = b.tool_from_camera.translation.vector - a.tool_from_camera.translation.vector;
    let time_offset_s = b.time_offset_s - a.time_offset_s;
    let mut change = SVector::<f64, ANSWERS>::zeros();
    change[TIME_OFFSET] = time_offset_s;
    change.fixed_rows_mut::<3>(ROTATION).copy_from(&rotation_rad);
    change.fixed_rows_mut::<3>(TRANSLATION).copy_from(&translation_m);
    let covariance = first.covariance + second.covariance;
    let squared = change.dot(&covariance.cholesky()?.solve(&change));
    let hand_eye = covariance.fixed_view::<6, 6>(ROTATION, ROTATION).into_owned();
    let moved = change.fixed_rows::<6>(ROTATION).into_owned();
    let squared_hand_eye = moved.dot(&hand_eye.cholesky()?.solve(&moved));
    let seam = SeamShift::over(field, first, &change, &covariance);
    Some(Difference {
        time_offset_s,
        rotation_rad,
        translation_m,
        sigma: covariance.diagonal().map(f64::sqrt),
        seam_shift_rms_m: seam.rms_m,
        seam_shift_sigma_m: seam.sigma_m,
        seam_shift_largest_m: seam.largest_m,
        z: deviate(squared, ANSWERS),
        z_time: time_offset_s / covariance[(TIME_OFFSET, TIME_OFFSET)].sqrt(),
        z_hand_eye: deviate(squared_hand_eye, 6),
    })
}

/// A χ² as a normal deviate, by the cube root \[WilsonHilferty1931\]. Accurate to 0.05 from 3 degrees of freedom on.
fn deviate(squared: f64, freedom: usize) -> f64 {
    let spread = 2.0 / (9.0 * freedom as f64);
    ((squared / freedom as f64).cbrt() - (1.0 - spread)) / spread.sqrt()
}

/// Effect of a change on the seam points of a field.
struct SeamShift {
    rms_m: f64,
    sigma_m: f64,
    largest_m: f64,
}

/// Points across the field in each direction.
const GRID: usize = 9;

impl SeamShift {
    fn over(
        field: &Field,
        first: &Estimate,
        change: &SVector<f64, ANSWERS>,
        covariance: &SMatrix<f64, ANSWERS, ANSWERS>,
    ) -> Self {
        let (mut squares, mut variances, mut largest_m) = (0.0, 0.0, 0.0_f64);
        let part = |k: usize| k as f64 / (GRID - 1) as f64 - 0.5;
        for (row, column) in (0..GRID).flat_map(|row| (0..GRID).map(move |column| (row, column))) {
            let point = Vector3::new(
                field.width_m * part(row),
                0.0,
                field.stand_off_m + field.depth_m * part(column),
            );
            // p_tool = Exp(δ) R p + t, and the path travelled during a change of the time offset.
            let lever = first.parameters.tool_from_camera.rotation * point;
            let mut effect = SMatrix::<f64, 4, ANSWERS>::zeros();
            effect.fixed_view_mut::<3, 3>(0, ROTATION).copy_from(&(-so3::hat(&lever)));
            effect.fixed_view_mut::<3, 3>(0, TRANSLATION).copy_from(&Matrix3::identity());
            effect[(3, TIME_OFFSET)] = field.speed_m_s;
            let shift = (effect * change).norm();
            squares += shift * shift;
            variances += (effect * covariance * effect.transpose()).trace();
            largest_m = largest_m.max(shift);
        }
        let count = (GRID * GRID) as f64;
        Self { rms_m: (squares / count).sqrt(), sigma_m: (variances / count).sqrt(), largest_m }
    }
}
