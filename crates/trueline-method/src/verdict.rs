//! Whether a calibration can be accepted: reasons against it and warnings, in a user's words.

use crate::assess::cross_validation::HeldOut;
use crate::assess::observability::Observability;
use crate::assess::outlier_segments::{Cause, OutlierSegment};
use crate::assess::residuals::{ResidualSummary, SKIP_OUTSIDE};
use crate::config::Requirement;
use crate::hypotheses::ambiguity::{Ambiguity, RunnerUp};
use crate::hypotheses::choice::{DecidedBy, Statement};
use crate::hypotheses::drift_and_step::{Drift, Step};
use crate::hypotheses::paired_test::DECISIVE_Z;
use crate::input::timestamps::StampReport;
use crate::problem::parameters::{LINES, Parameters, ROTATION, TIME_OFFSET, TRANSLATION};
use trueline_lsq::Termination;

const MM_PER_M: f64 = 1e3;
const MS_PER_S: f64 = 1e3;

/// Residuals this much larger than expected are not noise: something is wrong with the data or the frames.
const NOISE_FACTOR_LIMIT: f64 = 3.0;
/// Beyond these the noise is another than was expected, and the user should know.
const NOISE_FACTOR_USUAL: [f64; 2] = [0.4, 1.2];
/// A result that can place fewer of the features than this is of another scan …
const LEAST_USED: f64 = 0.5;
/// … and so is one that leaves many out and explains the rest badly.
const LEAST_USED_BADLY: (f64, f64) = (0.8, 1.5);
/// With more robot rows that repeat a stamp the stamps are too coarse to tell when a pose was.
const COARSE_STAMPS: f64 = 0.1;
/// With more outliers than this the majority no longer decides.
const OUTLIER_LIMIT: f64 = 0.5;
/// Of five parts and seven unknowns the largest reaches 3 σ by chance.
const HELD_OUT_SIGMAS: f64 = 5.0;

/// Predicting a part from the others costs some percent with a few hundred features; more is disagreement.
const HELD_OUT_RATIO: f64 = 1.1;
/// A dozen unknowns make the error of prediction: chance does not make its square four times what is expected.
const HELD_OUT_SURPLUS: f64 = 4.0;
/// More outliers than this should be looked at.
const MANY_OUTLIERS: f64 = 0.2;

/// What a verdict is made from.
pub struct Evidence<'a> {
    /// What can be seen.
    pub observability: &'a Observability,
    /// Whether unseen directions were held at a guess, as the user allowed.
    pub held: bool,
    /// Whether a mirrored attitude fits equally well.
    pub equal_twin: bool,
    /// What else explains the scan.
    pub ambiguity: &'a Ambiguity,
    /// A better optimum than the guess led to.
    pub better: Option<&'a Parameters>,
    /// The best time offset, s.
    pub time_offset_s: f64,
    /// Why the solver ended.
    pub termination: Termination,
    /// How much larger residuals are than expected.
    pub noise_factor: f64,
    /// Residual figures.
    pub residuals: &'a ResidualSummary,
    /// Stretches that do not belong.
    pub disruptions: &'a [OutlierSegment],
    /// A step that a clock has made.
    pub stepped: Option<&'a Step>,
    /// A drift that was taken out.
    pub drifted: Option<&'a Drift>,
    /// What was asked for.
    pub require: &'a Requirement,
    /// Standard deviation of each sensor unknown; `None` if unknown.
    pub sigma: [Option<f64>; LINES],
    /// The parts of the scan against each other.
    pub held_out: Option<&'a HeldOut>,
    /// Robot and image stamps.
    pub stamps: [&'a StampReport; 2],
    /// Number of features in the recording.
    pub features: usize,
    /// Recorded stamp of time 0, s: stamps in messages are those of the files.
    pub origin_s: f64,
    /// Robot samples that only repeat the pose before, and were left out.
    pub repeated_poses: usize,
    /// Rows of the robot stream.
    pub robot_rows: usize,
}

impl Evidence<'_> {
    /// A time as it stands in the files, s.
    fn stamp_s(&self, since_start_s: f64) -> f64 {
        self.origin_s + since_start_s
    }
}

/// Why the result cannot be accepted; empty if it can.
#[must_use]
pub fn reasons(e: &Evidence<'_>) -> Vec<String> {
    if e.residuals.used == 0 {
        // Nothing else that could be said means anything.
        return too_few_used(e).into_iter().collect();
    }
    let mut reasons: Vec<String> = Vec::new();
    if !e.held {
        reasons.extend(e.observability.unseen.iter().map(|unseen| unseen.advice.clone()));
    }
    if e.equal_twin {
        reasons.push(
            "two mirrored attitudes of the sensor fit equally well: tilt the torch by 10° or more, or give an \
             initial guess of the hand-eye transform"
                .to_owned(),
        );
    }
    reasons.extend(ambiguity_reasons(e));
    if !e.termination.is_converged() {
        reasons.push(format!("the solver did not converge ({})", e.termination));
    }
    if e.noise_factor > NOISE_FACTOR_LIMIT {
        reasons.push(format!(
            "residuals are {:.1} times larger than noise explains: wrong units, frames or laser plane, another line, more \
             than half of the features outliers, or stamps that do not tell when (`trueline doctor` tries the usual \
             mistakes); if the sensor is that noisy, say so with --feature-sigma-px or --feature-sigma-mm",
            e.noise_factor
        ));
    }
    reasons.extend(too_few_used(e));
    let [robot, _] = e.stamps;
    if robot.doubles as f64 > COARSE_STAMPS * e.robot_rows as f64 {
        reasons.push(format!(
            "{} of {} robot rows repeat the stamp of the row before: these stamps are too coarse to tell when a pose was; \
             record the controller's own time in device_time_s, or stamp with a finer clock",
            robot.doubles, e.robot_rows
        ));
    }
    let share = e.residuals.outliers as f64 / e.residuals.used.max(1) as f64;
    if share > OUTLIER_LIMIT {
        reasons.push(format!("{:.0} % of the features are outliers", 100.0 * share));
    }
    reasons.extend(e.disruptions.iter().filter_map(|disruption| step_reason(e, disruption)));
    reasons.extend(e.stepped.map(|step| {
        format!(
            "one of the clocks stepped at about {:.3} s: the time offset changes there by {:+.3} ± {:.3} ms",
            e.stamp_s(step.at_s),
            step.step_s * MS_PER_S,
            step.sigma_s * MS_PER_S
        )
    }));
    reasons.extend(unmet(e));
    reasons
}

/// Why a rival of the answer speaks against it.
fn ambiguity_reasons(e: &Evidence<'_>) -> Vec<String> {
    let mut reasons = Vec::new();
    let outdone = e.ambiguity.runner_up.filter(|rival| rival.z < -DECISIVE_Z);
    if let Some(better) = e.better.filter(|_| outdone.is_none()) {
        reasons.push(format!(
            "from this guess the solve ends where the scan fits worse than with a time offset of {:.1} ms and another \
             hand-eye transform: leave the guess out, or correct it",
            better.time_offset_s * MS_PER_S
        ));
    }
    reasons.extend(outdone.map(|rival| outdone_reason(e.time_offset_s, &rival)));
    if e.ambiguity.is_open() {
        reasons.push(ambiguous(e));
    }
    if e.ambiguity.contradicted {
        reasons.push(
            "the answer contradicts what was stated of the cell (--offset-within, --looks): the time offset is outside of \
             the window, or the sensor looks along another axis of the tool"
                .to_owned(),
        );
    }
    reasons
}

fn too_few_used(e: &Evidence<'_>) -> Option<String> {
    let share = e.residuals.used as f64 / e.features as f64;
    let badly = share < LEAST_USED_BADLY.0 && e.noise_factor > LEAST_USED_BADLY.1;
    if share >= LEAST_USED && !badly {
        return None;
    }
    let (reason, count) = e.residuals.skipped.iter().max_by_key(|(_, count)| **count)?;
    let hint =
        if *reason == SKIP_OUTSIDE { "; do both streams cover the scan, stamped by one clock?" } else { "" };
    Some(format!(
        "only {} of {} features could be used; {count}: {reason}{hint}",
        e.residuals.used, e.features
    ))
}

fn outdone_reason(time_offset_s: f64, rival: &RunnerUp) -> String {
    format!(
        "from this guess the time offset comes to {:.1} ms, but {:.1} ms explains the scan better ({:.0} % of the features \
         instead of {:.0} %): leave the guess out, or correct it",
        time_offset_s * MS_PER_S,
        rival.time_offset_s * MS_PER_S,
        100.0 * rival.explains,
        100.0 * rival.best_explains
    )
}

/// The answers that the scan does not tell apart, and what would single each out.
fn ambiguous(e: &Evidence<'_>) -> String {
    let own = std::iter::once((e.time_offset_s, &e.ambiguity.statements));
    let others = e.ambiguity.rivals.iter().map(|rival| (rival.parameters.time_offset_s, &rival.statements));
    let answers: Vec<String> =
        own.chain(others).map(|(offset_s, statements)| answer(offset_s, statements)).collect();
    format!(
        "{} answers explain the scan equally well, because the path repeats itself: {}. State what is known of the cell, \
         give an initial guess, or scan with frequencies that have no common multiple",
        answers.len(),
        answers.join("; ")
    )
}

fn answer(time_offset_s: f64, statements: &[Statement]) -> String {
    let texts: Vec<String> = statements
        .iter()
        .map(|statement| match statement {
            Statement::OffsetWithin(window_s) => format!("--offset-within {window_s:.2}"),
            Statement::Looks(axis) => format!("--looks {}", axis.name()),
        })
        .collect();
    let texts = if texts.is_empty() { String::new() } else { format!(" ({})", texts.join(" or ")) };
    format!("time offset {:.1} ms{texts}", time_offset_s * MS_PER_S)
}

fn step_reason(e: &Evidence<'_>, disruption: &OutlierSegment) -> Option<String> {
    let [from, to] = disruption.span_s.map(|s| e.stamp_s(s));
    match disruption.cause {
        Cause::ClockStep(step_s) => Some(format!(
            "from {from:.2} to {to:.2} s the time offset differs by {:+.2} ms: one of the clocks stepped, or images \
             were queued there",
            step_s * MS_PER_S
        )),
        Cause::RobotStoodStill => Some(format!(
            "from {from:.2} to {to:.2} s the recorded pose does not change while the seam moves in the images: the robot \
             stream froze; cut the recording there"
        )),
        Cause::OtherLine(_) | Cause::Unknown => None,
    }
}

fn unmet(e: &Evidence<'_>) -> Vec<String> {
    let wanted = [
        ("time offset", e.require.time_s, TIME_OFFSET..ROTATION, MS_PER_S, "ms"),
        ("rotation", e.require.rotation_rad, ROTATION..TRANSLATION, 1f64.to_degrees(), "°"),
        ("translation", e.require.translation_m, TRANSLATION..LINES, MM_PER_M, "mm"),
    ];
    let mut reasons = Vec::new();
    for (name, limit, components, scale, unit) in wanted {
        let Some(limit) = limit else { continue };
        let sigmas: Option<Vec<f64>> = e.sigma[components].iter().copied().collect();
        match sigmas.map(|s| s.into_iter().fold(0.0, f64::max)) {
            Some(worst) if worst <= limit => {}
            Some(worst) => reasons.push(format!(
                "{name}: ± {} {unit} is more than the required {} {unit}: scan longer, or with more tilt and \
                 more change of stand-off",
                Significant(worst * scale),
                Significant(limit * scale)
            )),
            None => reasons.push(format!(
                "{name}: an accuracy of {} {unit} is required, but it cannot be seen in this scan",
                Significant(limit * scale)
            )),
        }
    }
    reasons
}

/// What to look at though the result can be used.
#[must_use]
pub fn warnings(e: &Evidence<'_>) -> Vec<String> {
    let mut warnings = Vec::new();
    warnings.extend(e.ambiguity.decided_by.map(|by| decided(e, by)));
    let skipped: usize = e.residuals.skipped.values().sum();
    if skipped * 10 > e.features {
        let list: Vec<String> = e.residuals.skipped.iter().map(|(why, n)| format!("{n}: {why}")).collect();
        warnings.push(format!("{skipped} features could not be used; {}", list.join("; ")));
    }
    if e.held {
        let what: Vec<&str> = e.observability.unseen.iter().map(|u| u.advice.as_str()).collect();
        warnings.push(format!("held at the initial guess: {}", what.join("; ")));
    }
    warnings.extend(e.disruptions.iter().filter_map(|disruption| stretch_warning(e, disruption)));
    warnings.extend(unusual_noise(e.noise_factor));
    let share = e.residuals.outliers as f64 / e.residuals.used.max(1) as f64;
    if share > MANY_OUTLIERS && share <= OUTLIER_LIMIT {
        warnings.push(format!("{:.0} % of the features are outliers", 100.0 * share));
    }
    if let Some(drift) = e.drifted {
        warnings.push(format!(
            "the image clock drifts by {:+.1} ± {:.1} ppm against the robot's; this is taken out, and the time \
             offset holds at {:.1} s",
            drift.ppm,
            drift.sigma_ppm,
            e.stamp_s(drift.about_s)
        ));
    }
    if e.repeated_poses > 0 {
        warnings.push(format!(
            "{} of {} robot rows only repeat the pose before: the controller has news less often than it is asked; the \
             first of each is used",
            e.repeated_poses, e.robot_rows
        ));
    }
    for (name, stamps) in ["robot", "image"].iter().zip(e.stamps) {
        if stamps.doubles > 0 && *name == "robot" {
            warnings.push(format!("{} robot rows repeat the stamp of the row before", stamps.doubles));
        }
        if let Some(grain_s) = stamps.grain_s {
            warnings.push(format!(
                "the {name} stamps are whole multiples of {:.1} ms: if they were rounded down or up rather than to the \
                 nearest, the time offset is off by half of that; its ± allows for it",
                grain_s * MS_PER_S
            ));
            continue;
        }
        warnings.extend(stamp_steps(e, name, stamps));
    }
    warnings.extend(e.held_out.and_then(|held_out| disagreement(e, held_out)));
    warnings
}

fn decided(e: &Evidence<'_>, by: DecidedBy) -> String {
    let others: Vec<String> = (e.ambiguity.rivals.iter())
        .map(|rival| format!("{:.1} ms", rival.parameters.time_offset_s * MS_PER_S))
        .collect();
    let by = match by {
        DecidedBy::Guess => "the initial guess",
        DecidedBy::Statement => "what was stated of the cell",
    };
    format!(
        "the scan alone does not tell this answer from {} other(s), with time offsets of {}: {by} decided",
        others.len(),
        others.join(", ")
    )
}

fn unusual_noise(factor: f64) -> Option<String> {
    let [least, most] = NOISE_FACTOR_USUAL;
    if factor > NOISE_FACTOR_LIMIT || (least..=most).contains(&factor) {
        return None;
    }
    Some(format!(
        "residuals are {factor:.2} times the expected noise; the ± are scaled by it. Either the stated noise is wrong \
         (--feature-sigma-px, --feature-sigma-mm), or something is left that is no noise: the sensor's own calibration, a \
         bent line, a robot that is off its path"
    ))
}

/// Most steps of a stream's stamps that are listed.
const MOST_STEPS: usize = 3;

/// A step of a clock shows in its stream only up to whole periods.
fn stamp_steps(e: &Evidence<'_>, name: &str, stamps: &StampReport) -> Option<String> {
    let list: Vec<String> = stamps
        .steps
        .iter()
        .take(MOST_STEPS)
        .map(|(at_s, step_s)| format!("{:+.2} ms at {:.3} s", step_s * MS_PER_S, e.stamp_s(*at_s)))
        .collect();
    let more = stamps.steps.len().saturating_sub(MOST_STEPS);
    let more = if more > 0 { format!(" and {more} times more") } else { String::new() };
    let period_ms = stamps.period_s.unwrap_or(stamps.median_period_s) * MS_PER_S;
    (!list.is_empty()).then(|| {
        format!(
            "the {name} stamps step by {}{more} (known up to whole periods of {period_ms:.2} ms)",
            list.join(", ")
        )
    })
}

fn stretch_warning(e: &Evidence<'_>, disruption: &OutlierSegment) -> Option<String> {
    let ([from, to], n) = (disruption.span_s.map(|s| e.stamp_s(s)), disruption.features);
    match disruption.cause {
        Cause::ClockStep(_) | Cause::RobotStoodStill => None,
        Cause::OtherLine(beside_m) => Some(format!(
            "from {from:.2} to {to:.2} s nearly all {n} features lie on another line, {:.2} mm beside: the detector \
             followed something else; they are not used",
            beside_m * MM_PER_M
        )),
        Cause::Unknown => Some(format!("from {from:.2} to {to:.2} s nearly all {n} features are outliers")),
    }
}

fn disagreement(e: &Evidence<'_>, held_out: &HeldOut) -> Option<String> {
    let worst = |part: &crate::assess::cross_validation::Part| part.sigmas.iamax();
    let part = held_out.parts.iter().max_by(|a, b| a.sigmas.amax().total_cmp(&b.sigmas.amax()))?;
    let k = worst(part);
    if part.sigmas[k].abs() <= HELD_OUT_SIGMAS {
        let ratio = held_out.rms_m / held_out.fitted_rms_m;
        let surplus = held_out.rms_m.powi(2) - held_out.fitted_rms_m.powi(2);
        let expected = held_out.expected_rms_m.powi(2) - held_out.fitted_rms_m.powi(2);
        return (ratio > HELD_OUT_RATIO && surplus > HELD_OUT_SURPLUS * expected).then(|| {
            format!(
                "the parts of the scan disagree: what the others predict of a part is {:.4} mm off, {ratio:.2} times \
                 the fitted {:.4} mm; is the edge straight, and did nothing move?",
                held_out.rms_m * MM_PER_M,
                held_out.fitted_rms_m * MM_PER_M
            )
        });
    }
    let axis = ["x", "y", "z"];
    let (name, moved) = match k {
        TIME_OFFSET => ("the time offset".to_owned(), format!("{:.3} ms", part.moved[k] * MS_PER_S)),
        ROTATION..TRANSLATION => (
            format!("the rotation about {}", axis[k - ROTATION]),
            format!("{:.4}°", part.moved[k].to_degrees()),
        ),
        _ => (
            format!("the translation {}", axis[k - TRANSLATION]),
            format!("{:.3} mm", part.moved[k] * MM_PER_M),
        ),
    };
    Some(format!(
        "the parts of the scan disagree: without {:.2} to {:.2} s {name} moves by {moved}, {:.1} times what noise \
         explains",
        e.stamp_s(part.span_s[0]),
        e.stamp_s(part.span_s[1]),
        part.sigmas[k].abs()
    ))
}

/// A number with three significant digits, however small.
struct Significant(f64);

impl std::fmt::Display for Significant {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let digits = (2.0 - self.0.abs().log10().floor()).clamp(0.0, 12.0) as usize;
        let text = format!("{:.digits$}", self.0);
        let short = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
        f.write_str(short)
    }
}
