//! A scan over a curve, and the answer to it as a calibration.

use crate::assess::file_frame::{FileFrame, HandEyeOfFile, StatedSensor};
use crate::assess::levels::SystematicLevels;
use crate::assess::residuals::{self, FeatureResidual};
use crate::assess::seam_error::{self, SeamError, SharedError};
use crate::assess::sensor_shape::SensorShape;
use crate::assess::share::Share;
use crate::calibrate::curved::checks::{ambiguity, observability};
use crate::calibrate::curved::models::models;
use crate::calibration::Calibration;
use crate::config::{Config, PartMoves, SensorMode};
use crate::curve::answer::{Answered, Asked};
use crate::curve::considered::{DetectorError, EdgeError, Errors, ShapeError};
use crate::curve::fit::{CONVERGED, TUKEY_SIGMAS};
use crate::curve::readings::Readings;
use crate::curve::sight::{in_base, moving};
use crate::curve::solve::Search;
use crate::curve::spline::square_to;
use crate::findings::{Checks, ClockFindings, Findings, FitFindings, Unknowns};
use crate::hypotheses::search::Mirrored;
use crate::input::noise_levels::NoiseLevels;
use crate::input::observations::{Observations, observe_by, origin_ns};
use crate::input::shape_knowledge::ShapeKnowledge;
use crate::input::skip::Skip;
use crate::input::timestamps::{Dejittered, Sampling};
use crate::problem::parameters::{LINES, Parameters, TIME_OFFSET};
use crate::stripe::outcome::StripeOutcome;
use crate::verdict;
use nalgebra::{DMatrix, UnitVector3, Vector2};
use std::collections::BTreeMap;
use trueline_dataset::{Guess, Recording};
use trueline_geometry::Line;
use trueline_lsq::{Loss, Termination};

/// A scan as input of a curve's estimate.
#[derive(Clone)]
pub(crate) struct Scan {
    /// Its seam points, with all that the recording says of them.
    pub observations: Observations,
    /// Its seam points.
    pub readings: Readings,
    /// Variance of the time offset from the stamps, s².
    stamps_s2: f64,
    levels: SystematicLevels,
    /// Uncertainty of the clock rates of the stamps, parts per million.
    pub rate_sigma_ppm: f64,
    /// Prior of the sensor's shape.
    knowledge: ShapeKnowledge,
    /// Whether the scan may improve it.
    improves_sensor: bool,
    /// Whether the part moves between passes.
    part: Option<PartMoves>,
}

impl Scan {
    pub(crate) fn of(recording: &Recording, config: &Config) -> Option<Self> {
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
        // An assumed shape error is far larger than that of most sensors, and a curve hardly improves it. A sensor without a
        // stated uncertainty counts as exact.
        let improves_sensor = config.sensor == SensorMode::Prior && knowledge.stated;
        let is_stated = config.feature_bias_px != Config::default().feature_bias_px;
        let levels = SystematicLevels {
            held_shape: levels.held_shape.filter(|_| knowledge.stated),
            feature_bias_px: if is_stated { levels.feature_bias_px } else { 0.0 },
            ..levels
        };
        let rate_sigma_ppm = sampling.rate_sigma_ppm(dejittered);
        Some(Self {
            stamps_s2: stamps_s.powi(2),
            observations,
            readings,
            levels,
            rate_sigma_ppm,
            knowledge,
            improves_sensor,
            part: config.part_moves,
        })
    }

    /// The same with readings that got new stamps, if any did.
    #[must_use]
    pub(crate) fn dated(&self, readings: Option<&Readings>) -> Self {
        let mut dated = self.clone();
        let stamps = readings.iter().flat_map(|readings| readings.list.iter().map(|reading| reading.stamp_s));
        let own = dated.observations.list.iter_mut().zip(&mut dated.readings.list);
        for ((observation, reading), stamp_s) in own.zip(stamps) {
            (observation.stamp_s, reading.stamp_s) = (stamp_s, stamp_s);
        }
        dated
    }

    /// The same with other readings of the same seam points.
    #[must_use]
    pub(crate) fn with_readings(&self, readings: Readings) -> Self {
        Self { readings, ..self.clone() }
    }

    pub(crate) fn asked<'a>(&'a self, guess: Option<&'a Guess>, config: &'a Config) -> Asked<'a> {
        let (within_s, threads) = (config.offset_search_s, config.threads);
        let search = Search { readings: &self.readings, within_s, guess, threads };
        Asked { search, errors: self.errors(), known: &config.known }
    }

    fn errors(&self) -> Errors<'_> {
        let origin_m = self.observations.shape_origin_m.into();
        let shape = self.levels.held_shape.map(|covariance| ShapeError {
            covariance,
            origin_m,
            is_estimated: self.improves_sensor,
        });
        let SystematicLevels { robot, edge_radius_m, feature_bias_px: px, .. } = self.levels;
        let edge = EdgeError { radius_m: edge_radius_m, from_origin: self.observations.are_pixels };
        let detector = DetectorError { px, observations: &self.observations };
        Errors { robot, shape, part: self.part, edge, detector: (px > 0.0).then_some(detector) }
    }

    /// The calibration, with the streams of the line's calibration.
    pub(crate) fn calibration(
        &self,
        recording: &Recording,
        guess: Option<&Guess>,
        (line, clock): (Calibration, ClockFindings),
        (answer, stripes): (&Answered, Option<StripeOutcome>),
    ) -> Calibration {
        let mut findings = line.findings;
        findings.unknowns = self.unknowns(recording, answer);
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
        let seam_error = is_seen.then(|| self.seam_error(answer, &findings.config)).flatten();
        findings.checks = self.checks(answer, guess, &findings, seam_error);
        findings.clock = clock;
        findings.stripes = stripes;
        findings.models_tried = models(&findings, answer);
        findings.curve = Some(answer.curve.clone());
        Calibration { verdict: verdict::of(&findings), findings }
    }

    pub(crate) fn unknowns(&self, recording: &Recording, answer: &Answered) -> Unknowns {
        let parameters = Parameters { shape: answer.shape, ..Parameters::straight(&answer.at(), Vec::new()) };
        let size = parameters.dimension();
        let in_all = |i: usize, j: usize| if i < LINES && j < LINES { answer.noise[(i, j)] } else { 0.0 };
        let mut noise = DMatrix::from_fn(size, size, in_all);
        noise[(TIME_OFFSET, TIME_OFFSET)] += self.stamps_s2;
        let own = |share: &Share| {
            let mut columns = share.columns.clone().resize_vertically(size, 0.0);
            if let Some(shape) = share.shape.as_ref().filter(|_| answer.shape.is_some()) {
                columns.rows_mut(LINES, shape.nrows()).copy_from(shape);
            }
            &columns * columns.transpose()
        };
        let covariance = answer.shares.iter().fold(noise.clone(), |sum, share| sum + own(share));
        let stated = StatedSensor::of(&self.observations, &parameters);
        let frame = stated.as_ref().map_or_else(FileFrame::of_estimate, |stated| stated.frame);
        Unknowns {
            observability: observability(answer, &parameters),
            sensor: SensorShape::of(recording, &parameters, &covariance, &self.knowledge),
            corrected: None,
            stated,
            written: None,
            of_file: HandEyeOfFile::of(frame, &parameters, &covariance, &noise),
            estimated: vec![true; size],
            parameters,
            covariance,
            noise_covariance: noise,
            of_robot: None,
            held_at_guess: false,
            has_time_offset: true,
        }
    }

    fn residuals(&self, answer: &Answered) -> (Vec<FeatureResidual>, BTreeMap<Skip, usize>) {
        let fitted = &answer.finished.fitted;
        let loss = Loss::Tukey { scale: TUKEY_SIGMAS };
        let mut skipped = self.observations.skipped.clone();
        let mut list = Vec::with_capacity(self.readings.list.len());
        let corrected = answer.shape.map(|shape| self.readings.corrected(&shape));
        let readings = corrected.as_ref().unwrap_or(&self.readings);
        let (sights, whiteners) = answer.seam_points(readings);
        for (k, reading) in readings.list.iter().enumerate() {
            let at = &fitted.state.at;
            let (Some(seen), Some(place), Some(robot)) =
                (&sights[k], in_base(readings, reading, at), moving(readings, reading, at))
            else {
                *skipped.entry(Skip::AlongPlane).or_insert(0) += 1;
                continue;
            };
            let base_from_sheet = robot.attitude
                * at.tool_from_camera.rotation.to_rotation_matrix().into_inner()
                * self.readings.sheet.axes();
            let residual = seen.residual.xy();
            let off = base_from_sheet * residual;
            let across = square_to(&seen.tangent, None);
            let whitened = (whiteners[k] * seen.residual).xy() / answer.finished.variance.sqrt();
            let observation = &self.observations.list[k];
            let to_px = || Some(observation.sheet_per_px().try_inverse()? * residual);
            list.push(FeatureResidual {
                row: reading.row,
                line: 0,
                stamp_s: reading.stamp_s,
                point_in_base: place,
                offset_m: Vector2::new(across[0].dot(&off), across[1].dot(&off)),
                residual_px: self.observations.are_pixels.then(to_px).flatten(),
                in_sheet_m: Some(residual),
                crossing_m_s: Some(seen.by_shared.fixed_view::<2, 1>(0, 0).into_owned()),
                whitened,
                normalised: whitened.norm(),
                weight: loss.weight(whitened.norm_squared()),
            });
        }
        (list, skipped)
    }

    /// The error of a seam point, as for the tangent line at the curve's middle.
    pub(crate) fn seam_error(&self, answer: &Answered, config: &Config) -> Option<SeamError> {
        let points = &answer.curve.points_m[answer.curve.seams.first()?.points.clone()];
        let middle = points.len() / 2;
        let ahead = points.get(middle + 1)? - points.get(middle)?;
        let line = Line::new(points[middle], &UnitVector3::try_new(ahead, f64::EPSILON)?);
        let at = Parameters { shape: answer.shape, ..Parameters::straight(&answer.at(), vec![line]) };
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
        let is_held = answer.shape.is_none() && self.knowledge.stated;
        seam_error::of_shares(
            &self.observations,
            &self.observations.list,
            &at,
            &SharedError {
                noise: &noise,
                stamps_variance_s2: self.stamps_s2,
                shares: &shares,
                levels: SystematicLevels {
                    held_shape: self.levels.held_shape.filter(|_| is_held),
                    ..self.levels
                },
                speed_m_s: config.used_at.speed_m_s,
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
            part_moved_m: answer.curve.part_moved_m,
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
