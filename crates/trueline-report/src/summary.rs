//! The summary in the terminal: the welder reads it.

use crate::export::time_offset;
use crate::number::{digits_for, with_sigma};
use crate::{axes, seam_error, stripes};
use std::fmt::Write;
use trueline_dataset::unit::MM_PER_M;
use trueline_method::assess::cause_kind::CauseKind;
use trueline_method::assess::correlated_noise::{Along, Structure};
use trueline_method::assess::cross_validation::HeldOut;
use trueline_method::assess::observability::{Group, Unobservable};
use trueline_method::assess::residuals::FeatureResidual;
use trueline_method::assess::seam_point_error::SeamPointError;
use trueline_method::input::timestamps::StampReport;
use trueline_method::problem::parameters::{LINES, ROTATION, TIME_OFFSET, TRANSLATION, line_index};
use trueline_method::{Calibration, Hold, Reason, Status};

const MS_PER_S: f64 = 1e3;

/// The verdict. A refusal leads with the missing motion, which explains the reasons below it.
fn verdict(c: &Calibration) -> String {
    match c.status() {
        Status::Accepted => "accepted".to_owned(),
        Status::NotAccepted => match leading_motion(c) {
            Some(motion) => format!("NOT accepted: {motion}"),
            None => "NOT accepted:".to_owned(),
        },
    }
}

/// The missing motion, if the first reason is an undetermined quantity.
fn leading_motion(c: &Calibration) -> Option<String> {
    let is_unseen = matches!(c.reasons().first(), Some(Reason::Unobservable(_)));
    is_unseen.then(|| missing_motion(&c.findings.unknowns.observability.unobservable)).flatten()
}

/// The verdict and the main answer in one sentence.
#[must_use]
pub fn sentence(c: &Calibration) -> String {
    if let (Status::NotAccepted, Some(reason)) = (c.status(), c.reasons().first()) {
        if let Some(motion) = leading_motion(c) {
            return format!("Not accepted: {motion}");
        }
        let more = c.reasons().len() - 1;
        return format!(
            "Not accepted: {reason}{}",
            if more > 0 { format!(" ({more} more below)") } else { String::new() }
        );
    }
    if c.findings.stops.is_some() {
        return format!("Accepted: {} stops, without a time offset.", c.findings.streams.images.count);
    }
    if !c.is_known(TIME_OFFSET) {
        return "Accepted without the time offset, which this scan does not determine.".to_owned();
    }
    let ms = c.recorded_time_offset_s() * MS_PER_S;
    let which = if ms >= 0.0 { "late" } else { "early" };
    let size = with_sigma(ms.abs(), c.sigma(TIME_OFFSET).map(|s| s * MS_PER_S), "ms");
    let rejected = match c.findings.fit.residuals.outliers {
        0 => String::new(),
        n => format!(", {n} outliers rejected"),
    };
    let accepted = match c.warnings().len() {
        0 => "Accepted".to_owned(),
        1 => "Accepted with a warning".to_owned(),
        n => format!("Accepted with {n} warnings"),
    };
    let residual = c.findings.fit.residuals.rms_m * MM_PER_M;
    format!("{accepted}: images are stamped {size} {which}; residual {residual:.3} mm RMS{rejected}.")
}

/// The missing motion, in two short sentences; `None` if nothing is missing.
fn missing_motion(unobservable: &[Unobservable]) -> Option<String> {
    let of = |group: Group| unobservable.iter().find(|what| what.group == group);
    if let Some(translation) = of(Group::Translation) {
        let about = if translation.directions.len() > 1 { "two axes" } else { "a second axis" };
        return Some(format!("the sensor was tilted too little. Tilt it by ±10° or more about {about}."));
    }
    if of(Group::Rotation).is_some() {
        let motion =
            "the seam moved too little through the field of view. Sweep it along the stripe and in range.";
        return Some(motion.to_owned());
    }
    of(Group::TimeOffset).map(|_| {
        "the sensor moved too little across the seam. Sweep it across, faster and with changing speed."
            .to_owned()
    })
}

/// The whole summary, a few lines of plain text.
#[must_use]
pub fn text(c: &Calibration) -> String {
    let mut out = String::new();
    // Writing to a String cannot fail.
    let _ = writeln!(out, "Calibration {}", verdict(c));
    for reason in c.reasons() {
        let _ = writeln!(out, "  - {reason}");
    }
    for warning in c.warnings() {
        let _ = writeln!(out, "  warning: {warning}");
    }
    let _ = writeln!(out);
    for (name, value) in rows(c) {
        let _ = writeln!(out, "  {name:<22} {value}");
    }
    out
}

/// The rule for a driver; a time offset that contains how far the arm lags behind its command is for that stream alone.
fn rule(c: &Calibration) -> String {
    let rule = time_offset::rule_with(c.recorded_time_offset_s(), c.sigma(TIME_OFFSET));
    let cause = c.findings.checks.cause.as_ref();
    if cause.is_some_and(|cause| cause.kind == CauseKind::CommandedPose) {
        format!("{rule}, for this stream of commanded poses only")
    } else {
        rule
    }
}

/// Name of the row that is drawn in letters.
pub(crate) const OVER_TIME: &str = "residual over time";

/// Names and values of the summary's table; the report shows the same.
#[must_use]
pub fn rows(c: &Calibration) -> Vec<(String, String)> {
    let mut rows = seam_error::rows(c);
    rows.push(("time offset".to_owned(), offset(c)));
    if c.is_known(TIME_OFFSET) && c.status() == Status::Accepted {
        rows.push(("to use it".to_owned(), rule(c)));
    }
    for (k, axis) in ["x", "y", "z"].iter().enumerate() {
        rows.push((format!("hand-eye translation {axis}"), translation(c, k)));
    }
    rows.push(("hand-eye rotation".to_owned(), rotation(c)));
    rows.extend(rotation_sigma(c).map(|text| ("  uncertainty".to_owned(), text)));
    for k in 0..c.best_fit().lines.len() {
        rows.push((format!("line {k}"), line(c, k)));
    }
    rows.extend(curve(c).map(|text| ("curve".to_owned(), text)));
    rows.extend(axes::rows(c));
    rows.extend(cad(c).map(|text| ("CAD".to_owned(), text)));
    rows.extend(seam_error::straightness(c));
    rows.extend(stripes::rows(c));
    rows.push(("residual".to_owned(), residual(c)));
    rows.extend(correlated(c).map(|text| ("  correlated".to_owned(), text)));
    rows.extend(over_time(c).map(|bars| (OVER_TIME.to_owned(), bars)));
    rows.push(("features".to_owned(), features(c)));
    if let Some(check) = &c.findings.checks.held_out {
        rows.push((
            "held-out check".to_owned(),
            format!("{}{}", held_out(check), stripes::of_seam_points(c)),
        ));
    }
    if let Some(torch) = &c.findings.checks.seam_point_error {
        rows.push(("at the torch".to_owned(), at_torch(torch)));
    }
    if c.findings.stops.is_some() {
        rows.push(("stops".to_owned(), c.findings.streams.images.count.to_string()));
    } else {
        rows.push(("runner-up".to_owned(), runner_up(c)));
        rows.push(("robot stream".to_owned(), robot(c)));
        rows.push(("image stream".to_owned(), stream(&c.findings.streams.images)));
    }
    rows.push((
        "solver".to_owned(),
        format!(
            "{} steps in all; {}{}",
            c.findings.fit.iterations.len(),
            c.findings.fit.termination,
            stripes::of_seam_points(c)
        ),
    ));
    rows
}

const UNSEEN: &str = "cannot be determined from this scan";

/// Text in place of a time offset if the robot stands at each reading.
pub(crate) const AT_STOPS: &str = "none: the robot stands still at each reading";

fn offset(c: &Calibration) -> String {
    if c.findings.stops.is_some() {
        return AT_STOPS.to_owned();
    }
    if !c.is_known(TIME_OFFSET) {
        return UNSEEN.to_owned();
    }
    let sigma = c.sigma(TIME_OFFSET).map(|s| s * MS_PER_S);
    let value = c.recorded_time_offset_s() * MS_PER_S;
    let late = if value >= 0.0 { "images are stamped late" } else { "images are stamped early" };
    format!("{}  ({late})", with_sigma(value, sigma, "ms"))
}

fn translation(c: &Calibration, axis: usize) -> String {
    if !c.is_known(TRANSLATION + axis) {
        return UNSEEN.to_owned();
    }
    let value = c.file_tool_from_camera().translation.vector[axis] * MM_PER_M;
    with_sigma(value, c.sigma(TRANSLATION + axis).map(|s| s * MM_PER_M), "mm")
}

fn rotation(c: &Calibration) -> String {
    if c.rotation().is_err() {
        return UNSEEN.to_owned();
    }
    let [w, x, y, z] = crate::number::positive_w(&c.file_tool_from_camera().rotation);
    format!(
        "{w:.6} {x:.6} {y:.6} {z:.6}  (quaternion w, x, y, z; `trueline export` writes your robot's angles)"
    )
}

fn rotation_sigma(c: &Calibration) -> Option<String> {
    let axis = |k: usize| {
        let degrees = c.sigma(ROTATION + k).map(f64::to_degrees);
        degrees.map_or_else(|| "–".to_owned(), |deg| format!("± {deg:.0$}°", digits_for(deg)))
    };
    let is_known = (ROTATION..TRANSLATION).any(|k| c.sigma(k).is_some());
    is_known.then(|| format!("{}  {}  {}  about the tool's x, y, z", axis(0), axis(1), axis(2)))
}

fn line(c: &Calibration, k: usize) -> String {
    let line = &c.best_fit().lines[k];
    let first = line_index(k);
    if !(0..4).all(|j| c.is_known(first + j)) {
        return UNSEEN.to_owned();
    }
    let (p, d) = (line.anchor() * MM_PER_M, line.direction());
    format!("through ({:.2}, {:.2}, {:.2}) mm along ({:.5}, {:.5}, {:.5})", p.x, p.y, p.z, d.x, d.y, d.z)
}

/// Length, knots and uncertainty of a curve.
fn curve(c: &Calibration) -> Option<String> {
    let found = c.findings.curve.as_ref()?;
    let closed = match found.seams.len() {
        ..2 if found.closed => "closed".to_owned(),
        ..2 => "open".to_owned(),
        several => format!("{several} seams"),
    };
    let squares: f64 = found.sigma_m.iter().map(|sigma_m| sigma_m * sigma_m).sum();
    let rms_mm = (squares / found.sigma_m.len().max(1) as f64).sqrt() * MM_PER_M;
    let is_placed = (TIME_OFFSET..LINES).all(|component| c.is_known(component));
    let sigma = if is_placed { format!(", ± {rms_mm:.3} mm across") } else { String::new() };
    Some(format!(
        "{closed}, {:.1} mm long, {} knots {:.1} mm apart{sigma}",
        found.length_m * MM_PER_M,
        found.knots,
        found.spacing_m * MM_PER_M
    ))
}

/// How far the seam is off its drawing, and the axis about which the drawing does not determine the position of the part.
fn cad(c: &Calibration) -> Option<String> {
    let found = c.findings.curve.as_ref()?.cad.as_ref()?;
    let cad = c.findings.config.seam_cad.as_ref()?;
    let adds = if found.used { "" } else { ": the scan alone is more certain" };
    let off = format!(
        "seam {:.3} mm off {} (RMS; tolerance {} mm{adds})",
        found.rms_m * MM_PER_M,
        cad.file,
        cad.tolerance_m * MM_PER_M
    );
    let Some(symmetry) = &found.symmetry else { return Some(off) };
    let (axis, point) = (symmetry.axis, symmetry.point_m * MM_PER_M);
    let turn = symmetry.angle_rad.map_or_else(
        || "any turn".to_owned(),
        |angle_rad| format!("a turn of {:.0}°", angle_rad.to_degrees()),
    );
    Some(format!(
        "{off}; {turn} about ({:.3}, {:.3}, {:.3}) through ({:.1}, {:.1}, {:.1}) mm fits as well",
        axis.x, axis.y, axis.z, point.x, point.y, point.z
    ))
}

fn residual(c: &Calibration) -> String {
    if c.findings.fit.residuals.used == 0 {
        return "none: no feature could be used".to_owned();
    }
    let from = if c.findings.curve.is_some() { "curve" } else { "line" };
    let mm = format!("{:.3} mm RMS from the {from}", c.findings.fit.residuals.rms_m * MM_PER_M);
    let px = c.findings.fit.residuals.rms_px.map(|px| format!(", {px:.3} px in the image"));
    format!("{mm}{}{}", px.unwrap_or_default(), stripes::of_seam_points(c))
}

/// Correlated residuals, and their treatment.
fn correlated(c: &Calibration) -> Option<String> {
    let Structure::Correlated(noise) = &c.findings.fit.structure else { return None };
    let [across, height] = noise.sigma_m.map(|m| m * MM_PER_M);
    Some(match noise.along {
        Along::Time => {
            format!(
                "{across:.3} and {height:.3} mm RMS correlated over some frames: treated as noise in time"
            )
        }
        Along::Seam => {
            format!("the seam wanders by {across:.3} and {height:.3} mm RMS: treated as its form")
        }
    })
}

/// Parts of the scan in [`over_time`].
const BARS: usize = 40;

/// The residual in parts of the scan as bars, the full height three times the typical one; `None` for a scan that is
/// too short.
fn over_time(c: &Calibration) -> Option<String> {
    let used: Vec<&FeatureResidual> = c.findings.fit.features.iter().filter(|f| !f.is_outlier()).collect();
    let (first, last) = (used.first()?.stamp_s, used.last()?.stamp_s);
    if used.len() < 4 * BARS || last <= first {
        return None;
    }
    let mut sums = [(0.0, 0_usize); BARS];
    for f in used {
        let part = ((f.stamp_s - first) / (last - first) * BARS as f64) as usize;
        let sum = &mut sums[part.min(BARS - 1)];
        *sum = (sum.0 + f.offset_m.norm_squared(), sum.1 + 1);
    }
    let rms = |(sum, count): &(f64, usize)| (*count > 0).then(|| (sum / *count as f64).sqrt());
    let typical = trueline_method::order_statistics::median(sums.iter().filter_map(rms))?;
    let bar = |part: &(f64, usize)| match rms(part) {
        None => ' ',
        Some(rms) => {
            ['▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'][((rms / (3.0 * typical) * 8.0) as usize).min(7)]
        }
    };
    Some(format!("{}  {:.3} mm typical", sums.iter().map(bar).collect::<String>(), typical * MM_PER_M))
}

fn features(c: &Calibration) -> String {
    let r = &c.findings.fit.residuals;
    let mut text = format!("{} used, {} rejected as outliers", r.used - r.outliers, r.outliers);
    for (reason, count) in &r.skipped {
        let _ = write!(text, "; {count} {reason}");
    }
    text
}

fn held_out(check: &HeldOut) -> String {
    let parts = if check.passes { "passes" } else { "blocks of time" };
    if check.parts.iter().all(|p| p.sigmas.amax() == 0.0) {
        return "not possible: the scan does not determine anything".to_owned();
    }
    let disagreement = check.parts.iter().map(|p| p.sigmas.amax()).fold(0.0, f64::max);
    format!(
        "{:.4} mm RMS predicted, {:.4} mm fitted; {} {parts} agree within {disagreement:.1} σ",
        check.rms_m * MM_PER_M,
        check.fitted_rms_m * MM_PER_M,
        check.parts.len()
    )
}

fn at_torch(torch: &SeamPointError) -> String {
    let [along, across, height] = torch.sigma_m.map(|m| {
        let mm = m * MM_PER_M;
        format!("{mm:.0$} mm", digits_for(mm))
    });
    format!(
        "at {:.0} mm/s and {:.0} mm from the sensor: ± {across} across, {along} along, {height} in height",
        torch.speed_m_s * MM_PER_M,
        torch.stand_off_m * MM_PER_M
    )
}

fn runner_up(c: &Calibration) -> String {
    match &c.findings.checks.ambiguity.runner_up {
        Some(other) => format!(
            "time offset {:.1} ms: {} (fits {:.0} % of the points, the best {:.0} %; z = {:.0})",
            c.in_recorded_stamps_s(other.time_offset_s) * MS_PER_S,
            if other.test.decided() { "clearly worse" } else { "cannot be separated" },
            100.0 * other.test.explains,
            100.0 * other.test.best_explains,
            other.test.z
        ),
        None if c.findings.config.hold.contains(&Hold::TimeOffset) => {
            "not searched: the offset was held fixed".to_owned()
        }
        None => format!("none within ± {} s", c.findings.config.offset_search_s),
    }
}

fn robot(c: &Calibration) -> String {
    let treated = if c.findings.streams.robot_smoothed { ", smoothed by a local fit" } else { "" };
    format!(
        "{}; position noise {:.4} mm{treated}",
        stream(&c.findings.streams.robot),
        c.findings.streams.robot_noise_m * MM_PER_M
    )
}

fn stream(s: &StampReport) -> String {
    let (Some(period_s), Some(jitter_s)) = (s.period_s, s.jitter_s) else {
        return format!(
            "{:.3} ms median period, no constant sampling period found",
            s.median_period_s * MS_PER_S
        );
    };
    let silences = match s.silences {
        0 => String::new(),
        n => format!(", with {n} longer gaps"),
    };
    let used = if s.dejittered { "stamps smoothed" } else { "stamps as recorded" };
    format!(
        "{:.4} ms period, jitter {:.3} ms{}, {} missing{silences}{}; {used}",
        period_s * MS_PER_S,
        jitter_s * MS_PER_S,
        latest(s, jitter_s),
        s.missing.unwrap_or(0),
        steps(s)
    )
}

/// A lateness of this many times the jitter is a stall or a queue, and is reported.
const LATE: f64 = 5.0;

fn latest(s: &StampReport, jitter_s: f64) -> String {
    match s.lateness_s {
        Some([_, most_s]) if most_s > LATE * jitter_s => {
            format!(" (packets up to {:.1} ms late)", most_s * MS_PER_S)
        }
        _ => String::new(),
    }
}

fn steps(s: &StampReport) -> String {
    match s.steps[..] {
        [] => String::new(),
        [(_, step_s)] if s.step_taken_out && s.dejittered => {
            format!(", a step of {:+.2} ms removed", step_s * MS_PER_S)
        }
        [(_, step_s)] => format!(", a step of {:+.2} ms", step_s * MS_PER_S),
        _ => format!(", {} steps", s.steps.len()),
    }
}
