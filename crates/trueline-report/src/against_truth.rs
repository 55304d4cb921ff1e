//! A calibration of a simulated scan against the truth.

use nalgebra::Vector3;
use trueline_dataset::Truth;
use trueline_dataset::unit::MM_PER_M;
use trueline_geometry::se3;
use trueline_method::Calibration;
use trueline_method::problem::parameters::{ROTATION, TIME_OFFSET, TRANSLATION};

/// Errors of the estimates against the simulated truth, in their own standard deviations.
#[must_use]
pub fn text(calibration: &Calibration, truth: &Truth) -> String {
    let truth = &truth.parameters;
    let offset_s = calibration.recorded_time_offset_s() - truth.time_offset_s;
    let (turn, shift) =
        se3::difference_decoupled(calibration.file_tool_from_camera(), &truth.tool_from_camera);
    let sigmas = |error: f64, at: usize| calibration.sigma(at).map_or(f64::NAN, |sigma| error / sigma);
    let axes = |error: Vector3<f64>, first: usize| {
        let each: Vec<String> = (0..3).map(|k| format!("{:+.1}", sigmas(error[k], first + k))).collect();
        each.join(", ")
    };
    format!(
        "\nError against the simulated truth, in standard deviations: time offset {:+.1}; rotation about x, \
         y, z {};\ntranslation along x, y, z {}. 68 % should be within 1, 95 % within 2. That is {:+.3} ms, \
         {:.4}° and {:.3} mm.\n",
        sigmas(offset_s, TIME_OFFSET),
        axes(turn, ROTATION),
        axes(shift, TRANSLATION),
        offset_s * 1e3,
        turn.norm().to_degrees(),
        shift.norm() * MM_PER_M,
    )
}
