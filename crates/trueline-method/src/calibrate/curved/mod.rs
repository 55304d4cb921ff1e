//! Scans over a curved seam: when a curve is tried, and its answer as a calibration.

mod checks;
mod models;

use crate::assess::file_frame::{FileFrame, HandEyeOfFile};
use crate::assess::levels::SystematicLevels;
use crate::assess::residuals::{self, FeatureResidual};
use crate::assess::seam_error::{self, SeamError, Share, SharedError};
use crate::calibrate::curved::checks::{ambiguity, observability};
use crate::calibrate::curved::models::{models, of_curve};
use crate::calibration::Calibration;
use crate::config::{Config, Measurements, ResidualKind, SensorMode, Target};
use crate::curve::answer::{Answered, Asked};
use crate::curve::considered::{DetectorError, EdgeError, Errors, ShapeError};
use crate::curve::fit::{CONVERGED, TUKEY_SIGMAS};
use crate::curve::readings::Readings;
use crate::curve::registration::bends_m;
use crate::curve::sight::{in_base, moving};
use crate::curve::solve::{READINGS_PER_KNOT, Search};
use crate::curve::spline::{LEAST_CONTROL, square_to};
use crate::error::Error;
use crate::findings::{Checks, ClockFindings, Findings, FitFindings, Unknowns};
use crate::hypotheses::drift_and_step::Drift;
use crate::hypotheses::search::Mirrored;
use crate::input::noise_levels::NoiseLevels;
use crate::input::observations::{Observations, observe_by, origin_ns};
use crate::input::shape_knowledge::ShapeKnowledge;
use crate::input::skip::Skip;
use crate::input::timestamps::{Dejittered, Sampling};
use crate::models::Because;
use crate::problem::parameters::{LINES, Parameters, TIME_OFFSET};
use crate::verdict::mistake::others_leave;
use crate::verdict::{self, Reason};
use nalgebra::{DMatrix, UnitVector3, Vector2};
use std::collections::BTreeMap;
use trueline_dataset::{Guess, Recording};
use trueline_geometry::Line;
use trueline_lsq::{Loss, Termination};

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
    line: Result<Calibration, Error>,
) -> Result<Calibration, Error> {
    let line = line?;
    if config.target == Target::Line {
        return Ok(line);
    }
    let is_forced = config.target == Target::Curve || config.seam_cad.is_some();
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
    let Some(answer) = scan.asked(guess, config).answer() else {
        const WHY: &str = "no curve explains most of the seam points to within half a millimetre";
        return if is_forced { Err(Error::NoCurve { why: WHY }) } else { Ok(line) };
    };
    let free = scan.asked(guess, config).without_drift(answer, scan.rate_sigma_ppm);
    let scan = scan.dated(free.readings);
    let (clock, answer) = (clock(free.drift, free.drifted), free.answer);
    let answer = match &config.seam_cad {
        Some(cad) => scan.asked(guess, config).by_cad(answer, cad)?,
        None => answer,
    };
    let is_taken = is_forced || is_better(&line, &answer);
    if !is_taken {
        return Ok(with_curve_refused(line, &answer));
    }
    let mut answer = scan.calibration(recording, guess, (line, clock), &answer);
    answer.findings.unused_on_curve = unused.iter().map(|(option, _)| *option).collect();
    Ok(Calibration { verdict: verdict::of(&answer.findings), ..answer })
}

fn clock(drift: Option<Drift>, drifted: Option<Drift>) -> ClockFindings {
    ClockFindings { drift, drifted, step: None, stepped: None, noise_factor_without_step: None }
}

/// The line's answer, with the reason that no curve was tried. A motion that is insufficient for a line is insufficient for a curve.
pub(crate) fn untried(line: Calibration, why: &'static str) -> Calibration {
    let is_misfit =
        |reason: &Reason| matches!(reason, Reason::ResidualsTooLarge { .. } | Reason::TooManyOutliers { .. });
    if !line.reasons().iter().any(is_misfit) {
        return line;
    }
    let findings = Findings { curve_untried: Some(why), ..line.findings };
    Calibration { verdict: verdict::of(&findings), findings }
}

/// Options that do not apply to a curve, with the reason.
fn unused(config: &Config) -> Vec<(&'static str, &'static str)> {
    let waviness = config.waviness_m.filter(|waviness_m| *waviness_m > 0.0);
    let waviness =
        waviness.map(|_| ("--waviness-mm", "the scan shows how much a curve bends: leave --waviness-mm out"));
    let loss = config.loss.map(|_| ("--loss", "a curve has a loss of its own: leave --loss out"));
    waviness.into_iter().chain(loss).collect()
}

/// First option that a curve does not support; `None` if all are supported.
fn unsupported(config: &Config, line: &Calibration) -> Option<&'static str> {
    if config.residual == ResidualKind::PointToLine {
        Some("the point-to-line residual supports straight lines only")
    } else if config.sensor == SensorMode::Free {
        Some("a curve does not show the sensor's shape: a free one is estimated on straight seams")
    } else if config.at_stops || line.findings.stops.is_some() {
        Some(AT_STOPS)
    } else if !config.hold.is_empty() || !config.drawn_lines.is_empty() {
        Some("a quantity is held fixed that a curve does not have")
    } else if line.findings.stripes.as_ref().is_some_and(|stripes| stripes.used != Measurements::Seam) {
        Some("whole stripes support straight seams only")
    } else if line.best_fit().lines.len() != 1 {
        Some("the features name several lines")
    } else {
        None
    }
}

/// Reason that the readings are not enough for a curve.
fn too_little(readings: &Readings) -> Option<&'static str> {
    let few = readings.list.len() < READINGS_PER_KNOT * LEAST_CONTROL;
    few.then_some("a curve has at least eight knots and needs five seam points for each: there are fewer")
}

/// Whether the line is refused for its structure: it does not fit, or not with one attitude.
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
                | Reason::WorseMinimum { .. }
        )
    };
    line.reasons().iter().any(of_structure)
}

fn is_bowed(line: &Calibration) -> bool {
    let bow_m = |bow: &trueline_model::Curvature| bow.bow_m[0].hypot(bow.bow_m[1]);
    line.best_fit().curvatures.iter().any(|bow| bow_m(bow) > BOWED_M)
}

/// The parabola underestimates the uncertainty of an arc. Whatever the curve leaves open is therefore open. A line that fits is refused for
/// unobservable directions, and a curve does not make these observable.
fn is_better(line: &Calibration, answer: &Answered) -> bool {
    // In one pass a curve can follow a lag, a wrong laser plane or robot errors. It counts only if it clearly bends.
    if answer.curve.is_one_pass && bends_m(&answer.curve.points_m) < BOWED_M {
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
    let explains_more = line.findings.outliers().share() > answer.share_off() + MORE_OF_IT;
    is_of_size && (explains_more || answer.finished.factor < SMALLER * own)
}

/// Noise factor of the line's residuals.
fn alone(line: &Calibration) -> f64 {
    let models = &line.findings.models_tried;
    let alone = models.iter().find(|model| model.because == Because::NoiseAlone);
    alone.map_or(line.findings.fit.noise_factor, |model| model.noise_factor)
}

fn with_curve_refused(mut line: Calibration, answer: &Answered) -> Calibration {
    if let Some(first) = line.findings.models_tried.first().cloned() {
        line.findings.models_tried.push(of_curve(&first, answer, Because::CurveNoBetter));
    }
    line
}

/// A scan as input of a curve estimate.
struct Scan {
    observations: Observations,
    readings: Readings,
    /// Variance that the stamps add to the time offset, s².
    stamps_s2: f64,
    levels: SystematicLevels,
    /// Standard deviation of the stamp clocks' rates, parts per million.
    rate_sigma_ppm: f64,
}

impl Scan {
    fn of(recording: &Recording, config: &Config) -> Option<Self> {
        let sampling = Sampling::of(recording, origin_ns(recording));
        let dejittered: Dejittered = sampling.of_arrival(config);
        let observations = observe_by(dejittered, recording, &sampling, config).ok()?;
        let noise = NoiseLevels {
            robot_sigma_m: config.robot_sigma_m.unwrap_or(observations.robot.noise_m),
            stamp_sigma_s: sampling.stamp_sigma_s(config, dejittered),
            factor: 1.0,
        };
        let readings = Readings::of(&observations, noise);
        let stamps_s = sampling.phase_sigma_s(dejittered).hypot(observations.robot.late_sigma_s);
        let knowledge = ShapeKnowledge::of(recording, &observations);
        let levels = SystematicLevels::of(recording, config, &knowledge, true);
        // For a line the assumed levels are estimated too and hardly widen the uncertainty. A curve only considers them, so only stated levels are
        // used.
        let is_stated = config.feature_bias_px != Config::default().feature_bias_px;
        let levels = SystematicLevels {
            held_shape: levels.held_shape.filter(|_| knowledge.stated),
            feature_bias_px: if is_stated { levels.feature_bias_px } else { 0.0 },
            ..levels
        };
        let rate_sigma_ppm = sampling.rate_sigma_ppm(dejittered);
        Some(Self { observations, readings, stamps_s2: stamps_s.powi(2), levels, rate_sigma_ppm })
    }

    /// The same with re-dated readings, if there are any.
    fn dated(mut self, readings: Option<Readings>) -> Self {
        if let Some(readings) = readings {
            for (observation, reading) in self.observations.list.iter_mut().zip(&readings.list) {
                observation.stamp_s = reading.stamp_s;
            }
            self.readings = readings;
        }
        self
    }

    fn asked<'a>(&'a self, guess: Option<&'a Guess>, config: &'a Config) -> Asked<'a> {
        let (within_s, threads) = (config.offset_search_s, config.threads);
        let search = Search { readings: &self.readings, within_s, guess, threads };
        Asked { search, errors: self.errors(), known: &config.known }
    }

    fn errors(&self) -> Errors<'_> {
        let origin_m = self.observations.shape_origin_m.into();
        let shape = self.levels.held_shape.map(|covariance| ShapeError { covariance, origin_m });
        let SystematicLevels { robot, edge_radius_m, feature_bias_px: px, .. } = self.levels;
        let edge = EdgeError { radius_m: edge_radius_m, from_origin: self.observations.are_pixels };
        let detector = DetectorError { px, observations: &self.observations };
        Errors { robot, shape, edge, detector: (px > 0.0).then_some(detector) }
    }

    /// The calibration, with the streams of the line's calibration.
    fn calibration(
        &self,
        recording: &Recording,
        guess: Option<&Guess>,
        (line, clock): (Calibration, ClockFindings),
        answer: &Answered,
    ) -> Calibration {
        let mut findings = line.findings;
        findings.unknowns = self.unknowns(answer);
        let (features, skipped) = self.residuals(answer);
        let stamp_of = |f: &FeatureResidual| recording.features[f.row as usize].stamp_ns;
        findings.fit = FitFindings {
            residuals: residuals::summarise(&features, skipped),
            feature_stamps_ns: features.iter().map(stamp_of).collect(),
            noise_factor: answer.finished.factor,
            structure: crate::assess::correlated_noise::Structure::Unknown,
            amplitudes: None,
            widened_by: None,
            covariance_model_share: 1.0,
            termination: Termination::CostConverged { decrease: CONVERGED, threshold: CONVERGED },
            iterations: Vec::new(),
            sheet_fit_rms_m: self.observations.sheet_fit_rms_m,
            features,
        };
        let is_seen = answer.components.iter().all(|seen| *seen);
        let seam_error = is_seen.then(|| self.seam_error(answer, &findings)).flatten();
        findings.checks = self.checks(answer, guess, &findings, seam_error);
        findings.clock = clock;
        findings.stripes = None;
        findings.models_tried = models(&findings, answer);
        findings.curve = Some(answer.curve.clone());
        Calibration { verdict: verdict::of(&findings), findings }
    }

    fn unknowns(&self, answer: &Answered) -> Unknowns {
        let parameters = Parameters::straight(&answer.at(), Vec::new());
        let mut noise = DMatrix::from_fn(LINES, LINES, |i, j| answer.noise[(i, j)]);
        noise[(TIME_OFFSET, TIME_OFFSET)] += self.stamps_s2;
        let own = |columns: &DMatrix<f64>| columns * columns.transpose();
        let covariance = answer.shares.iter().fold(noise.clone(), |sum, share| sum + own(&share.columns));
        let of_file = HandEyeOfFile::of(FileFrame::of_estimate(), &parameters, &covariance, &noise);
        Unknowns {
            observability: observability(answer, &parameters),
            parameters,
            covariance,
            noise_covariance: noise,
            sensor: None,
            corrected: None,
            stated: None,
            written: None,
            of_file,
            estimated: vec![true; LINES],
            held_at_guess: false,
            has_time_offset: true,
        }
    }

    fn residuals(&self, answer: &Answered) -> (Vec<FeatureResidual>, BTreeMap<Skip, usize>) {
        let fitted = &answer.finished.fitted;
        let loss = Loss::Tukey { scale: TUKEY_SIGMAS };
        let mut skipped = self.observations.skipped.clone();
        let mut list = Vec::with_capacity(self.readings.list.len());
        for (k, reading) in self.readings.list.iter().enumerate() {
            let at = &fitted.state.at;
            let (Some(seen), Some(place), Some(robot)) = (
                &fitted.sights[k],
                in_base(&self.readings, reading, at),
                moving(&self.readings, reading, at),
            ) else {
                *skipped.entry(Skip::AlongPlane).or_insert(0) += 1;
                continue;
            };
            let base_from_sheet = robot.attitude
                * at.tool_from_camera.rotation.to_rotation_matrix().into_inner()
                * self.readings.sheet.axes();
            let off = base_from_sheet * seen.residual;
            let across = square_to(&seen.tangent, None);
            let whitened = fitted.whiteners[k] * seen.residual / answer.finished.variance.sqrt();
            let observation = &self.observations.list[k];
            let to_px = || Some(observation.sheet_per_px().try_inverse()? * seen.residual);
            list.push(FeatureResidual {
                row: reading.row,
                line: 0,
                stamp_s: reading.stamp_s,
                point_in_base: place,
                offset_m: Vector2::new(across[0].dot(&off), across[1].dot(&off)),
                residual_px: self.observations.are_pixels.then(to_px).flatten(),
                in_sheet_m: Some(seen.residual),
                crossing_m_s: Some(seen.by_shared.column(0).into_owned()),
                whitened,
                normalised: whitened.norm(),
                weight: loss.weight(whitened.norm_squared()),
            });
        }
        (list, skipped)
    }

    /// The error of a seam point along the tangent at the middle of the curve.
    fn seam_error(&self, answer: &Answered, findings: &Findings) -> Option<SeamError> {
        let points = &answer.curve.points_m;
        let middle = points.len() / 2;
        let ahead = points.get(middle + 1)? - points.get(middle)?;
        let line = Line::new(points[middle], &UnitVector3::try_new(ahead, f64::EPSILON)?);
        let at = Parameters::straight(&answer.at(), vec![line]);
        let size = at.dimension();
        let noise =
            DMatrix::from_fn(
                size,
                size,
                |i, j| {
                    if i < LINES && j < LINES { answer.noise[(i, j)] } else { 0.0 }
                },
            );
        let with_line = |share: &Share| Share {
            columns: share.columns.clone().resize_vertically(size, 0.0),
            ..share.clone()
        };
        let shares: Vec<Share> = answer.shares.iter().map(with_line).collect();
        seam_error::of_shares(
            &self.observations,
            &self.observations.list,
            &at,
            &SharedError {
                noise: &noise,
                stamps_variance_s2: self.stamps_s2,
                shares: &shares,
                levels: self.levels,
                speed_m_s: findings.config.used_at.speed_m_s,
            },
        )
    }

    fn checks(
        &self,
        answer: &Answered,
        guess: Option<&Guess>,
        findings: &Findings,
        seam_error: Option<SeamError>,
    ) -> Checks {
        Checks {
            mirrored: Mirrored::ToldApart,
            ambiguity: ambiguity(answer, guess, &findings.config),
            better: None,
            held_out: None,
            outlier_segments: Vec::new(),
            seam_error,
            held_sensor: None,
            confounded_causes: Vec::new(),
            held_off: Vec::new(),
            drawn_line_shifts: Vec::new(),
            better_without_drawing_m: None,
            cause: None,
            lens: None,
            robot_taken: self.levels.robot,
            robot_seems: None,
            feature_bias: None,
            seam_point_error: None,
        }
    }
}
