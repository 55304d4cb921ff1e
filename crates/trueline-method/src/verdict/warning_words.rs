//! Warnings of more than one line.

use super::quantity::{Axis, MM_PER_M, MS_PER_S, Quantity, Significant};
use super::stream_name::StreamName;
use crate::assess::cause_kind::CauseKind;
use crate::assess::lens::LensCorrection;
use crate::assess::observability::Unobservable;
use crate::assess::robot_field::RobotSigmas;
use crate::axes::finding::AxisPart;
use crate::hypotheses::choice::DecidedBy;
use crate::hypotheses::feature_bias::FeatureBias;
use crate::input::skip::Skip;
use crate::stripe::outcome::Apart;
use std::collections::BTreeMap;

pub(super) fn likely_cause(kind: CauseKind, [size, sigma]: [f64; 2], per_px_m: Option<f64>) -> String {
    let (mm, ms) =
        (format!("{:.3} ± {:.3} mm", size * MM_PER_M, sigma * MM_PER_M), [size, sigma].map(|s| s * MS_PER_S));
    match kind {
        CauseKind::Flex => format!(
            "the tool lags by {mm} for each m/s² of acceleration: the arm bends. Scan more slowly, or round \
             the turns of the path"
        ),
        CauseKind::Backlash => format!(
            "the robot has backlash of {mm} at each reversal, and the time offset absorbs a part of it. Scan \
             so that the axes reverse less often"
        ),
        CauseKind::AttitudeLag => format!(
            "the robot reports its attitude {:.2} ± {:.2} ms later than its position, and the ± do not \
            include this. Log both from one message",
            ms[0], ms[1]
        ),
        CauseKind::RollingShutter => format!(
            "the camera has a rolling shutter: {:.1} ± {:.1} ms from the first row to the last. Use its \
             global shutter, or scan more slowly",
            ms[0], ms[1]
        ),
        CauseKind::CommandedPose => {
            let constant_s = size.max(0.0).sqrt();
            format!(
                "the arm follows the recorded poses with a time constant of {:.0} ± {:.0} ms, and the time \
                 offset contains that delay: they are probably commanded poses. Record the actual pose",
                constant_s * MS_PER_S,
                sigma / (2.0 * constant_s) * MS_PER_S
            )
        }
        CauseKind::Lens => "the lens distortion differs from sensor.toml".to_owned(),
        CauseKind::TiltBias => tilt_bias(size, sigma, per_px_m),
        CauseKind::SideBias => format!(
            "the detector's bias is {size:.2} ± {sigma:.2} px, with opposite signs in the two halves of the \
             picture. Look at its features in the pictures"
        ),
    }
}

pub(super) fn other_line([from, to]: [f64; 2], features: usize, beside_m: f64) -> String {
    format!(
        "from {from:.2} to {to:.2} s nearly all of the {features} features lie on another line, {:.2} mm \
         beside the seam, and are not used. Restrict the detector to the seam",
        beside_m * MM_PER_M
    )
}

pub(super) fn wavy_seam(rms_m: f64) -> String {
    format!("the seam is wavy by {:.2} mm RMS; the ± include this", rms_m * MM_PER_M)
}

pub(super) fn wavy_plates(rms_m: f64) -> String {
    format!("the plates are wavy by {:.2} mm RMS; the ± include this", rms_m * MM_PER_M)
}

pub(super) fn robot_moves(rms_m: f64) -> String {
    format!(
        "the arm is {:.2} mm RMS off its reported poses along this scan; the ± include this",
        rms_m * MM_PER_M
    )
}

pub(super) fn joint_lags(rms_m: f64) -> String {
    format!(
        "the arm is {:.2} mm RMS off its recorded poses in proportion to its speed; the ± include this. Its \
         joints lag by different times, as behind commanded poses: record the actual pose",
        rms_m * MM_PER_M
    )
}

pub(super) fn clock_step(at_s: f64, step_s: f64) -> String {
    format!(
        "one of the clocks stepped by {:+.2} ms at about {at_s:.2} s; the result is corrected for it",
        step_s * MS_PER_S
    )
}

pub(super) fn lens_off(lens: &LensCorrection) -> String {
    let number = |k: usize| {
        let (by, sigma) = (lens.distortion[k], lens.sigma[k]);
        (by != 0.0).then(|| format!("k{} by {by:+.4} ± {sigma:.4}", k + 1))
    };
    let numbers: Vec<String> = [number(0), number(1)].into_iter().flatten().collect();
    format!(
        "the lens distortion differs from sensor.toml: {}. Write the corrected sensor with --write-sensor, \
         and calibrate with that file",
        numbers.join(" and ")
    )
}

pub(super) fn drawn_line_not_needed(known_m: [f64; 2]) -> String {
    let [with, without] = known_m.map(|m| m * MM_PER_M);
    format!(
        "the drawing makes seam points less certain: ± {with:.2} mm with --drawn-line, ± {without:.2} mm \
         without it. Leave it out, or state a smaller --drawn-line-sigma-mm"
    )
}

pub(super) fn feature_bias(bias: &FeatureBias, per_px_m: Option<f64>) -> String {
    let (px, sigma_px) = bias.clearest_px();
    format!("{}; the result is corrected for it", tilt_bias(px, sigma_px, per_px_m))
}

fn tilt_bias(px: f64, sigma_px: f64, per_px_m: Option<f64>) -> String {
    let px = px.abs();
    let by = match per_px_m {
        None => format!("{px:.2} ± {sigma_px:.2} px"),
        Some(m) => format!("{:.3} ± {:.3} mm", px * m * MM_PER_M, sigma_px * m * MM_PER_M),
    };
    format!(
        "the detector's point moves by {by} for each 10° of tilt (a pass with the sensor spun by 180° about \
         its view shows it best)"
    )
}

/// Counts of unused `features` or `stripes`.
pub(super) fn left_out(what: &str, skipped: &BTreeMap<Skip, usize>) -> String {
    let list: Vec<String> = skipped.iter().map(|(why, count)| format!("{count}: {why}")).collect();
    format!("{} {what} could not be used; {}", skipped.values().sum::<usize>(), list.join("; "))
}

pub(super) fn robot_samples_missing(missing: usize, of: usize) -> String {
    format!(
        "{missing} of {of} robot samples are missing ({:.0} %): they were lost before they were recorded. \
         Check the load of the PC and the network, and record again",
        100.0 * missing as f64 / of as f64
    )
}

pub(super) fn held_at_guess(held: &[Unobservable]) -> String {
    let held: Vec<String> = held.iter().map(ToString::to_string).collect();
    format!("held at the initial guess: {}", held.join("; "))
}

pub(super) fn unusual_noise(noise_factor: f64, is_explained: bool, of_answer: bool) -> String {
    let because = if is_explained {
        "The cause named above explains most of this"
    } else {
        "Either the stated noise is wrong, or there is a systematic error: sensor calibration, a bent line, \
         a robot off its path"
    };
    if of_answer {
        format!(
            "residuals are {noise_factor:.2} times the expected noise, and the ± are scaled by this. \
            {because}"
        )
    } else {
        format!(
            "residuals of the seam points are {noise_factor:.2} times the expected noise; the answer and its \
             ± come from the whole stripes and are not scaled by this. {because}"
        )
    }
}

/// Largest drift of any clock, ppm.
const WORST_CLOCK_PPM: f64 = 1000.0;

pub(super) fn clock_drift(ppm: f64, sigma_ppm: f64, about_s: f64) -> String {
    let cause = if ppm.abs() > WORST_CLOCK_PPM {
        ": no clock drifts this much, so the stated frame rate is wrong"
    } else {
        ""
    };
    format!(
        "the image clock drifts by {ppm:+.1} ± {sigma_ppm:.1} ppm against the robot clock{cause}. The result \
         is corrected for it, and the time offset holds at {about_s:.1} s"
    )
}

pub(super) fn widened(by: f64) -> String {
    format!(
        "the ± of one rotation are widened by {by:.1}, to the likelihood profile: the scan constrains that \
         rotation only weakly. Tilt further, or change the stand-off more"
    )
}

pub(super) fn poorly_known(scan_alone_m: f64, all_m: f64) -> String {
    format!(
        "a seam point has ± {:.1} mm from this scan alone, and ± {:.1} mm with the assumed robot and sensor \
         errors. Scan for 20 s, tilt by 15° or more about two axes, and change the stand-off (`trueline \
         plan` finds a path)",
        scan_alone_m * MM_PER_M,
        all_m * MM_PER_M
    )
}

pub(super) fn structured(left: f64) -> String {
    format!(
        "the ± are too small, because the residuals follow the motion and are not random noise (correlation \
         of neighbours {left:.2} after removal of correlated noise). Causes are flex, backlash or lag of the \
         robot, or a detector bias with speed or tilt: scan more slowly"
    )
}

pub(super) fn robot_worse(seems: RobotSigmas, taken: RobotSigmas, stated: bool) -> String {
    let off = if seems.attitude_rad > taken.attitude_rad {
        let [seems, taken] = [seems, taken].map(|sigmas| sigmas.attitude_rad.to_degrees());
        format!("in attitude by about {seems:.3}° within the scan ({taken:.3}°")
    } else {
        let [seems, taken] = [seems, taken].map(|sigmas| sigmas.position_m * MM_PER_M);
        format!("in position by about {seems:.2} mm within the scan ({taken:.2} mm")
    };
    format!(
        "the robot errs {off} {}), and the uncertainties assume this larger error. Check the tool frame and \
         the robot's calibration; in a single pass a seam that is not straight looks the same",
        if stated { "follow from its stated accuracy" } else { "were assumed" }
    )
}

pub(super) fn stripe_noise(noise_factor: f64) -> String {
    format!(
        "the stripes are {noise_factor:.2} times noisier than stated, and the ± are scaled by this. Either \
         their σ is wrong, or there is a systematic error: rough plates, plates bent by more than 0.2 mm, \
         reflections, a robot off its path"
    )
}

pub(super) fn stripes_stamped_apart(later_s: f64) -> String {
    format!(
        "stripes.csv stamps the same pictures up to {:.2} ms {} than features.csv, whose stamps are used. If \
         those are wrong, the time offset is off by as much: write one stamp for each picture into both",
        later_s.abs() * MS_PER_S,
        if later_s > 0.0 { "later" } else { "earlier" }
    )
}

pub(super) fn stripes_disagree(sigmas: f64, apart: &Apart, used: bool) -> String {
    format!(
        "the whole stripes and the seam points give answers {}: {}. Probable causes are plates bent near the \
         seam, or features of another edge: look at the pictures",
        how_far_apart(sigmas, apart),
        if used { "the stripes are used, as requested" } else { "the seam points are used" }
    )
}

/// Distance of two answers.
pub(super) fn how_far_apart(sigmas: f64, apart: &Apart) -> String {
    format!(
        "{sigmas:.1} σ apart ({} mm at the seam, {} ms)",
        Significant(apart.point_m * MM_PER_M),
        Significant(apart.time_offset_s.abs() * MS_PER_S)
    )
}

pub(super) fn coarse_stamps(stream: StreamName, grain_s: f64) -> String {
    format!(
        "the {} stamps are rounded to multiples of {:.1} ms, which can shift the time offset by half of \
         this, or by all of it where samples are that far apart; its ± includes this. Use a finer clock",
        stream.name(),
        grain_s * MS_PER_S
    )
}

/// Maximum number of listed steps of a stream's stamps.
const MOST_STEPS: usize = 3;

/// A stream determines a clock step only up to whole periods.
pub(super) fn stamp_steps(stream: StreamName, steps: &[(f64, f64)], period_s: f64) -> String {
    let first = steps.iter().take(MOST_STEPS);
    let list: Vec<String> =
        first.map(|(at_s, step_s)| format!("{:+.2} ms at {at_s:.3} s", step_s * MS_PER_S)).collect();
    let more = match steps.len().saturating_sub(MOST_STEPS) {
        0 => String::new(),
        more => format!(" and {more} more steps"),
    };
    format!(
        "the {} stamps step by {}{more} (up to whole periods of {:.2} ms)",
        stream.name(),
        list.join(", "),
        period_s * MS_PER_S
    )
}

pub(super) fn misfit(rms_m: f64, fitted_rms_m: f64) -> String {
    format!(
        "the parts of the scan disagree: each is predicted from the others with {:.4} mm RMS, {:.2} times \
         the fitted {:.4} mm. Probable causes are an edge that is not straight, a part that moved, or a \
         detector bias with the tilt",
        rms_m * MM_PER_M,
        rms_m / fitted_rms_m,
        fitted_rms_m * MM_PER_M
    )
}

pub(super) fn moves(quantity: Quantity, axis: Option<Axis>, moved_si: f64) -> String {
    let (axis, moved) = (axis.map_or("", Axis::name), quantity.shown(moved_si));
    match quantity {
        Quantity::TimeOffset => format!("the time offset moves by {moved:.3} ms"),
        Quantity::Rotation => format!("the rotation about {axis} moves by {moved:.4}°"),
        Quantity::Translation | Quantity::SeamPoint => {
            format!("the translation {axis} moves by {moved:.3} mm")
        }
    }
}

pub(super) fn decided_by_user(by: DecidedBy, other_time_offsets_s: &[f64]) -> String {
    let others: Vec<String> =
        other_time_offsets_s.iter().map(|offset_s| format!("{:.1} ms", offset_s * MS_PER_S)).collect();
    let by = match by {
        DecidedBy::Guess => "the initial guess",
        DecidedBy::Statement => "your statement about the cell",
    };
    if others.is_empty() {
        return format!("the scan alone cannot separate this answer from its mirror image: {by} decided");
    }
    format!(
        "the scan alone cannot separate this answer from {} with {} of {}: {by} decided",
        if others.len() == 1 { "another".to_owned() } else { format!("{} others", others.len()) },
        if others.len() == 1 { "a time offset" } else { "time offsets" },
        others.join(", ")
    )
}

/// An unobservable part of an external axis.
pub(super) fn axis_not_shown(name: &str, part: AxisPart, cure: &str) -> String {
    let part = match part {
        AxisPart::Direction => "the direction",
        AxisPart::Place => "the place",
        AxisPart::TimeOffset => "the time offset",
    };
    format!("this scan does not determine {part} of axis {name}: {cure}")
}

/// No place of a curve was scanned twice.
pub(super) const CURVE_FROM_ONE_PASS: &str = "the scan passes over the curve once, so the hand-eye transform \
    cannot be separated from the form of the curve. Scan it two or three times, or give the hand-eye \
    transform in initial.toml and calibrate the time offset alone";

/// The curve needs knots that follow the weave.
pub(super) fn knots_near_weave(spacing_m: f64, weave_m: f64) -> String {
    format!(
        "the curve follows the weave, so the time offset is not determined: its knots are {:.1} mm apart and \
         the weave is {:.1} mm long. Weave faster, or move more slowly along the seam",
        spacing_m * MM_PER_M,
        weave_m * MM_PER_M
    )
}

/// A curve was not tried.
pub(super) fn curve_untried(why: &str) -> String {
    format!("no straight line explains the scan, and there is no curve instead: {why}")
}

/// Options that a curve does not use.
pub(super) fn unused_on_curve(options: &[&str]) -> String {
    format!(
        "the seam is curved, and a curve ignores {}: its form and noise are estimated from the scan",
        options.join(" and ")
    )
}

pub(super) fn repeated_robot_stamps(repeated: usize) -> String {
    format!("{repeated} robot rows repeat the previous stamp")
}

pub(super) fn outlier_stretch([from, to]: [f64; 2], features: usize) -> String {
    format!(
        "nearly all of the {features} features from {from:.2} to {to:.2} s are outliers. Look at the pictures of that time"
    )
}

pub(super) fn many_outliers(share: f64) -> String {
    format!("{:.0} % of the measurements are outliers and are rejected. Check the detector", 100.0 * share)
}

pub(super) fn repeated_poses(repeated: usize, rows: usize) -> String {
    format!(
        "{repeated} of {rows} robot rows repeat the previous pose: the controller updates its pose less often than it is polled. The first row of each is used"
    )
}
