//! Adjusts the seam-point answer together with every systematic error.

use crate::adjustment::answer::{Answer, adjust};
use crate::adjustment::settings::Settings;
use crate::assess::levels::SystematicLevels;
use crate::assess::observability::Group;
use crate::assess::outlier_segments;
use crate::assess::residuals::{self, FeatureResidual};
use crate::assess::seam_error::{self, SeamError, SharedError};
use crate::axes::finding::{self, sigmas_before};
use crate::calibrate::answered::{Answered, take};
use crate::calibrate::basins::{Basin, beside_rivals, likelier};
use crate::calibrate::clamped::{clamped_again, passes_in_doubt};
use crate::calibrate::concluded::{Concluded, waviness_m};
use crate::calibrate::lagging::{Lagging, lagging};
use crate::calibrate::with_stripes::SeamErrors;
use crate::config::{Config, ResidualKind};
use crate::findings::Findings;
use crate::hypotheses::search::{BetterMinimum, Mirrored};
use crate::input::observations::Observations;
use crate::input::robot_motion::RobotMotion;
use crate::input::skip::Skip;
use crate::models::{TriedLag, of_adjustment};
use crate::problem::line_problem::LineProblem;
use crate::problem::parameters::{Parameters, ROTATION, TIME_OFFSET, TRANSLATION};
use crate::solve::fit::Fit;
use crate::verdict::stepped_stretch;
use std::collections::BTreeMap;
use trueline_dataset::Recording;
use trueline_lsq::Termination;

/// An adjusted answer and the seam error that follows from it.
struct Adjusted {
    /// The answer.
    pub answer: Answer,
    /// Predicted error of a later seam point; `None` if the field is empty.
    pub seam_error: Option<SeamError>,
    /// For each rival of the optimum: whether it is still about as likely after a full adjustment.
    pub is_open: Vec<bool>,
    /// A plainly likelier answer that the guess or a statement excluded.
    pub better: Option<BetterMinimum>,
    /// The scan with its external axes where they were found; `None` without axes.
    pub with_axes: Option<Observations>,
    /// The lags of the robot that were tried. The first is the answer's.
    pub tried: Vec<TriedLag>,
}

impl Adjusted {
    /// The answer with a part that moved. It is refused, and its rivals stay open: they were not adjusted so.
    fn of_moved_part(from: &Concluded<'_>, answer: Answer) -> Self {
        Self {
            tried: vec![TriedLag::none(answer.comparable())],
            seam_error: seam_error(from, &answer),
            with_axes: with_axes(from, &answer),
            is_open: vec![true; from.ambiguity.rivals.len()],
            better: from.better.clone(),
            answer,
        }
    }
}

/// Whether there is something to adjust.
#[must_use]
pub(crate) fn applies(recording: &Recording, config: &Config, fit: &Fit, levels: &SystematicLevels) -> bool {
    !is_ideal(recording, config, levels) && is_possible(recording, config, fit)
}

/// Whether the cell states that it has no systematic errors beside the robot's.
fn is_ideal(recording: &Recording, config: &Config, levels: &SystematicLevels) -> bool {
    waviness_m(recording, config) == 0.0 && levels.edge_radius_m == 0.0 && recording.axes.is_empty()
}

/// Whether the adjustment describes the scan.
fn is_possible(recording: &Recording, config: &Config, fit: &Fit) -> bool {
    let is_paper = config.residual != ResidualKind::Sheet || fit.parameters().curvatures.is_empty();
    // The error of a robot at stops is noise, one draw a stop. External axes are estimated only in the adjustment.
    let is_at_stops = config.at_stops && recording.axes.is_empty();
    !(is_paper || fit.prior.is_some() || is_at_stops)
}

/// Adjusts the optimum of noise alone. `None` if there is no systematic error to adjust: a straight seam with a sharp edge of a part at rest, the
/// paper's residual, directions held at a guess, a standing robot.
///
/// # Errors
/// [`Unsolved`] where there would be, and the equations have no solution.
fn adjusted(from: &Concluded<'_>, problem: &LineProblem<'_>) -> Result<Option<Adjusted>, Unsolved> {
    let (config, fit) = (from.settings.config, &from.assessed.drift_free.fit);
    let is_stated = applies(from.recording, config, fit, &from.levels);
    let passes = if is_possible(from.recording, config, fit) { passes_in_doubt(from, problem) } else { None };
    if !is_stated && passes.is_none() {
        return Ok(None);
    }
    let _stage = tracing::debug_span!("adjustment").entered();
    let held_sigmas = from.held_sigmas();
    let axis_sigmas = sigmas_before(from.recording);
    let settings = Settings {
        // Robot errors from residuals that a moved part left would explain its moves.
        levels: if is_stated {
            from.levels
        } else {
            SystematicLevels { robot: from.robot_taken, ..from.levels }
        },
        ..from.adjustment(&held_sigmas, &axis_sigmas)
    };
    let best = adjust(problem, fit.parameters(), &settings);
    let moving = |settings: &Settings<'_>, at_rest: &Answer| {
        let answer = clamped_again(problem, settings, at_rest, passes.as_ref()?)?;
        Some(Adjusted::of_moved_part(from, answer))
    };
    if !is_stated {
        return Ok(best.and_then(|best| moving(&settings, &best)));
    }
    let best = best.ok_or(Unsolved)?;
    let Basin { answer, is_open, better } = beside_rivals(from, problem, &settings, best);
    let better = likelier(from, problem, &settings, &answer).or(better);
    let Lagging { answer, settings, tried } = lagging(from, &settings, answer);
    if let Some(moved) = moving(&settings, &answer) {
        return Ok(Some(moved));
    }
    let seam_error = seam_error(from, &answer);
    let with_axes = with_axes(from, &answer);
    Ok(Some(Adjusted { answer, seam_error, is_open, better, with_axes, tried }))
}

fn with_axes(from: &Concluded<'_>, answer: &Answer) -> Option<Observations> {
    let found = finding::of_all(from.recording, &answer.at.lines, Some(answer.axes.as_ref()?));
    let mut recording = from.recording.clone();
    for (record, found) in recording.axes.iter_mut().zip(found).filter(|(_, found)| found.moves) {
        record.known = Some(found.axis);
    }
    let times_s = from.sampling.robot_times_s(from.dejittered);
    let robot = RobotMotion::of(&recording, times_s, from.settings.config).ok()?;
    let observations = &from.assessed.drift_free.observations;
    Some(Observations { robot, list: observations.list.clone(), ..observations.without_list() })
}

/// Residuals of an answer, with the external axes where they were found.
fn residuals_of(
    problem: &LineProblem<'_>,
    with_axes: Option<&Observations>,
    at: &Parameters,
) -> (Vec<FeatureResidual>, BTreeMap<Skip, usize>) {
    let observations = with_axes.unwrap_or(problem.observations);
    let placed = LineProblem { observations, ..problem.of_some(problem.list, &problem.whiteners) };
    residuals::evaluate(&placed, at)
}

/// The equations of an adjustment have no solution.
#[derive(Clone, Copy, Debug)]
struct Unsolved;

fn seam_error(from: &Concluded<'_>, answer: &Answer) -> Option<SeamError> {
    let (observations, fit) = (&from.assessed.drift_free.observations, &from.assessed.drift_free.fit);
    let widened = from.with_time_offset_widened(answer.noise.clone());
    let at_clock = (TIME_OFFSET, TIME_OFFSET);
    let sources = SharedError {
        noise: &answer.noise,
        stamps_variance_s2: widened[at_clock] - answer.noise[at_clock],
        shares: &answer.shares,
        levels: from.levels,
        speed_m_s: from.settings.config.used_at.speed_m_s,
    };
    seam_error::of_shares(observations, fit.placed.of(observations), &answer.at, &sources)
}

/// Takes the answer of the seam points as it is adjusted with all errors: residuals, checks and ± are its own. Returns its errors; `None` where
/// nothing is adjusted.
pub(crate) fn take_adjusted(
    from: &Concluded<'_>,
    problem: &LineProblem<'_>,
    findings: &mut Findings,
) -> Option<SeamErrors> {
    // No error of a shop is like another time offset in a large part of the scan.
    if findings.fit.residuals.used == 0 || stepped_stretch::is_shown(findings) {
        return None;
    }
    let Ok(adjusted) = adjusted(from, problem) else {
        // The ± of noise alone is not that of this cell.
        findings.fit.termination = Termination::NoSolution;
        return None;
    };
    let adjusted = adjusted?;
    let Adjusted { answer, seam_error, is_open, tried, better, with_axes } = adjusted;
    findings.checks.better = better;
    let mut mirrors = from.ambiguity.rivals.iter().zip(&is_open).filter(|(rival, _)| rival.is_mirror);
    let is_told_apart = mirrors.next().is_some_and(|(_, is_open)| !is_open);
    if findings.checks.mirrored == Mirrored::Equal && is_told_apart {
        findings.checks.mirrored = Mirrored::ToldApart;
        // It was the mirror alone that left the rotation open.
        let seen = &mut findings.unknowns.observability;
        if seen.shows(Group::Rotation) {
            seen.observable_components[ROTATION..TRANSLATION].fill(true);
        }
    }
    let mut is_open = is_open.into_iter();
    findings.checks.ambiguity.rivals.retain(|_| is_open.next().unwrap_or(true));
    let begun = findings.models_tried.remove(0);
    let models = of_adjustment(&begun, &answer.blocks, &tried);
    findings.models_tried.splice(0..0, models);
    // Its own covariance needs no widening, and its own blocks leave nothing for parts of the scan to disagree about.
    (findings.fit.widened_by, findings.checks.held_out) = (None, None);
    let noise_covariance = from.with_time_offset_widened(answer.noise.clone());
    let covariance = answer.covariance() - &answer.noise + &noise_covariance;
    findings.axes = finding::of_all(from.recording, &answer.at.lines, answer.axes.as_ref());
    let observability = findings.unknowns.observability.clone().bounded(&covariance);
    let (config, observations) = (from.settings.config, &from.assessed.drift_free.observations);
    let (features, skipped) = residuals_of(problem, with_axes.as_ref(), &answer.at);
    findings.fit.residuals = residuals::summarise(&features, skipped);
    findings.checks.outlier_segments = outlier_segments::find(
        observations,
        &features,
        &answer.at,
        &from.assessed.drift_free.fit.noise,
        config.offset_search_s,
    );
    // Explained readings are no outlier segment.
    findings.checks.outlier_segments.retain(|segment| answer.frames.leave_out(segment.span_s));
    let stamp_of = |f: &FeatureResidual| from.recording.features[f.row as usize].stamp_ns;
    findings.fit.feature_stamps_ns = features.iter().map(stamp_of).collect();
    findings.fit.features = features;
    let of_robot = answer.of_robot();
    findings.fit.amplitudes = Some(answer.amplitudes);
    findings.checks.part_moved_m = answer.moved_m;
    let answered = Answered { parameters: answer.at, covariance, noise_covariance, observability, of_robot };
    take(from, findings, answered, seam_error);
    Some(SeamErrors { noise: answer.noise, shares: answer.shares, field: answer.field })
}
