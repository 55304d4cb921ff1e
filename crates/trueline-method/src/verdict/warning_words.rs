//! Warnings that take more than a line to say.

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
            "the residuals are those of an arm that gives way: its tool lags behind by {mm} for each m/s² of acceleration; \
             scan more slowly, or round the turns of the path"
        ),
        CauseKind::Backlash => format!(
            "the residuals are those of play in the robot: {mm} whenever the motion turns round; the time offset takes up a \
             part of it. Scan so that the axes turn round less often"
        ),
        CauseKind::AttitudeLag => format!(
            "the robot's attitude is reported {:.2} ± {:.2} ms later than its position; the ± do not contain it",
            ms[0], ms[1]
        ),
        CauseKind::RollingShutter => format!(
            "the rows of a picture are exposed one after the other, {:.1} ± {:.1} ms from the first to the last; use the \
             camera's global shutter, or scan more slowly",
            ms[0], ms[1]
        ),
        CauseKind::CommandedPose => {
            let constant_s = size.max(0.0).sqrt();
            format!(
                "the recorded poses seem to be the commanded ones: the arm follows them with a time constant of {:.0} ± {:.0} ms, \
                 and the time offset contains that delay; record the actual pose",
                constant_s * MS_PER_S,
                sigma / (2.0 * constant_s) * MS_PER_S
            )
        }
        CauseKind::Lens => "the distortion of the lens is not what sensor.toml states".to_owned(),
        CauseKind::TiltBias => tilt_bias(size, sigma, per_px_m),
        CauseKind::SideBias => format!(
            "the detector errs by {size:.2} ± {sigma:.2} px to different sides on the two halves of the picture; look at \
             its features in the pictures"
        ),
    }
}

pub(super) fn other_line([from, to]: [f64; 2], features: usize, beside_m: f64) -> String {
    format!(
        "from {from:.2} to {to:.2} s nearly all of the {features} features lie on another line, {:.2} mm beside: the \
         detector followed something else; they are not used",
        beside_m * MM_PER_M
    )
}

pub(super) fn wavy_seam(rms_m: f64) -> String {
    format!("the seam is wavy by {:.2} mm; the ± contain it", rms_m * MM_PER_M)
}

pub(super) fn robot_moves(rms_m: f64) -> String {
    format!("the arm is {:.2} mm off its poses along this scan; the ± contain it", rms_m * MM_PER_M)
}

pub(super) fn clock_step(at_s: f64, step_s: f64) -> String {
    format!(
        "one of the clocks stepped at about {at_s:.2} s, by {:+.2} ms; this was taken out",
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
        "the distortion of the lens is not what sensor.toml states: {}; write the sensor as the scan corrects it with \
         --write-sensor, and calibrate with that file",
        numbers.join(" and ")
    )
}

pub(super) fn drawn_line_not_needed(known_m: [f64; 2]) -> String {
    let [with, without] = known_m.map(|m| m * MM_PER_M);
    format!(
        "the scan shows the seam better than the drawing does: without --drawn-line a seam point is known to ± {without:.2} mm, with it \
         to ± {with:.2} mm. Leave it out, unless the drawing is known better than was stated"
    )
}

pub(super) fn feature_bias(bias: &FeatureBias, per_px_m: Option<f64>) -> String {
    let (px, sigma_px) = bias.clearest_px();
    format!("{}; this is taken out", tilt_bias(px, sigma_px, per_px_m))
}

fn tilt_bias(px: f64, sigma_px: f64, per_px_m: Option<f64>) -> String {
    let px = px.abs();
    let by = match per_px_m {
        None => format!("{px:.2} ± {sigma_px:.2} px"),
        Some(m) => format!("{:.3} ± {:.3} mm", px * m * MM_PER_M, sigma_px * m * MM_PER_M),
    };
    format!(
        "the detector's point moves with the tilt, by {by} for each 10° (a pass with the sensor spun by 180° about its view shows it \
         best)"
    )
}

/// What could not be used, `features` or `stripes`.
pub(super) fn left_out(what: &str, skipped: &BTreeMap<Skip, usize>) -> String {
    let list: Vec<String> = skipped.iter().map(|(why, count)| format!("{count}: {why}")).collect();
    format!("{} {what} could not be used; {}", skipped.values().sum::<usize>(), list.join("; "))
}

pub(super) fn robot_samples_missing(missing: usize, of: usize) -> String {
    format!(
        "{missing} of {of} samples of the robot are missing ({:.0} %): they were lost before they were recorded, and what it did \
         between the others is not known",
        100.0 * missing as f64 / of as f64
    )
}

pub(super) fn held_at_guess(held: &[Unobservable]) -> String {
    let held: Vec<String> = held.iter().map(ToString::to_string).collect();
    format!("held at the initial guess: {}", held.join("; "))
}

pub(super) fn unusual_noise(noise_factor: f64, is_explained: bool, of_answer: bool) -> String {
    let because = if is_explained {
        "The cause named above makes most of them"
    } else {
        "Either the stated noise is wrong, or something is left that is no noise: the sensor's own calibration, a bent line, a \
         robot that is off its path"
    };
    if of_answer {
        format!("residuals are {noise_factor:.2} times the expected noise; the ± are scaled by it. {because}")
    } else {
        format!(
            "residuals of the seam points are {noise_factor:.2} times the expected noise; the answer and its ± are those of the \
             whole stripes, and not scaled by it. {because}"
        )
    }
}

/// No clock drifts by more, ppm.
const WORST_CLOCK_PPM: f64 = 1000.0;

pub(super) fn clock_drift(ppm: f64, sigma_ppm: f64, about_s: f64) -> String {
    let cause = if ppm.abs() > WORST_CLOCK_PPM {
        "; no clock is that far off: the rate with which the stamps were made is not the sensor's"
    } else {
        ""
    };
    format!(
        "the image clock drifts by {ppm:+.1} ± {sigma_ppm:.1} ppm against the robot's{cause}; this is taken out, and the time \
         offset holds at {about_s:.1} s"
    )
}

pub(super) fn widened(by: f64) -> String {
    format!(
        "this scan shows a turn of the sensor so weakly that the usual ± would be too small: it is {by:.1} times as large there, as \
         the likelihood says; tilt further, or change the stand-off more"
    )
}

pub(super) fn poorly_known(scan_alone_m: f64, all_m: f64) -> String {
    format!(
        "a seam point is known to ± {:.1} mm only by this scan, and to ± {:.1} mm with the robot and the sensor that are assumed: scan for 20 s, tilt by 15° or more about two axes, and change the \
         stand-off (`trueline plan` finds a path)",
        scan_alone_m * MM_PER_M,
        all_m * MM_PER_M
    )
}

pub(super) fn structured(left: f64) -> String {
    format!(
        "the residuals are no noise: they follow the motion (neighbours correlate by {left:.2} once noise that lasts for some \
         frames is taken out); the ± hold for noise. Flex, backlash or lag of the robot, or a detector whose point moves with speed \
         or tilt, look like this"
    )
}

pub(super) fn robot_worse(seems: RobotSigmas, taken: RobotSigmas, stated: bool) -> String {
    let off = if seems.attitude_rad > taken.attitude_rad {
        let [seems, taken] = [seems, taken].map(|sigmas| sigmas.attitude_rad.to_degrees());
        format!("whose attitude is off by some {seems:.3}° within the scan ({taken:.3}°")
    } else {
        let [seems, taken] = [seems, taken].map(|sigmas| sigmas.position_m * MM_PER_M);
        format!("whose position is off by some {seems:.2} mm within the scan ({taken:.2} mm")
    };
    format!(
        "the residuals change with the robot's pose as those of a robot {off} {}); the ± take it for as bad as it shows itself. \
         Is the tool's frame right, and is the robot calibrated? In a single pass a seam that is not straight looks the same",
        if stated { "follow from its stated accuracy" } else { "were assumed" }
    )
}

pub(super) fn stripe_noise(noise_factor: f64) -> String {
    format!(
        "the stripes are {noise_factor:.2} times as noisy as is said of them; the ± are scaled by it. Either their σ is wrong, or \
         something is left that is no noise: plates that are rough or bent more than by 0.2 mm, reflections, a robot that is off \
         its path"
    )
}

pub(super) fn stripes_stamped_apart(later_s: f64) -> String {
    format!(
        "stripes.csv stamps the same pictures up to {:.2} ms {} than features.csv: the stamps of features.csv are used, and \
         the time offset is off by as much if they are wrong",
        later_s.abs() * MS_PER_S,
        if later_s > 0.0 { "later" } else { "earlier" }
    )
}

pub(super) fn stripes_disagree(sigmas: f64, apart: &Apart, used: bool) -> String {
    format!(
        "the whole stripes and the seam points give answers that are {}: {}. Plates that are bent near the seam, or \
         another edge than the plates' own look like this",
        how_far_apart(sigmas, apart),
        if used { "those of the stripes are used, as asked" } else { "the seam points are used" }
    )
}

/// How far two answers are apart.
pub(super) fn how_far_apart(sigmas: f64, apart: &Apart) -> String {
    format!(
        "{sigmas:.1} sigma apart ({} mm where the seam was seen, {} ms)",
        Significant(apart.point_m * MM_PER_M),
        Significant(apart.time_offset_s.abs() * MS_PER_S)
    )
}

pub(super) fn coarse_stamps(stream: StreamName, grain_s: f64) -> String {
    format!(
        "the {} stamps are whole multiples of {:.1} ms: if they were rounded down or up rather than to the nearest, the \
         time offset is off by half of that, or by all of it where samples come in whole multiples of it; its ± allows for \
         it",
        stream.name(),
        grain_s * MS_PER_S
    )
}

/// Most steps of a stream's stamps that are listed in the sentence.
const MOST_STEPS: usize = 3;

/// A step of a clock shows in its stream only up to whole periods.
pub(super) fn stamp_steps(stream: StreamName, steps: &[(f64, f64)], period_s: f64) -> String {
    let first = steps.iter().take(MOST_STEPS);
    let list: Vec<String> =
        first.map(|(at_s, step_s)| format!("{:+.2} ms at {at_s:.3} s", step_s * MS_PER_S)).collect();
    let more = match steps.len().saturating_sub(MOST_STEPS) {
        0 => String::new(),
        more => format!(" and {more} times more"),
    };
    format!(
        "the {} stamps step by {}{more} (known up to whole periods of {:.2} ms)",
        stream.name(),
        list.join(", "),
        period_s * MS_PER_S
    )
}

pub(super) fn misfit(rms_m: f64, fitted_rms_m: f64) -> String {
    format!(
        "the parts of the scan disagree: what the others predict of a part is {:.4} mm off, {:.2} times the fitted \
         {:.4} mm. An edge that is not straight, a part that moved, or a detector whose point moves with the tilt does this",
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
        DecidedBy::Statement => "what was stated of the cell",
    };
    if others.is_empty() {
        return format!("the scan alone does not tell this answer from its mirror image: {by} decided");
    }
    format!(
        "the scan alone does not tell this answer from {} with {} of {}: {by} decided",
        if others.len() == 1 { "another".to_owned() } else { format!("{} others", others.len()) },
        if others.len() == 1 { "a time offset" } else { "time offsets" },
        others.join(", ")
    )
}

/// A part of an external axis that the scan does not show.
pub(super) fn axis_not_shown(name: &str, part: AxisPart, cure: &str) -> String {
    let part = match part {
        AxisPart::Direction => "the direction",
        AxisPart::Place => "the place",
        AxisPart::TimeOffset => "the time offset",
    };
    format!("the scan does not show {part} of axis {name}; {cure}")
}

/// No place of a curve was seen twice.
pub(super) const CURVE_FROM_ONE_PASS: &str = "the scan goes over the curve once, so that its hand-eye transform is not told from the form of the curve; scan it \
    two or three times, or state the hand-eye transform in initial.toml for the time offset alone";

/// The curve needs knots that follow the weave.
pub(super) fn knots_near_weave(spacing_m: f64, weave_m: f64) -> String {
    format!(
        "the knots of the curve are {:.1} mm apart and the weave is {:.1} mm long, so that the curve follows the weave and the time offset is not \
         determined; weave faster, or move slower along the seam",
        spacing_m * MM_PER_M,
        weave_m * MM_PER_M
    )
}

/// A curve was not tried.
pub(super) fn curve_untried(why: &str) -> String {
    format!("no straight line explains the scan; a curve was not tried, because {why}")
}

/// Options that a curve does not use.
pub(super) fn unused_on_curve(options: &[&str]) -> String {
    format!(
        "the seam is curved, and {} has no part in its answer: form and noise of a curve are those that the scan shows",
        options.join(" and ")
    )
}

pub(super) fn repeated_robot_stamps(repeated: usize) -> String {
    format!("{repeated} robot rows repeat the stamp of the row before")
}
