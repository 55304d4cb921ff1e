//! Effect of the plates' forms on seam points computed as crossings of straight lines.
//!
//! A detector fits a straight line to each arm of an image and intersects them. With bowed plates the intersection lies beside the seam, by the same
//! amount in all images of one attitude. The seam points' answer ignores this. Refitting the points without the effect of the estimated forms gives
//! the shift of the answer.

use crate::input::observations::Observations;
use crate::problem::parameters::LINES;
use crate::solve::fit::Fit;
use crate::solve::settings::FitSettings;
use crate::solve::solver::Solver;
use crate::stripe::frame_residual::{linearize_frame, placement};
use crate::stripe::frames::{Sight, StripeFrame};
use crate::stripe::state::StripeState;
use nalgebra::{Matrix2, SVector, Vector2};

/// Shift of the seam points' answer, in the first unknowns, when the effect of the plates' forms is removed. `None` if the forms affect no seam
/// point, or the refit fails.
pub(crate) fn moved_without_forms(
    (observations, settings): (&Observations, &FitSettings<'_>),
    fit: &Fit,
    frames: &[StripeFrame],
    at: &StripeState,
) -> Option<SVector<f64, LINES>> {
    let mut free = observations.clone();
    let mut any = false;
    for frame in frames {
        let Some((observation, beside_m)) = beside_seam(observations, frame, at) else { continue };
        free.list[observation].point_in_camera -= observations.sheet.axes() * beside_m;
        any = true;
    }
    let solver = Solver { observations: &free, settings: *settings };
    let freed = any.then(|| solver.converge(fit).ok()).flatten()?;
    Some(freed.parameters().minus(&fit.parameters().guess()))
}

/// Offset of the intersection of straight lines through the predicted stripes from the intersection of the stripes themselves, reported sheet
/// coordinates in m, with the index of the observation. `None` if the plates do not meet or are not both visible beside their seam point.
fn beside_seam(
    observations: &Observations,
    frame: &StripeFrame,
    at: &StripeState,
) -> Option<(usize, Vector2<f64>)> {
    let Sight::Stripes([Some(one), Some(other)]) = &frame.sight else { return None };
    let seam = frame.edge.filter(|_| at.joints.get(frame.joint).is_some_and(|joint| joint.edge.is_none()))?;
    let placement = placement(observations, frame.stamp_s, at)?;
    let (stripes, _) = linearize_frame(observations, frame, at, &placement)?;
    let of_seam = StripeFrame { sight: Sight::Seam(seam), ..*frame };
    let (crossing, _) = linearize_frame(observations, &of_seam, at, &placement)?;
    let supports = [one, other].map(|supports| supports.each_ref().map(|support| support.reported));
    let on_line = |plate: usize, k: usize| {
        let row = 2 * plate + k;
        let normal = stripes.d_reported.fixed_rows::<1>(row).transpose();
        supports[plate][k] - normal * (stripes.residual[row] / normal.norm_squared())
    };
    let [[a, b], [c, d]] = [0, 1].map(|plate| [on_line(plate, 0), on_line(plate, 1)]);
    // a + s (b − a) = c + t (d − c)
    let along = Matrix2::from_columns(&[b - a, c - d]).try_inverse()? * (c - a);
    let of_lines = a + (b - a) * along.x;
    let of_stripes = seam.reported - crossing.residual.fixed_rows::<2>(0);
    Some((seam.observation, of_lines - of_stripes))
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use crate::config::{Config, Measurements};
    use crate::input::noise_levels::NoiseLevels;
    use crate::input::observations::{observe, origin_ns};
    use crate::input::timestamps::Sampling;
    use crate::problem::parameters::Parameters;
    use crate::stripe::fit::StripeSolver;
    use crate::stripe::frames::frames;
    use crate::stripe::start;
    use crate::stripe::whitening::SharedNoise;
    use trueline_sim::{Disturbance, PlateForm, Plates, Preset, scan_plates};

    /// Noise-free simulated seam points are intersections of lines through bowed stripes. They lie beside the seam by the predicted offset, to a
    /// fiftieth. The simulator's 24 places on a stripe equal a line's columns to 1 in 23², and its intersection uses ideal pixels. The place of the
    /// visible stripe does not matter.
    #[test]
    fn simulated_seam_points_of_bowed_plates_lie_beside_the_seam_by_as_much() {
        let mut scenario = Preset::Good.scenario();
        scenario.disturbance = Disturbance {
            feature_noise_px: 0.0,
            feature_noise_m: 0.0,
            robot_position_noise_m: 0.0,
            robot_rotation_noise_rad: 0.0,
            robot_jitter_s: 0.0,
            frame_jitter_s: 0.0,
            ..scenario.disturbance
        };
        let form = PlateForm { across: 2e-4, along: 2e-4, ..PlateForm::default() };
        let plates = Plates { forms: [form; 2], column_sigma_px: 1e-4, ..Plates::default() };
        let recording = scan_plates(&scenario, &plates, 1).unwrap();
        let config = Config::noise_only();
        let observations =
            observe(&recording, &Sampling::of(&recording, origin_ns(&recording)), &config).unwrap();
        let frames = frames(&recording, &observations, Measurements::Stripe, &config).unwrap();
        let truth = recording.truth.as_ref().unwrap();
        let like = Parameters::straight(&truth.parameters, truth.lines.clone());
        let begin = start::start(&observations, &frames, &like, None).unwrap();
        let levels = NoiseLevels { robot_sigma_m: 0.0, stamp_sigma_s: 0.0, factor: 1.0 };
        let fixed = start::held(&begin, &frames.without_plates);
        let solver = StripeSolver {
            observations: &observations,
            frames: &frames.list,
            shared: SharedNoise { levels, robot_sigma_rad: 0.0 },
            loss: Config::default().final_loss(),
            shape_prior: None,
            fixed: &fixed,
        };
        let fit = solver.fit(begin).unwrap();
        let (mut largest_m, mut off_m) = (0.0_f64, 0.0_f64);
        for frame in &frames.list {
            let Some((number, beside_m)) = beside_seam(&observations, frame, fit.state()) else { continue };
            let seam = frame.edge.unwrap();
            assert_eq!(
                observations.sheet.coordinates(&observations.list[number].point_in_camera),
                seam.reported
            );
            let placement = placement(&observations, frame.stamp_s, fit.state()).unwrap();
            let of_seam = StripeFrame { sight: Sight::Seam(seam), ..*frame };
            let (parts, _) = linearize_frame(&observations, &of_seam, fit.state(), &placement).unwrap();
            largest_m = largest_m.max(beside_m.norm());
            off_m = off_m.max((parts.residual.fixed_rows::<2>(0) - beside_m).norm());
            let mut seen_aside = *frame;
            let Sight::Stripes(stripes) = &mut seen_aside.sight else { continue };
            for support in stripes.iter_mut().flatten().flatten() {
                support.reported += Vector2::new(3e-5, -2e-5);
            }
            let (_, aside_m) = beside_seam(&observations, &seen_aside, fit.state()).unwrap();
            // The visible part of the stripe moves by 36 µm of some 20 mm, and the bow's slope with it.
            assert!((aside_m - beside_m).norm() < 1e-6, "{aside_m} {beside_m}");
        }
        println!("up to {largest_m} m beside the seam, {off_m} m of it not said");
        assert!(largest_m > 1e-5 && off_m < 0.02 * largest_m);
    }
}
