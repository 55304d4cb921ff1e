//! The criteria that a calibration must meet.

use super::limits::{
    COARSE_STAMPS, LEAST_USED, LEAST_USED_BADLY, MANY_SKIPPED, MOST_LEFT_OUT, MOST_OFF_CURVE, OUTLIERS,
};
use super::mistake::{self, residuals_are_too_large};
use super::quantity::Quantity;
use super::reason::{Answer, Reason};
use crate::adjustment::answer::Amplitudes;
use crate::assess::outlier_segments::{Cause, OutlierSegment};
use crate::assess::outliers::Outliers;
use crate::assess::profile_likelihood;
use crate::assess::seam_error::SeamError;
use crate::assess::sensor_shape::SensorShape;
use crate::config::{Hold, SEAM_ERROR_CEILING_M, SensorMode};
use crate::curve::estimate::CurveEstimate;
use crate::findings::Findings;
use crate::hypotheses::drift_and_step::Step;
use crate::hypotheses::search::Mirrored;
use crate::input::stops::Stops;
use crate::input::timestamps::StampReport;
use crate::problem::parameters::{LINES, ROTATION, TIME_OFFSET, TRANSLATION};
use crate::stripe::outcome::StripeOutcome;

/// A step is a whole number of pictures if it is one to within this number of standard deviations …
const WHOLE_SIGMAS: f64 = 4.0;
/// … of at least this part of a picture …
const LEAST_SPREAD: f64 = 0.01;
/// … and if these are less than this part of one.
const MOST_SPREAD: f64 = 0.4;
/// Stamps that stray by less than this part of a picture were made by counting.
const EVEN_JITTER: f64 = 1e-3;

/// Why the result cannot be accepted, in the order in which a user should read it.
pub(super) fn reasons(f: &Findings) -> Vec<Reason> {
    if f.fit.residuals.used == 0 {
        // Nothing else that could be said means anything.
        return too_few_used(f).into_iter().collect();
    }
    if let Some(curve) = &f.curve {
        return of_curve(f, curve);
    }
    let mut reasons = contradicted(f);
    if !reasons.is_empty() {
        // All else that the fit says would be said of that error.
        return reasons;
    }
    reasons.extend(lines_of_outliers(f));
    if !reasons.is_empty() {
        return reasons;
    }
    if let Some(reason) = outdone_by_far(f) {
        // All else that the fit says would be said of a wrong answer.
        return std::iter::once(reason).chain(of_streams(f)).collect();
    }
    if let Some(amplitudes) = &f.fit.amplitudes {
        return of_adjusted(f, amplitudes);
    }
    if mistake::is_likely(f) {
        return vec![too_large(f)].into_iter().chain(of_streams(f)).collect();
    }
    if mistake::most_are_outliers(f) {
        return vec![Reason::TooManyOutliers { outliers: f.outliers() }]
            .into_iter()
            .chain(of_streams(f))
            .collect();
    }
    let is_unstated = f.stops == Some(Stops::Recognised);
    reasons.extend(is_unstated.then_some(Reason::AtStops { stops: f.streams.images.count }));
    if !f.unknowns.held_at_guess {
        reasons.extend(f.unknowns.observability.unobservable.iter().cloned().map(Reason::Unobservable));
    }
    if f.checks.mirrored == Mirrored::Equal {
        reasons.push(Reason::MirrorAmbiguity);
    } else if turn_is_undetermined(f) {
        reasons.push(Reason::UndeterminedTurn);
    }
    reasons.extend(other_minima(f));
    if !f.fit.termination.is_converged() {
        reasons.push(Reason::NotConverged { termination: f.fit.termination });
    }
    if residuals_are_too_large(f) {
        reasons.push(too_large(f));
    }
    reasons.extend(too_few_used(f));
    reasons.extend(of_streams(f));
    reasons.extend(f.stripes.as_ref().and_then(stripes_contradict));
    let outliers = f.outliers();
    if outliers.share() > OUTLIERS || !outliers.leave_a_majority() {
        reasons.push(Reason::TooManyOutliers { outliers });
    }
    reasons.extend(f.checks.outlier_segments.iter().filter_map(|segment| broken_stretch(f, segment)));
    reasons.extend(f.clock.stepped.map(|step| stepped(f, &step)));
    reasons.extend(missed_requirements(f));
    reasons
}

/// A stated seam error that nobody can use. An answer that noise alone was estimated for is left to what a user requires.
fn above_ceiling(f: &Findings) -> Option<Reason> {
    let ceiling_m = f.config.require.seam_m.unwrap_or(SEAM_ERROR_CEILING_M);
    f.checks.seam_error.and_then(|error| seam_error_too_large(ceiling_m, &error))
}

/// Why the answer of a curve is bad.
fn of_curve(f: &Findings, curve: &CurveEstimate) -> Vec<Reason> {
    let mut reasons: Vec<Reason> = Vec::new();
    reasons.extend(
        curve.collapsed_from_m.map(|before_m| Reason::CurveCollapsed { length_m: curve.length_m, before_m }),
    );
    let outliers = f.outliers();
    if outliers.share() > MOST_OFF_CURVE {
        reasons.push(Reason::TooManyOutliers { outliers });
    }
    reasons.extend(f.unknowns.observability.unobservable.iter().cloned().map(Reason::Unobservable));
    reasons.extend(other_minima(f));
    reasons.extend(too_few_used(f));
    reasons.extend(of_streams(f));
    reasons.extend(above_ceiling(f));
    reasons.extend(missed_requirements(f));
    reasons
}

fn stepped(f: &Findings, step: &Step) -> Reason {
    Reason::ClockStep {
        at_s: f.streams.stamp_s(step.at_s),
        step_s: step.step_s,
        sigma_s: step.sigma_s,
        pictures: whole_pictures(&f.streams.images, step),
    }
}

/// Noise of less than this part of what is expected makes no outliers: it is that of a scan without noise.
const LEAST_NOISE: f64 = 0.05;

/// Why an answer that was adjusted with all errors is bad: everything else is in its ±.
fn of_adjusted(f: &Findings, amplitudes: &Amplitudes) -> Vec<Reason> {
    let of_data = if residuals_are_too_large(f) {
        Some(too_large(f))
    } else if amplitudes.out.share() > MOST_LEFT_OUT {
        Some(Reason::TooManyOutliers { outliers: amplitudes.out })
    } else if mistake::most_are_outliers(f) && amplitudes.noise_times() > LEAST_NOISE {
        Some(Reason::TooManyOutliers { outliers: f.outliers() })
    } else {
        None
    };
    if let Some(reason) = of_data {
        // What else the fit says would be said of that.
        return std::iter::once(reason).chain(of_streams(f)).collect();
    }
    let unobservable = f.unknowns.observability.unobservable.iter().cloned();
    let mut reasons: Vec<Reason> = unobservable.map(Reason::Unobservable).collect();
    if f.checks.mirrored == Mirrored::Equal {
        reasons.push(Reason::MirrorAmbiguity);
    }
    reasons.extend(other_minima(f));
    reasons.extend(too_few_used(f).or_else(|| beyond_the_window(f)));
    reasons.extend(of_streams(f));
    reasons.extend(f.stripes.as_ref().and_then(stripes_contradict));
    let other = f.clock.stepped.filter(|step| !step.is_of_a_clock() && amplitudes.show_a_step());
    reasons.extend(other.map(|step| stepped(f, &step)));
    reasons.extend(above_ceiling(f));
    reasons.extend(missed_requirements(f));
    if !reasons.is_empty() {
        // Where the stream of the robot stopped, the rest follows from that.
        let stretches = f.checks.outlier_segments.iter().filter_map(|segment| broken_stretch(f, segment));
        let frozen = stretches.filter(|reason| matches!(reason, Reason::RobotStreamFroze { .. }));
        reasons.splice(0..0, frozen);
    }
    reasons
}

fn seam_error_too_large(ceiling_m: f64, error: &SeamError) -> Option<Reason> {
    let (mostly, share) = error.mostly();
    let is_bad = error.rms_m > ceiling_m;
    is_bad.then_some(Reason::SeamErrorTooLarge {
        rms_m: error.rms_m,
        ceiling_m,
        mostly,
        share,
        weakest: error.weakest,
    })
}

/// Of fewer stops the search from nothing misses the answer now and then: of 11 in two of three simulated cells, of 15 in none.
const FEW_STOPS: usize = 15;

fn too_large(f: &Findings) -> Reason {
    let of_stripes = f.stripe_noise_factor().unwrap_or(0.0);
    let of_adjustment = f.fit.amplitudes.as_ref().map_or(0.0, Amplitudes::noise_times);
    let noise_factor = f.fit.noise_factor.max(of_stripes).max(of_adjustment);
    // At stops the time offset is held because there is none.
    let is_absent = |held: &Hold| f.config.at_stops && *held == Hold::TimeOffset;
    let is_held = f.config.hold.iter().any(|held| !is_absent(held));
    let stops = f.streams.images.count;
    let few_stops = (f.config.at_stops && stops < FEW_STOPS).then_some(stops);
    Reason::ResidualsTooLarge { noise_factor, is_held, few_stops }
}

/// Faults of the robot's stamps, independent of the fit.
fn of_streams(f: &Findings) -> Option<Reason> {
    let (repeated, rows) = (f.streams.robot.doubles, f.streams.robot_rows);
    (repeated as f64 > COARSE_STAMPS * rows as f64).then_some(Reason::CoarseRobotStamps { repeated, rows })
}

/// Stripes that were not requested and that contradict the seam points.
fn stripes_contradict(stripes: &StripeOutcome) -> Option<Reason> {
    let estimate = stripes.estimate.as_ref()?;
    let sigmas = estimate.contradicts(stripes.because)?;
    Some(Reason::StripesContradict { sigmas, apart: estimate.apart })
}

/// Whether the profile of the likelihood sets no bound to a turn of the sensor.
pub(super) fn turn_is_undetermined(f: &Findings) -> bool {
    f.fit.widened_by.is_some_and(|by| by >= profile_likelihood::MOST)
}

/// Quantities held fixed that the scan contradicts.
fn contradicted(f: &Findings) -> Vec<Reason> {
    let lines = f.checks.drawn_line_shifts.iter().map(|shift| Reason::DrawnLineOff { shift: *shift });
    let instead = &f.checks.instead_of_sensor;
    let sensor = f.checks.held_sensor.filter(SensorShape::is_off);
    let beyond_stated = f.config.sensor != SensorMode::Fixed;
    let sensor = sensor.map(|shape| Reason::SensorOff {
        shape: Box::new(shape),
        instead: instead.clone(),
        beyond_stated,
    });
    lines.chain(sensor).collect()
}

/// Lines of which most features are outliers, where the scan has others as well.
fn lines_of_outliers(f: &Findings) -> Vec<Reason> {
    let count = f.unknowns.parameters.lines.len();
    if count < 2 || mistake::most_are_outliers(f) {
        return Vec::new();
    }
    let mut of_lines = vec![Outliers::default(); count];
    for feature in &f.fit.features {
        let own = &mut of_lines[feature.line as usize];
        own.of += 1;
        own.count += usize::from(feature.is_outlier());
    }
    let is_of_few = |outliers: &Outliers| 2 * outliers.count > outliers.of;
    let numbered = (0..).zip(of_lines).filter(|(_, outliers)| is_of_few(outliers));
    numbered.map(|(line, outliers)| Reason::LineOfOutliers { line, outliers }).collect()
}

/// Residuals that are so many times as large as those of another answer are those of a wrong start.
const BY_FAR: f64 = 3.0;

/// Another answer that fits the scan far better than the one that a guess led to.
fn outdone_by_far(f: &Findings) -> Option<Reason> {
    let better = f.checks.better.filter(|better| BY_FAR * better.noise_factor < f.fit.noise_factor)?;
    let better_time_offset_s = better.time_offset_s + f.streams.images_ahead_s;
    Some(Reason::WorseMinimum { better_time_offset_s })
}

/// A rival of the answer that is better, or that the scan does not tell from it.
fn other_minima(f: &Findings) -> Vec<Reason> {
    let ambiguity = &f.checks.ambiguity;
    // As the stamps were recorded, as everywhere else on the page.
    let recorded_s = |time_offset_s: f64| time_offset_s + f.streams.images_ahead_s;
    let outdone = ambiguity.runner_up.filter(|rival| rival.test.reversed());
    let better = f.checks.better.filter(|_| outdone.is_none());
    let mut reasons: Vec<Reason> = better
        .into_iter()
        .map(|better| Reason::WorseMinimum { better_time_offset_s: recorded_s(better.time_offset_s) })
        .collect();
    reasons.extend(outdone.map(|rival| Reason::WrongTimeOffset {
        time_offset_s: recorded_s(f.unknowns.parameters.time_offset_s),
        better_time_offset_s: recorded_s(rival.time_offset_s),
        explains: rival.test.best_explains,
        better_explains: rival.test.explains,
    }));
    if ambiguity.is_open() {
        let lasts_s = f.streams.images.median_period_s * f.streams.images.count as f64;
        reasons.push(Reason::AmbiguousTimeOffset { answers: answers(f), lasts_s });
    }
    if ambiguity.contradicted {
        reasons.push(Reason::StatementContradicted);
    }
    reasons
}

/// How many pictures a step of the time offset is, where their stamps are even, as those that were made by counting are.
fn whole_pictures(images: &StampReport, step: &Step) -> Option<u32> {
    let period_s = images.period_s?;
    let (pictures, spread) = (step.step_s.abs() / period_s, images.jitter_s?.hypot(step.sigma_s) / period_s);
    let is_whole = (pictures - pictures.round()).abs() < WHOLE_SIGMAS * spread.max(LEAST_SPREAD);
    let is_even = images.jitter_s? < EVEN_JITTER * period_s && WHOLE_SIGMAS * spread < MOST_SPREAD;
    (is_even && is_whole && pictures > MOST_SPREAD).then_some(pictures.round() as u32)
}

/// The answer given and those that the scan cannot separate from it.
fn answers(f: &Findings) -> Vec<Answer> {
    let ambiguity = &f.checks.ambiguity;
    let own = Answer {
        time_offset_s: f.unknowns.parameters.time_offset_s + f.streams.images_ahead_s,
        statements: ambiguity.statements.clone(),
    };
    let others = ambiguity.others().map(|rival| Answer {
        time_offset_s: rival.parameters.time_offset_s + f.streams.images_ahead_s,
        statements: rival.statements.clone(),
    });
    std::iter::once(own).chain(others).collect()
}

fn too_few_used(f: &Findings) -> Option<Reason> {
    let (used, features) = (f.fit.residuals.used, f.streams.features);
    let share = used as f64 / features as f64;
    let badly = share < LEAST_USED_BADLY.0 && f.fit.noise_factor > LEAST_USED_BADLY.1;
    if share >= LEAST_USED && !badly {
        return None;
    }
    let (mostly, mostly_count) = f.fit.residuals.skipped.iter().max_by_key(|(_, count)| **count)?;
    Some(Reason::TooFewUsed { used, features, mostly: *mostly, mostly_count: *mostly_count })
}

/// An answer that was found beyond the window of the search has to explain all of the scan: of a path that repeats an alias lies there, and part of the
/// features outside of the robot's recording.
fn beyond_the_window(f: &Findings) -> Option<Reason> {
    let is_beyond = f.unknowns.parameters.time_offset_s.abs() > f.config.offset_search_s;
    let (mostly, mostly_count) = f.fit.residuals.skipped.iter().max_by_key(|(_, count)| **count)?;
    let (used, features) = (f.fit.residuals.used, f.streams.features);
    let is_part = *mostly_count * MANY_SKIPPED > features;
    (is_beyond && is_part).then_some(Reason::TooFewUsed {
        used,
        features,
        mostly: *mostly,
        mostly_count: *mostly_count,
    })
}

fn broken_stretch(f: &Findings, segment: &OutlierSegment) -> Option<Reason> {
    let span_s = segment.span_s.map(|s| f.streams.stamp_s(s));
    match segment.cause {
        Cause::ClockStep(step_s) => Some(Reason::OtherTimeOffset { span_s, step_s }),
        Cause::RobotStoodStill => Some(Reason::RobotStreamFroze { span_s }),
        Cause::OtherLine(_) | Cause::Unknown => None,
    }
}

/// Where an answer was adjusted, the ceiling says so already.
fn missed_of_seam(f: &Findings) -> Option<Reason> {
    let required_m = f.config.require.seam_m?;
    let is_judged = f.fit.amplitudes.is_some() || f.curve.is_some();
    match f.checks.seam_error {
        None => {
            Some(Reason::RequirementUnobservable { quantity: Quantity::SeamPoint, required_si: required_m })
        }
        Some(error) => seam_error_too_large(required_m, &error).filter(|_| !is_judged),
    }
}

fn missed_requirements(f: &Findings) -> Vec<Reason> {
    let require = &f.config.require;
    let mut reasons: Vec<Reason> = missed_of_seam(f).into_iter().collect();
    let wanted = [
        (Quantity::TimeOffset, require.time_s, TIME_OFFSET..ROTATION),
        (Quantity::Rotation, require.rotation_rad, ROTATION..TRANSLATION),
        (Quantity::Translation, require.translation_m, TRANSLATION..LINES),
    ];
    for (quantity, required, components) in wanted {
        let Some(required_si) = required else { continue };
        let sigmas: Option<Vec<f64>> = components.map(|k| f.unknowns.sigma(k)).collect();
        match sigmas.map(|sigmas| sigmas.into_iter().fold(0.0, f64::max)) {
            Some(worst) if worst <= required_si => {}
            Some(sigma_si) => reasons.push(Reason::RequirementMissed { quantity, sigma_si, required_si }),
            None => reasons.push(Reason::RequirementUnobservable { quantity, required_si }),
        }
    }
    reasons
}
