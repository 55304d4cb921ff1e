//! Removes the detector's bias with the tilt from the support points, as from the seam points.

use crate::hypotheses::feature_bias::TakenBias;
use crate::input::observations::Observations;
use crate::problem::parameters::Parameters;
use crate::problem::placement::placement_at;
use crate::stripe::frames::{Sight, StripeFrames};
use nalgebra::{Matrix2x3, Vector2};
use trueline_model::Placement;

/// Removes the bias from every stripe. The seam points of `observations` are already corrected.
pub fn without_bias(
    frames: &mut StripeFrames,
    observations: &Observations,
    at: &Parameters,
    bias: &TakenBias,
) {
    for frame in &mut frames.list {
        // A frame that cannot be placed is not used in the fit.
        let exposure_s = frame.stamp_s - at.time_offset_s;
        let trajectory = &observations.robot.trajectory;
        let placement = placement_at(trajectory, exposure_s, &at.tool_from_camera);
        let Some(placement) = placement else { continue };
        let moved_px = moved_px(at, bias, &placement);
        let Sight::Stripes(stripes) = &mut frame.sight else { continue };
        for support in stripes.iter_mut().flatten().flatten() {
            support.reported -= support.sheet_per_px * moved_px;
        }
    }
}

/// Error of the detector at an attitude, along the image's rows and across them, px.
fn moved_px(at: &Parameters, bias: &TakenBias, placement: &Placement) -> Vector2<f64> {
    let in_sensor = bias.tilt.in_sensor(&at.tool_from_camera, placement);
    let by_axis = Matrix2x3::from_column_slice(bias.px.as_slice());
    by_axis * in_sensor
}
