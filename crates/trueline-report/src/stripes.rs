//! Whole stripes: the plates, and the answers of stripes and seam points side by side.

use crate::number::{digits_for, positive_w};
use std::collections::BTreeSet;
use trueline_dataset::result_file::{
    AngleEntry, AnswerEntry, HeightStepEntry, PlaneEntry, PoseEntry, Sigma, StripesEntry,
};
use trueline_dataset::unit::MM_PER_M;
use trueline_method::problem::parameters::{ROTATION, TIME_OFFSET, TRANSLATION};
use trueline_method::stripe::outcome::{Answer, Because, StripeEstimate, StripeOutcome};
use trueline_method::stripe::outlier_counts::OutlierCounts;
use trueline_method::stripe::planes::PlaneEstimate;
use trueline_method::{Calibration, Measurements};

/// The plates of a result; none where seam points were used.
#[must_use]
pub(crate) fn planes(c: &Calibration) -> Vec<PlaneEntry> {
    let used = c.findings.stripes.as_ref().filter(|stripes| stripes.used != Measurements::Seam);
    let estimate = used.and_then(|stripes| stripes.estimate.as_ref());
    estimate.map_or_else(Vec::new, |estimate| estimate.planes.iter().map(plane).collect())
}

fn plane(plane: &PlaneEstimate) -> PlaneEntry {
    let [normal_seen, offset_seen] = plane.seen;
    let offset_seen = normal_seen && offset_seen;
    PlaneEntry {
        label: plane.number.to_string(),
        normal: normal_seen.then(|| plane.plane.normal.into_inner().into()),
        offset_mm: offset_seen.then(|| plane.plane.offset_in_base_m() * MM_PER_M),
        sigma_deg: normal_seen.then(|| plane.sigma_rad.to_degrees()),
        sigma_mm: offset_seen.then_some(plane.sigma_m * MM_PER_M),
        bow_mm: plane.bow_m * MM_PER_M,
    }
}

/// Use of the stripes; `None` if there are none, or only seam points were requested.
#[must_use]
pub(crate) fn entry(c: &Calibration) -> Option<StripesEntry> {
    let StripeOutcome { used, because, frames, with_both, skipped, estimate, .. } =
        c.findings.stripes.as_ref()?;
    let estimate = estimate.as_ref();
    let counts = estimate.map_or_else(OutlierCounts::default, |e| e.counts);
    let angles = estimate.map_or(&[][..], |e| &e.angles);
    let steps = estimate.map_or(&[][..], |e| &e.steps);
    Some(StripesEntry {
        used: used.name().to_owned(),
        decided_by: because.code().to_owned(),
        frames: *frames,
        frames_with_both: *with_both,
        skipped: skipped.iter().map(|(why, count)| (why.code().to_owned(), *count)).collect(),
        stripes: counts.stripes,
        rejected: counts.rejected_stripes,
        edge_points: counts.edge_points,
        rejected_edge_points: counts.rejected_edge_points,
        noise_factor: estimate.map(|e| e.noise_factor),
        sigmas_apart: estimate.and_then(|e| e.sigmas_apart),
        joint_angles: angles
            .iter()
            .map(|angle| AngleEntry {
                angle_deg: angle.value_rad.to_degrees(),
                sigma_deg: angle.sigma_rad.to_degrees(),
            })
            .collect(),
        joint_steps: steps
            .iter()
            .map(|step| HeightStepEntry {
                step_mm: step.value_m * MM_PER_M,
                sigma_mm: step.sigma_m * MM_PER_M,
            })
            .collect(),
        seam_answer: estimate.map(|e| answer(c, &e.seam)),
        stripe_answer: estimate.map(|e| answer(c, &e.stripe)),
    })
}

fn answer(c: &Calibration, answer: &Answer) -> AnswerEntry {
    let of_file = c.for_file(&answer.parameters, &answer.covariance);
    let seen = |k: usize| answer.observability.observable_components[k];
    let sigma = |k: usize| seen(k).then(|| of_file.covariance[(k, k)].max(0.0).sqrt());
    let pose = &of_file.tool_from_camera;
    let three = |first: usize| [first, first + 1, first + 2];
    let turn_seen = three(ROTATION).into_iter().all(seen);
    AnswerEntry {
        time_offset_s: seen(TIME_OFFSET).then(|| c.in_recorded_stamps_s(answer.parameters.time_offset_s)),
        tool_from_camera: PoseEntry {
            translation_mm: [0, 1, 2]
                .map(|k| seen(TRANSLATION + k).then(|| pose.translation.vector[k] * MM_PER_M)),
            rotation_wxyz: turn_seen.then(|| positive_w(&pose.rotation)),
        },
        sigma: Sigma {
            time_offset_s: sigma(TIME_OFFSET),
            rotation_rad: three(ROTATION).map(sigma),
            translation_mm: three(TRANSLATION).map(|k| sigma(k).map(|m| m * MM_PER_M)),
        },
        seam_error_mm: answer.seam_error.as_ref().map(|error| error.rms_m * MM_PER_M),
        seam_error_scan_alone_mm: answer.seam_error.as_ref().map(|error| error.scan_alone_m() * MM_PER_M),
    }
}

/// Rows of the summary.
#[must_use]
pub(crate) fn rows(c: &Calibration) -> Vec<(String, String)> {
    let Some(stripes) = &c.findings.stripes else { return Vec::new() };
    let mut rows = vec![("whole stripes".to_owned(), used(stripes))];
    let Some(estimate) = &stripes.estimate else { return rows };
    let joints: BTreeSet<usize> = estimate.planes.iter().map(|plane| plane.number / 2).collect();
    rows.extend(joints.into_iter().map(|joint| ("  plates".to_owned(), plates(estimate, joint))));
    rows.push(("  seam or stripe".to_owned(), side_by_side(c, estimate)));
    rows
}

/// Whether the answer is that of the whole stripes.
#[must_use]
pub(crate) fn are_the_answer(c: &Calibration) -> bool {
    c.findings.stripes.as_ref().is_some_and(|stripes| stripes.used != Measurements::Seam)
}

/// Remark beside figures of the fit to the seam points, if that is not the answer.
#[must_use]
pub(crate) fn of_seam_points(c: &Calibration) -> &'static str {
    if are_the_answer(c) { " (of the fit to the seam points alone)" } else { "" }
}

/// The plates of a joint relative to each other, and their bow.
fn plates(estimate: &StripeEstimate, joint: usize) -> String {
    let of_joint = estimate.planes.iter().filter(|plane| plane.number / 2 == joint);
    let bows: Vec<String> =
        of_joint.map(|plane| format!("plate {} bowed by {}", plane.number, mm(plane.bow_m))).collect();
    let between = fact(estimate, joint).map_or_else(
        || "one plate with an edge".to_owned(),
        |(name, value)| format!("{value} {}", if name == ANGLE { "between them" } else { "step" }),
    );
    format!("{between}; {}", bows.join(", "))
}

/// Name of the fact of plates that meet.
const ANGLE: &str = "angle";

/// The angle of a joint's plates, or their step, with its ±; `None` for one plate.
pub(crate) fn fact(estimate: &StripeEstimate, joint: usize) -> Option<(&'static str, String)> {
    if let Some(angle) = estimate.angles.iter().find(|angle| angle.joint == joint) {
        let (deg, sigma) = (angle.value_rad.to_degrees(), angle.sigma_rad.to_degrees());
        return Some((ANGLE, format!("{deg:.0$}° ± {sigma:.0$}°", digits_for(sigma))));
    }
    let step = estimate.steps.iter().find(|step| step.joint == joint)?;
    let [value, sigma] = [step.value_m, step.sigma_m].map(|m| m * MM_PER_M);
    Some(("step", format!("{value:.0$} mm ± {sigma:.0$} mm", digits_for(sigma))))
}

/// Outliers that were left out.
fn astray(counts: &OutlierCounts) -> impl Iterator<Item = String> + use<> {
    let OutlierCounts { stripes, rejected_stripes, edge_points, rejected_edge_points, .. } = *counts;
    let of = |rejected, all, what| {
        (rejected > 0).then(|| format!("{rejected} of {all} {what} left out: not on the plates"))
    };
    let stripes = of(rejected_stripes, stripes, "stripes");
    stripes.into_iter().chain(of(rejected_edge_points, edge_points, "edge points"))
}

fn used(stripes: &StripeOutcome) -> String {
    let StripeOutcome { used, because, frames, with_both, skipped, estimate, .. } = stripes;
    let planes = estimate.as_ref().map_or(&[][..], |estimate| &estimate.planes);
    let one_alone = planes.iter().any(|one| planes.iter().all(|other| other.number != one.number ^ 1));
    let all = if one_alone { "all plates" } else { "both plates" };
    let lost: Vec<String> = skipped
        .iter()
        .map(|(why, count)| {
            format!("{count} {} left out: {why}", if *count == 1 { "stripe" } else { "stripes" })
        })
        .collect();
    let shown = format!("{with_both} of {frames} frames show {all}");
    let astray = astray(&estimate.as_ref().map_or_else(OutlierCounts::default, |e| e.counts));
    let shown = [shown].into_iter().chain(lost).chain(astray).collect::<Vec<_>>().join("; ");
    let why = match because {
        Because::Asked => "as asked",
        Because::Agreement => "they agree with the seam points",
        Because::KnowsLess => "the seam points are more certain",
        Because::ShowsLess => "they do not determine the whole hand-eye transform",
        Because::Disagreement => "they do not agree with the seam points",
        Because::TooFewFrames => "too few for a separate result",
        Because::Plates(why) => return format!("not used: {why}; {shown}"),
        Because::HeldAtGuess => "unobservable quantities are held at the guess",
    };
    match used {
        Measurements::Seam | Measurements::Auto => format!("not used: {why}; {shown}"),
        Measurements::Stripe => format!("used, {why}; {shown}"),
        Measurements::Both => {
            format!("used with the seam points of the other frames, {why}; {shown}")
        }
    }
}

/// Both answers, and the gain by the stripes.
fn side_by_side(c: &Calibration, estimate: &StripeEstimate) -> String {
    let rotation = |answer: &Answer| {
        let seen = (ROTATION..TRANSLATION).all(|k| answer.observability.observable_components[k]);
        let variance = || (ROTATION..TRANSLATION).map(|k| answer.covariance[(k, k)]).sum::<f64>();
        seen.then(|| variance().sqrt().to_degrees())
    };
    let error = |answer: &Answer| match &answer.seam_error {
        Some(error) => format!("± {}", mm(error.rms_m)),
        None => "not determined".to_owned(),
    };
    let turn = |answer: &Answer| match rotation(answer) {
        Some(deg) => format!("± {deg:.0$}°", digits_for(deg)),
        None => "not determined".to_owned(),
    };
    let offset_ms = |answer: &Answer| {
        let seen = answer.observability.observable_components[TIME_OFFSET];
        let ms = c.in_recorded_stamps_s(answer.parameters.time_offset_s) * 1e3;
        if seen { format!("{ms:.3} ms") } else { "not determined".to_owned() }
    };
    let apart = match estimate.sigmas_apart {
        // The statistic states how rare a difference is: for an ordinary one it is 0.
        Some(sigmas) if sigmas < 1.0 => "less than 1 σ apart".to_owned(),
        Some(sigmas) => format!("{sigmas:.1} σ apart"),
        None => "they cannot be compared".to_owned(),
    };
    format!(
        "{}; time offset {} and {}, rotation {} and {}, seam error {} and {}",
        apart,
        offset_ms(&estimate.seam),
        offset_ms(&estimate.stripe),
        turn(&estimate.seam),
        turn(&estimate.stripe),
        error(&estimate.seam),
        error(&estimate.stripe)
    )
}

fn mm(value_m: f64) -> String {
    let mm = value_m * MM_PER_M;
    format!("{mm:.0$} mm", digits_for(mm))
}
