//! Criteria of the warnings.

use super::hidden_axis::hidden_of_axis;
use super::limits::{
    CROSS_VALIDATION_RATIO, CROSS_VALIDATION_SIGMAS, CROSS_VALIDATION_SURPLUS, MANY_MISSING, MANY_OUTLIERS,
    MANY_SKIPPED, OUTLIERS, POORLY_KNOWN_M, ROBOT_MOVES_M, USELESS_M, USUAL_NOISE_FACTOR, WAVY_M,
};
use super::mistake::{self, residuals_are_too_large};
use super::quantity::{Axis, Quantity};
use super::reject::turn_is_undetermined;
use super::stream_name::StreamName;
use super::warning::Warning;
use crate::adjustment::error_sizes::Amplitudes;
use crate::adjustment::expected::LAG_SIGMA_S;
use crate::assess::cause_kind::CauseKind;
use crate::assess::correlated_noise::Structure;
use crate::assess::cross_validation::HeldOut;
use crate::assess::outlier_segments::{Cause, OutlierSegment};
use crate::config::Measurements;
use crate::curve::estimate::CurveEstimate;
use crate::findings::Findings;
use crate::hypotheses::ambiguity::RivalAnswer;
use crate::hypotheses::search::Mirrored;
use crate::input::timestamps::StampReport;
use crate::problem::parameters::{LINES, ROTATION, TIME_OFFSET, TRANSLATION};
use crate::stripe::outcome::AGREEMENT_SIGMAS;
use crate::stripe::outcome::{Because, StripeOutcome};

/// A decision by the user's statement. Time offsets refer to the recorded stamps.
fn decided_by_user(f: &Findings) -> Option<Warning> {
    let ambiguity = &f.checks.ambiguity;
    let recorded_s = |rival: &RivalAnswer| rival.parameters.time_offset_s + f.streams.images_ahead_s;
    Some(Warning::DecidedByUser {
        by: ambiguity.decided_by?,
        other_time_offsets_s: ambiguity.rivals.iter().map(recorded_s).collect(),
    })
}

/// Warnings, in the order in which a user should read them.
pub(super) fn warnings(f: &Findings) -> Vec<Warning> {
    let mut warnings = Vec::new();
    warnings.extend(decided_by_user(f));
    warnings.extend(f.uncertainty_ignored.then_some(Warning::UncertaintyNotApplied));
    warnings.extend(f.sensor_of_its_own_scan.then_some(Warning::SensorOfItsOwnScan));
    let is_contradicted = f.checks.contradict_what_is_held();
    warnings.extend(f.curve_untried.filter(|_| !is_contradicted).map(|why| Warning::CurveUntried { why }));
    if let Some(curve) = &f.curve {
        warnings.extend(of_curve(f, curve));
        return warnings;
    }
    if is_contradicted {
        // Warnings that do not depend on the fit.
        warnings.extend(f.stripes.as_ref().into_iter().flat_map(of_stripes));
        warnings.extend(stamps(f));
        return warnings;
    }
    if mistake::is_likely(f) {
        warnings.extend(likely_cause(f));
        warnings.extend(stamps(f));
        return warnings;
    }
    if let Some(amplitudes) = f.adjusted() {
        warnings.extend(of_adjusted(f, amplitudes));
        return warnings;
    }
    warnings.extend(hidden_of_axes(f));
    warnings.extend(drawn_line_not_needed(f));
    warnings.extend(causes(f));
    let widened_by = f.fit.widened_by.filter(|_| !turn_is_undetermined(f));
    warnings.extend(widened_by.map(|by| Warning::WidenedByProfile { by }));
    warnings.extend(poorly_known(f));
    let bias = f.checks.feature_bias.filter(|bias| bias.is_found);
    warnings.extend(bias.map(|bias| Warning::FeatureBias { bias, per_px_m: f.length_per_px_m() }));
    if f.checks.mirrored == Mirrored::ToldApartBySensor {
        warnings.push(Warning::MirrorBySensor);
    }
    warnings.extend(f.stripes.as_ref().into_iter().flat_map(of_stripes));
    let skipped = &f.fit.residuals.skipped;
    if skipped.values().sum::<usize>() * MANY_SKIPPED > f.streams.features {
        warnings.push(Warning::FeaturesSkipped { skipped: skipped.clone() });
    }
    if f.unknowns.held_at_guess {
        warnings.push(Warning::HeldAtGuess { held: f.unknowns.observability.unobservable.clone() });
    }
    warnings.extend(f.checks.outlier_segments.iter().filter_map(|segment| doubtful_stretch(f, segment)));
    warnings.extend(unusual_noise(f));
    warnings.extend(stripe_noise(f));
    warnings.extend(follows_motion(f));
    let share = f.outliers().share();
    if share > MANY_OUTLIERS && share <= OUTLIERS {
        warnings.push(Warning::ManyOutliers { share });
    }
    warnings.extend(clock_drift(f));
    warnings.extend(stamps(f));
    warnings.extend(f.checks.held_out.as_ref().and_then(|check| disagreement(f, check)));
    if let (true, None, Some(stand_off_m)) =
        (all_seen(f), &f.checks.seam_point_error, f.config.used_at.stand_off_m)
    {
        warnings.push(Warning::NoPointAtStandOff { stand_off_m });
    }
    warnings
}

/// The uncertainty of a seam point is larger than a user expects.
fn poorly_known(f: &Findings) -> Option<Warning> {
    let (scan_alone_m, all_m) = f.checks.seam_error.map(|error| (error.scan_alone_m(), error.rms_m))?;
    let is_poor = scan_alone_m > POORLY_KNOWN_M || all_m > USELESS_M;
    is_poor.then_some(Warning::PoorlyKnown { scan_alone_m, all_m })
}

/// Parts of the axes that the scan does not determine.
fn hidden_of_axes(f: &Findings) -> impl Iterator<Item = Warning> {
    let keeps_attitude = !f.unknowns.observability.shows_hand_eye();
    f.axes.iter().flat_map(move |axis| hidden_of_axis(axis, keeps_attitude))
}

/// Warnings about the answer of a curve.
fn of_curve(f: &Findings, curve: &CurveEstimate) -> Vec<Warning> {
    let mut warnings = Vec::new();
    warnings.extend(curve.is_one_pass.then_some(Warning::CurveFromOnePass));
    let weave_m = curve.weave_m.filter(|_| curve.is_near_weave);
    warnings.extend(weave_m.map(|weave_m| Warning::KnotsNearWeave { spacing_m: curve.spacing_m, weave_m }));
    let options = f.unused_on_curve.clone();
    warnings.extend((!options.is_empty()).then_some(Warning::UnusedOnCurve { options }));
    let share = f.outliers().share();
    warnings.extend((share > MANY_OUTLIERS).then_some(Warning::ManyOutliers { share }));
    let of_stripes = f.stripes.iter().flat_map(of_stripes);
    // The reason against the seam points says why the stripes are not used.
    warnings.extend(of_stripes.filter(|warning| !matches!(warning, Warning::StripesUnused { .. })));
    warnings.extend(clock_drift(f));
    warnings.extend(stamps(f));
    warnings
}

/// Warnings about the cell from an adjustment. The uncertainties include them.
fn of_adjusted(f: &Findings, amplitudes: &Amplitudes) -> Vec<Warning> {
    let mut warnings = Vec::new();
    let wavy = amplitudes.form_m > WAVY_M;
    let of_plates = f.stripe_noise_factor().is_some();
    let rms_m = amplitudes.form_m;
    let form = if of_plates { Warning::WavyPlates { rms_m } } else { Warning::WavySeam { rms_m } };
    warnings.extend(wavy.then_some(form));
    let moves = amplitudes.robot_m > ROBOT_MOVES_M;
    warnings.extend(moves.then_some(Warning::RobotMoves { rms_m: amplitudes.robot_m }));
    warnings.extend(amplitudes.joint_lags_m.map(|rms_m| Warning::JointLags { rms_m }));
    let lags = amplitudes.lag_s > 0.0;
    warnings.extend(lags.then_some(Warning::LikelyCause {
        kind: CauseKind::CommandedPose,
        size_si: amplitudes.lag_s.powi(2),
        sigma_si: 2.0 * amplitudes.lag_s * LAG_SIGMA_S,
        per_px_m: None,
    }));
    warnings.extend(hidden_of_axes(f));
    warnings.extend(drawn_line_not_needed(f));
    let off = f.unknowns.sensor.filter(|shape| shape.is_off() && all_seen(f));
    let instead = &f.checks.confounded_causes;
    warnings.extend(off.map(|shape| Warning::SensorOff { shape, instead: instead.clone() }));
    warnings.extend(f.checks.lens.map(|lens| Warning::LensOff { lens }));
    if f.checks.mirrored == Mirrored::ToldApartBySensor {
        warnings.push(Warning::MirrorBySensor);
    }
    warnings.extend(f.stripes.as_ref().into_iter().flat_map(of_stripes));
    let skipped = &f.fit.residuals.skipped;
    let is_of_seam_points = f.stripe_noise_factor().is_none();
    if is_of_seam_points && skipped.values().sum::<usize>() * MANY_SKIPPED > f.streams.features {
        warnings.push(Warning::FeaturesSkipped { skipped: skipped.clone() });
    }
    warnings.extend(f.checks.outlier_segments.iter().map(|segment| left_out(f, segment)));
    let share = amplitudes.out.share();
    warnings.extend((share > MANY_OUTLIERS).then_some(Warning::ManyOutliers { share }));
    warnings.extend(
        f.clock
            .stepped
            .filter(|step| step.is_of_a_clock() && amplitudes.show_a_step())
            .map(|step| Warning::ClockStep { at_s: f.streams.stamp_s(step.at_s), step_s: step.step_s }),
    );
    warnings.extend(clock_drift(f));
    warnings.extend(stamps(f));
    if let (true, None, Some(stand_off_m)) =
        (all_seen(f), &f.checks.seam_point_error, f.config.used_at.stand_off_m)
    {
        warnings.push(Warning::NoPointAtStandOff { stand_off_m });
    }
    warnings
}

/// A stretch that disagrees with the rest and was left out of an adjustment.
fn left_out(f: &Findings, segment: &OutlierSegment) -> Warning {
    let (span_s, features) = (segment.span_s.map(|s| f.streams.stamp_s(s)), segment.features);
    match segment.cause {
        Cause::OtherLine(beside_m) => Warning::OtherLine { span_s, features, beside_m },
        Cause::ClockStep(_) | Cause::RobotStoodStill | Cause::Unknown => {
            Warning::OutlierStretch { span_s, features }
        }
    }
}

fn clock_drift(f: &Findings) -> Option<Warning> {
    let drift = f.clock.drifted?;
    Some(Warning::ClockDrift {
        ppm: drift.ppm,
        sigma_ppm: drift.sigma_ppm,
        about_s: f.streams.stamp_s(drift.about_s),
    })
}

/// Whether time offset and hand-eye are fully observable.
fn all_seen(f: &Findings) -> bool {
    f.unknowns.observability.observable_components[..LINES].iter().all(|seen| *seen)
}

/// Cause of the residuals, or of the shape of the sensor.
fn causes(f: &Findings) -> impl Iterator<Item = Warning> {
    // Unobservable parts of time offset and hand-eye also affect the shape.
    let off = f.unknowns.sensor.filter(|shape| shape.is_off() && all_seen(f));
    let instead = &f.checks.confounded_causes;
    let off = off.map(|shape| Warning::SensorOff { shape, instead: instead.clone() });
    let lens = f.checks.lens.map(|lens| Warning::LensOff { lens });
    let cause = likely_cause(f);
    let robot = f.checks.robot_seems.map(|seems| Warning::RobotWorse {
        seems,
        taken: f.checks.robot_taken,
        stated: f.checks.seam_error.is_some_and(|error| error.levels.robot_is_stated),
    });
    [off, lens, cause, robot].into_iter().flatten()
}

fn likely_cause(f: &Findings) -> Option<Warning> {
    let cause = f.checks.cause.as_ref().filter(|_| f.checks.lens.is_none())?;
    Some(Warning::LikelyCause {
        kind: cause.kind,
        size_si: cause.size,
        sigma_si: cause.sigma,
        per_px_m: f.length_per_px_m(),
    })
}

/// Stripes that disagree with the seam points, or were not used.
fn of_stripes(stripes: &StripeOutcome) -> Vec<Warning> {
    let StripeOutcome { skipped, stamped_later_s, estimate, .. } = stripes;
    let left_out = skipped.values().sum::<usize>();
    let all = left_out + estimate.as_ref().map_or(0, |estimate| estimate.counts.stripes);
    let many = left_out * MANY_SKIPPED > all;
    let skipped = many.then(|| Warning::StripesSkipped { skipped: skipped.clone() });
    let unused = match stripes.because {
        Because::Plates(why) => Some(Warning::StripesUnused { why }),
        _ => None,
    };
    let is_apart = stamped_later_s.abs() > STAMPED_ALIKE_S;
    let stamped = is_apart.then_some(Warning::StripesStampedApart { later_s: *stamped_later_s });
    [skipped, unused, stamped, stripes_disagree(stripes)].into_iter().flatten().collect()
}

/// Stamps within this belong to one clock, written with different digits, s.
const STAMPED_ALIKE_S: f64 = 1e-4;

/// The answers of stripes and seam points are too far apart.
fn stripes_disagree(stripes: &StripeOutcome) -> Option<Warning> {
    let estimate = stripes.estimate.as_ref()?;
    let (sigmas, apart) = (estimate.sigmas_apart?, estimate.apart);
    let (used, is_doubted) =
        (stripes.used != Measurements::Seam, estimate.contradicts(stripes.because).is_some());
    let disagree = sigmas >= AGREEMENT_SIGMAS && !is_doubted;
    disagree.then_some(Warning::StripesDisagree { sigmas, apart, used })
}

fn drawn_line_not_needed(f: &Findings) -> Option<Warning> {
    let with_m = f.checks.seam_error?.rms_m;
    let without_m = f.checks.better_without_drawing_m?;
    Some(Warning::DrawnLineNotNeeded { with_m, without_m })
}

fn doubtful_stretch(f: &Findings, segment: &OutlierSegment) -> Option<Warning> {
    let (span_s, features) = (segment.span_s.map(|s| f.streams.stamp_s(s)), segment.features);
    match segment.cause {
        Cause::ClockStep(_) | Cause::RobotStoodStill => None,
        Cause::OtherLine(beside_m) => Some(Warning::OtherLine { span_s, features, beside_m }),
        Cause::Unknown => Some(Warning::OutlierStretch { span_s, features }),
    }
}

/// `None` if it is a reason already.
fn unusual_noise(f: &Findings) -> Option<Warning> {
    let ([least, most], noise_factor) = (USUAL_NOISE_FACTOR, f.fit.noise_factor);
    let usual = residuals_are_too_large(f) || (least..=most).contains(&noise_factor);
    let is_explained = f.checks.cause.is_some() || f.checks.better_without_drawing_m.is_some();
    let of_answer = f.stripe_noise_factor().is_none();
    (!usual).then_some(Warning::UnusualNoise { noise_factor, is_explained, of_answer })
}

/// The noise of the stripes, if they give the answer.
fn stripe_noise(f: &Findings) -> Option<Warning> {
    let (noise_factor, [least, most]) = (f.stripe_noise_factor()?, USUAL_NOISE_FACTOR);
    let usual = residuals_are_too_large(f) || (least..=most).contains(&noise_factor);
    (!usual).then_some(Warning::StripeNoise { noise_factor })
}

fn follows_motion(f: &Findings) -> Option<Warning> {
    match &f.fit.structure {
        Structure::Correlated(noise) if !f.fit.structure.may_be_noise() => {
            Some(Warning::StructuredResiduals { left: noise.left })
        }
        _ => None,
    }
}

fn stamps(f: &Findings) -> Vec<Warning> {
    let mut warnings = Vec::new();
    warnings.extend(samples_missing(&f.streams.robot));
    let (repeated, rows) = (f.streams.robot_poses_repeated, f.streams.robot_rows);
    if repeated > 0 {
        warnings.push(Warning::RepeatedPoses { repeated, rows });
    }
    if f.streams.robot.doubles > 0 {
        warnings.push(Warning::RepeatedRobotStamps { repeated: f.streams.robot.doubles });
    }
    warnings.extend(stream_stamps(f, StreamName::Robot, &f.streams.robot));
    warnings.extend(stream_stamps(f, StreamName::Images, &f.streams.images));
    warnings
}

/// Missing robot samples. Missing images are normal.
fn samples_missing(robot: &StampReport) -> Option<Warning> {
    let missing = robot.missing?;
    let of = robot.count + missing;
    (missing as f64 > MANY_MISSING * of as f64).then_some(Warning::RobotSamplesMissing { missing, of })
}

fn stream_stamps(f: &Findings, stream: StreamName, stamps: &StampReport) -> Option<Warning> {
    if let Some(grain_s) = stamps.grain_s {
        return Some(Warning::CoarseStamps { stream, grain_s });
    }
    let steps: Vec<_> =
        stamps.steps.iter().map(|(at_s, step_s)| (f.streams.stamp_s(*at_s), *step_s)).collect();
    let period_s = stamps.period_s.unwrap_or(stamps.median_period_s);
    (!steps.is_empty()).then_some(Warning::StampSteps { stream, steps, period_s })
}

fn disagreement(f: &Findings, check: &HeldOut) -> Option<Warning> {
    if f.checks.better_without_drawing_m.is_some() {
        // The parts disagree because of the drawing's error, within its uncertainty.
        return None;
    }
    let part = check.parts.iter().max_by(|a, b| a.sigmas.amax().total_cmp(&b.sigmas.amax()))?;
    let k = part.sigmas.iamax();
    if part.sigmas[k].abs() <= CROSS_VALIDATION_SIGMAS {
        let ratio = check.rms_m / check.fitted_rms_m;
        let surplus = check.rms_m.powi(2) - check.fitted_rms_m.powi(2);
        let expected = check.expected_rms_m.powi(2) - check.fitted_rms_m.powi(2);
        let disagree = ratio > CROSS_VALIDATION_RATIO && surplus > CROSS_VALIDATION_SURPLUS * expected;
        return disagree.then_some(Warning::CrossValidationMisfit {
            rms_m: check.rms_m,
            fitted_rms_m: check.fitted_rms_m,
        });
    }
    let (quantity, axis) = match k {
        TIME_OFFSET => (Quantity::TimeOffset, None),
        ROTATION..TRANSLATION => (Quantity::Rotation, Some(Axis::ALL[k - ROTATION])),
        _ => (Quantity::Translation, Some(Axis::ALL[k - TRANSLATION])),
    };
    Some(Warning::CrossValidationShift {
        span_s: part.span_s.map(|s| f.streams.stamp_s(s)),
        quantity,
        axis,
        moved_si: part.moved[k],
        sigmas: part.sigmas[k].abs(),
    })
}
