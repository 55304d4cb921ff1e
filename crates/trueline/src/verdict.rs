//! Whether a calibration can be accepted: reasons against it and warnings, in a user's words.

use crate::alternatives::{DECISIVE, RunnerUp};
use crate::clock_check::{Drift, Step};
use crate::config::Requirement;
use crate::disruption::{Cause, Disruption};
use crate::held_out::HeldOut;
use crate::observability::Observability;
use crate::parameters::{LINES, ROTATION, TIME_OFFSET, TRANSLATION};
use crate::residuals::ResidualSummary;
use crate::sampling::StampReport;
use trueline_lsq::Termination;

const MM_PER_M: f64 = 1e3;
const MS_PER_S: f64 = 1e3;

/// Residuals this much larger than expected are not noise: something is wrong with the data or the frames.
const NOISE_FACTOR_LIMIT: f64 = 10.0;
/// With more outliers than this the majority no longer decides.
const OUTLIER_LIMIT: f64 = 0.5;
/// Of several thousand possible steps of a clock the largest reaches 4 σ by chance; the variance is known
/// to some 20 %.
const STEP_SIGMAS: f64 = 7.0;
/// A drift is one hypothesis, not thousands.
const DRIFT_SIGMAS: f64 = 5.0;
/// Of five parts and seven unknowns the largest reaches 3 σ by chance.
const HELD_OUT_SIGMAS: f64 = 5.0;

/// Predicting a part from the others costs some percent with a few hundred features; more is disagreement.
const HELD_OUT_RATIO: f64 = 1.1;

/// What a verdict is made from.
pub struct Evidence<'a> {
    /// What can be seen.
    pub observability: &'a Observability,
    /// Whether unseen directions were held at a guess, as the user allowed.
    pub held: bool,
    /// Whether a mirrored attitude fits equally well.
    pub equal_twin: bool,
    /// The second-best time offset.
    pub runner_up: Option<&'a RunnerUp>,
    /// The best time offset, s.
    pub time_offset_s: f64,
    /// Why the solver ended.
    pub termination: Termination,
    /// How much larger residuals are than expected.
    pub noise_factor: f64,
    /// Residual figures.
    pub residuals: &'a ResidualSummary,
    /// Stretches that do not belong.
    pub disruptions: &'a [Disruption],
    /// A step of a clock.
    pub step: Option<&'a Step>,
    /// Drift of the offset.
    pub drift: Option<&'a Drift>,
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
}

/// Why the result cannot be accepted; empty if it can.
#[must_use]
pub fn reasons(e: &Evidence<'_>) -> Vec<String> {
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
    reasons.extend(e.runner_up.filter(|other| !other.decided()).map(|other| rival(e.time_offset_s, other)));
    if !e.termination.is_converged() {
        reasons.push(format!("the solver did not converge ({})", e.termination));
    }
    if e.noise_factor > NOISE_FACTOR_LIMIT {
        reasons.push(format!(
            "residuals are {:.0} times larger than noise explains: check units, frames and the laser plane \
             (`trueline doctor` tries the usual mistakes)",
            e.noise_factor
        ));
    }
    let share = e.residuals.outliers as f64 / e.residuals.used.max(1) as f64;
    if share > OUTLIER_LIMIT {
        reasons.push(format!("{:.0} % of the features are outliers", 100.0 * share));
    }
    reasons.extend(e.disruptions.iter().filter_map(step_reason));
    reasons.extend(e.step.filter(|s| is_real_step(s, e.drift)).map(|step| {
        format!(
            "one of the clocks stepped at {:.3} s: the time offset changes there by {:+.3} ± {:.3} ms",
            step.at_s,
            step.step_s * MS_PER_S,
            step.sigma_s * MS_PER_S
        )
    }));
    reasons.extend(unmet(e));
    reasons
}

fn rival(time_offset_s: f64, other: &RunnerUp) -> String {
    let [best, rival] = [time_offset_s, other.time_offset_s].map(|s| s * MS_PER_S);
    if other.log_likelihood_lost < -DECISIVE {
        return format!(
            "from this guess the time offset comes to {best:.1} ms, but {rival:.1} ms explains the scan better \
             ({:.0} % of the features instead of {:.0} %): leave the guess out, or correct it",
            100.0 * other.explains,
            100.0 * other.best_explains
        );
    }
    format!(
        "two time offsets fit about equally well, {best:.1} ms and {rival:.1} ms: the path repeats itself; scan \
         with frequencies that have no common multiple"
    )
}

/// Whether a step is more than chance, and more than a drift, which looks like a step in the middle.
#[must_use]
pub fn is_real_step(step: &Step, drift: Option<&Drift>) -> bool {
    let significance = (step.step_s / step.sigma_s).abs();
    let drift_significance = drift.map_or(0.0, |d| (d.ppm / d.sigma_ppm).abs());
    significance > STEP_SIGMAS && significance > drift_significance
}

fn step_reason(disruption: &Disruption) -> Option<String> {
    let [from, to] = disruption.span_s;
    match disruption.cause {
        Cause::ClockStep(step_s) => Some(format!(
            "from {from:.2} to {to:.2} s the time offset differs by {:+.2} ms: one of the clocks stepped, or images \
             were queued there",
            step_s * MS_PER_S
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
                "{name}: ± {:.4} {unit} is more than the required {} {unit}: scan longer, or with more tilt and \
                 more change of stand-off",
                worst * scale,
                limit * scale
            )),
            None => reasons.push(format!(
                "{name}: an accuracy of {} {unit} is required, but it cannot be seen in this scan",
                limit * scale
            )),
        }
    }
    reasons
}

/// What to look at though the result can be used.
#[must_use]
pub fn warnings(e: &Evidence<'_>) -> Vec<String> {
    let mut warnings = Vec::new();
    let skipped: usize = e.residuals.skipped.values().sum();
    if skipped * 10 > e.features {
        warnings.push(format!("{skipped} of {} features could not be used; see skipped", e.features));
    }
    if e.held {
        let what: Vec<&str> = e.observability.unseen.iter().map(|u| u.advice.as_str()).collect();
        warnings.push(format!("held at the initial guess: {}", what.join("; ")));
    }
    warnings.extend(e.disruptions.iter().filter_map(stretch_warning));
    let stepped = e.step.is_some_and(|step| is_real_step(step, e.drift));
    if let Some(drift) = e.drift.filter(|d| is_significant(d) && !stepped) {
        warnings.push(format!(
            "the image clock drifts by {:+.1} ± {:.1} ppm against the robot's; this is taken out, and the time \
             offset holds at {:.1} s",
            drift.ppm, drift.sigma_ppm, drift.about_s
        ));
    }
    for (name, stamps) in ["robot", "image"].iter().zip(e.stamps) {
        if stamps.doubles > 0 && *name == "robot" {
            warnings.push(format!("{} robot rows repeat the stamp of the row before", stamps.doubles));
        }
        warnings.extend(stamps.steps.iter().map(|(at_s, step_s)| {
            format!("the {name} stamps step by {:+.2} ms at {at_s:.3} s", step_s * MS_PER_S)
        }));
    }
    warnings.extend(e.held_out.and_then(disagreement));
    warnings
}

/// Whether a drift is more than chance.
#[must_use]
pub fn is_significant(drift: &Drift) -> bool {
    drift.ppm.abs() > DRIFT_SIGMAS * drift.sigma_ppm
}

fn stretch_warning(disruption: &Disruption) -> Option<String> {
    let ([from, to], n) = (disruption.span_s, disruption.features);
    match disruption.cause {
        Cause::ClockStep(_) => None,
        Cause::OtherLine(beside_m) => Some(format!(
            "from {from:.2} to {to:.2} s nearly all {n} features lie on another line, {:.2} mm beside: the detector \
             followed something else; they are not used",
            beside_m * MM_PER_M
        )),
        Cause::Unknown => Some(format!("from {from:.2} to {to:.2} s nearly all {n} features are outliers")),
    }
}

fn disagreement(held_out: &HeldOut) -> Option<String> {
    let worst = |part: &crate::held_out::Part| part.sigmas.iamax();
    let part = held_out.parts.iter().max_by(|a, b| a.sigmas.amax().total_cmp(&b.sigmas.amax()))?;
    let k = worst(part);
    if part.sigmas[k].abs() <= HELD_OUT_SIGMAS {
        let ratio = held_out.rms_m / held_out.fitted_rms_m;
        return (ratio > HELD_OUT_RATIO).then(|| {
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
        part.span_s[0],
        part.span_s[1],
        part.sigmas[k].abs()
    ))
}
