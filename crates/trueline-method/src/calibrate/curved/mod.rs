//! Scans over a curved seam: when a curve is tried, and its answer as a calibration.

mod checks;
mod models;
mod plates;
mod scan;

use crate::calibrate::curved::models::of_curve;
use crate::calibrate::curved::plates::Chosen;
use crate::calibrate::curved::scan::Scan;
use crate::calibration::Calibration;
use crate::config::{Config, Measurements, ResidualKind, SensorMode, Target};
use crate::curve::answer::Answered;
use crate::curve::order::Obstacle;
use crate::curve::readings::Readings;
use crate::curve::registration::bends_m;
use crate::curve::solve::READINGS_PER_KNOT;
use crate::curve::spline::LEAST_CONTROL;
use crate::error::Error;
use crate::findings::Findings;
use crate::models::{Because, ModelTried};
use crate::stripe::corners::with_corners;
use crate::verdict::mistake::others_leave;
use crate::verdict::{self, Reason};
use trueline_dataset::{Guess, Recording};

/// A line that bows by more than this at its visible ends may be an arc, m. The parabola underestimates the uncertainty of an arc.
const BOWED_M: f64 = 5e-3;
/// A curve is the answer if its residuals are below this fraction of the line's. With 600 frames, a third fewer squares are not chance.
const SMALLER: f64 = 0.8;
/// … or if it explains this much more of the scan. At a corner a line explains one side as well as a curve does.
const MORE_OF_IT: f64 = 0.15;
/// A line with residuals this many times larger than another's comes from a wrong start.
const BY_FAR: f64 = 3.0;
/// Reason that stops are not used for a curve.
pub(crate) const AT_STOPS: &str = "the robot stands still at each reading";
/// A curve that became this many times longer or shorter during the fit is rejected.
const ANOTHER_SIZE: f64 = 2.0;

/// Answers with the line, or with a curve if the line is refused for its structure or a curve is requested.
///
/// # Errors
/// Those of the line; [`Error::NoCurve`] if a curve is requested and none is found.
pub(crate) fn answered(
    recording: &Recording,
    guess: Option<&Guess>,
    config: &Config,
    over_lines: &dyn Fn(&Config) -> Result<Calibration, Error>,
) -> Result<Calibration, Error> {
    match over_lines(config) {
        Ok(line) if config.target == Target::Line => Ok(line),
        Ok(line) => beside_line(recording, guess, config, line),
        Err(why @ Error::NoPlates { .. }) if config.target != Target::Line => {
            // Stripes beside a curve lie on no planes.
            let mut line = over_lines(&Config { measurements: Measurements::Seam, ..config.clone() })?;
            line.findings.config = config.clone();
            let answer = beside_line(recording, guess, config, line)?;
            if answer.findings.curve.is_some() { Ok(answer) } else { Err(why) }
        }
        Err(why) => Err(why),
    }
}

/// The same beside the answer with a line.
fn beside_line(
    recording: &Recording,
    guess: Option<&Guess>,
    config: &Config,
    line: Calibration,
) -> Result<Calibration, Error> {
    let cornered = with_corners(recording);
    let recording = cornered.as_ref().unwrap_or(recording);
    let is_forced = config.asks_for_curve();
    let unused = unused(config);
    let unsupported =
        unsupported(config, &line).or(unused.first().map(|(_, why)| *why).filter(|_| is_forced));
    if let (Some(why), true) = (unsupported, is_forced) {
        return Err(Error::NoCurve { why });
    }
    if let Some(why) = unsupported {
        return Ok(untried(line, why));
    }
    if !(is_forced || is_refused(&line) || is_bowed(&line)) {
        return Ok(line);
    }
    let Some(scan) = Scan::of(recording, config) else { return Ok(line) };
    if let Some(why) = too_little(&scan.readings) {
        return if is_forced { Err(Error::NoCurve { why }) } else { Ok(line) };
    }
    let _stage = tracing::debug_span!("curve").entered();
    let answer = match scan.asked(guess, config).answer() {
        Ok(answer) => answer,
        Err(obstacle) if is_forced => return Err(Error::NoCurve { why: why_none(obstacle) }),
        Err(Some(obstacle)) => return Ok(untried(line, why_none(Some(obstacle)))),
        Err(None) => return Ok(line),
    };
    let free = scan.asked(guess, config).without_drift(answer, scan.rate_sigma_ppm);
    let Chosen { scan: dated, clock, answer, .. } = Chosen::of(&scan, free);
    let answer = match &config.seam_cad {
        Some(cad) => dated.asked(guess, config).by_cad(answer, cad)?,
        None => answer,
    };
    // Of one pass the stripes show nothing that its seam points do not, so an answer by stripes is that of the line.
    let by_stripes = line.findings.stripes.as_ref().is_some_and(|stripes| stripes.used != Measurements::Seam);
    let is_taken = is_forced || is_better(&line, &answer) && !(by_stripes && answer.curve.is_one_pass);
    if !is_taken {
        return Ok(with_curve_refused(line, &answer));
    }
    let seam = Chosen { scan: dated, clock, answer, stripes: None };
    let Chosen { scan, clock, answer, stripes } = scan.chosen(recording, (guess, config), seam)?;
    let mut answer = scan.calibration(recording, guess, (line, clock), (&answer, stripes));
    answer.findings.unused_on_curve = unused.iter().map(|(option, _)| *option).collect();
    Ok(Calibration { verdict: verdict::of(&answer.findings), ..answer })
}

/// Why there is no curve.
fn why_none(obstacle: Option<Obstacle>) -> &'static str {
    match obstacle {
        Some(Obstacle::Crosses) => {
            "the seam crosses itself, and the scan cannot separate the branches there: scan each branch alone"
        }
        Some(Obstacle::InPieces) => {
            "the seam points lie on several pieces, and the sensor did not move on from one to the next: scan each piece alone"
        }
        None => "no curve explains most of the seam points to within half a millimetre",
    }
}

/// The line's answer, with the reason that no curve was tested. A motion that is insufficient for a line is insufficient for a
/// curve.
pub(crate) fn untried(line: Calibration, why: &'static str) -> Calibration {
    if !is_misfit(&line) {
        return line;
    }
    let findings = Findings { curve_untried: Some(why), ..line.findings };
    Calibration { verdict: verdict::of(&findings), findings }
}

/// Options that do not apply to a curve, with the reason.
fn unused(config: &Config) -> Vec<(&'static str, &'static str)> {
    let waviness = config.waviness_m.filter(|waviness_m| *waviness_m > 0.0);
    let waviness = waviness
        .map(|_| ("--waviness-mm", "the scan determines how much a curve bends: leave --waviness-mm out"));
    let loss = config.loss.map(|_| ("--loss", "a curve uses its own loss: leave --loss out"));
    waviness.into_iter().chain(loss).collect()
}

/// First option that a curve does not support; `None` if all are supported.
fn unsupported(config: &Config, line: &Calibration) -> Option<&'static str> {
    if config.residual == ResidualKind::PointToLine {
        Some("the point-to-line residual supports straight lines only")
    } else if config.sensor == SensorMode::Free {
        Some("a curve does not determine a free sensor shape: estimate it on straight seams")
    } else if config.at_stops || line.findings.stops.is_some() {
        Some(AT_STOPS)
    } else if !config.hold.is_empty() || !config.drawn_lines.is_empty() {
        Some("a curve does not have the quantity that is held fixed")
    } else if line.best_fit().lines.len() != 1 && config.seam_cad.is_some() {
        Some("the features name several lines, and a drawing has one seam")
    } else {
        None
    }
}

/// Reason that the readings are not enough for a curve.
fn too_little(readings: &Readings) -> Option<&'static str> {
    let few = readings.list.len() < READINGS_PER_KNOT * LEAST_CONTROL;
    few.then_some("too few seam points: a curve has at least eight knots and needs five seam points for each")
}

/// Whether the line is refused for its structure: it does not fit, or not with one attitude or offset. The other side of a corner looks like another offset.
fn is_refused(line: &Calibration) -> bool {
    let of_structure = |reason: &Reason| {
        matches!(
            reason,
            Reason::ResidualsTooLarge { .. }
                | Reason::TooManyOutliers { .. }
                | Reason::MirrorAmbiguity
                | Reason::SensorOff { .. }
                | Reason::NotConverged { .. }
                | Reason::TooFewUsed { .. }
                | Reason::SeamErrorTooLarge { .. }
                | Reason::WrongTimeOffset { .. }
                | Reason::OtherTimeOffset { .. }
                | Reason::WorseMinimum { .. }
        )
    };
    line.reasons().iter().any(of_structure)
}

/// Whether the line does not explain the readings.
fn is_misfit(line: &Calibration) -> bool {
    let of_misfit =
        |reason: &Reason| matches!(reason, Reason::ResidualsTooLarge { .. } | Reason::TooManyOutliers { .. });
    line.reasons().iter().any(of_misfit)
}

/// Whether nothing speaks against the line but the size of its ±.
fn is_imprecise(line: &Calibration) -> bool {
    let of_size = |reason: &Reason| matches!(reason, Reason::SeamErrorTooLarge { .. });
    is_refused(line) && line.reasons().iter().all(of_size)
}

fn is_bowed(line: &Calibration) -> bool {
    let bow_m = |bow: &trueline_model::Curvature| bow.bow_m[0].hypot(bow.bow_m[1]);
    line.best_fit().curvatures.iter().any(|bow| bow_m(bow) > BOWED_M)
}

/// The parabola underestimates the uncertainty of an arc. Whatever the curve leaves open is therefore open. A line that fits is refused for
/// unobservable directions, and a curve does not make these observable.
fn is_better(line: &Calibration, answer: &Answered) -> bool {
    // In one pass a curve can follow a lag, a wrong laser plane or robot errors, and in several passes part of them. A curve that hardly bends
    // counts only if it explains all, and a single pass only if the line is more than imprecise.
    let bends = bends_m(&answer.curve.points_m) > BOWED_M;
    let explains_all = !answer.curve.is_one_pass && answer.finished.factor < verdict::NOISE_FACTOR;
    if !(bends || explains_all) || answer.curve.is_one_pass && is_imprecise(line) {
        return false;
    }
    if !is_refused(line) {
        return true;
    }
    // With a gross mistake in the data the curve changes its size and explains nothing.
    let [length_m, before_m] =
        [answer.curve.length_m, answer.curve.collapsed_from_m.unwrap_or(answer.curve.length_m)];
    let is_of_size = length_m.max(before_m) < ANOTHER_SIZE * length_m.min(before_m);
    let (own, best) = (alone(line), others_leave(&line.findings).fold(f64::INFINITY, f64::min));
    if BY_FAR * best < own {
        // The best line is the reference. The line from a bad guess is not.
        return is_of_size && answer.finished.factor < SMALLER * best;
    }
    let explains_more = line.findings.outliers_of_seam_points().share() > answer.share_off() + MORE_OF_IT;
    is_of_size && (explains_more || answer.finished.factor < SMALLER * own)
}

/// Noise factor of the line's residuals.
fn alone(line: &Calibration) -> f64 {
    let models = &line.findings.models_tried;
    let alone = models.iter().find(|model| model.because == Because::NoiseAlone);
    alone.map_or(line.findings.fit.noise_factor, |model| model.noise_factor)
}

fn with_curve_refused(mut line: Calibration, answer: &Answered) -> Calibration {
    let of_points = |model: &&ModelTried| model.measurements == Measurements::Seam;
    if let Some(first) = line.findings.models_tried.iter().find(of_points).cloned() {
        line.findings.models_tried.push(of_curve(&first, answer, Because::CurveNoBetter));
    }
    line
}
