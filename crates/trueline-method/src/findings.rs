//! All findings about a scan, before the verdict.

use crate::adjustment::error_sizes::Amplitudes;
use crate::assess::confounded_causes::ConfoundedCause;
use crate::assess::corrected_sensor::CorrectedSensor;
use crate::assess::correlated_noise::Structure;
use crate::assess::cross_validation::HeldOut;
use crate::assess::drawn_line_shift::DrawnLineShift;
use crate::assess::file_frame::{FileFrame, HandEyeOfFile, StatedSensor};
use crate::assess::held_off::HeldOff;
use crate::assess::lens::LensCorrection;
use crate::assess::misfit_cause::MisfitCause;
use crate::assess::observability::Observability;
use crate::assess::outlier_segments::OutlierSegment;
use crate::assess::outliers::Outliers;
use crate::assess::residuals::{FeatureResidual, ResidualSummary};
use crate::assess::robot_field::OfRobot;
use crate::assess::robot_field::RobotSigmas;
use crate::assess::seam_error::SeamError;
use crate::assess::seam_point_error::SeamPointError;
use crate::assess::sensor_shape::SensorShape;
use crate::axes::finding::AxisFinding;
use crate::config::{Config, Measurements};
use crate::curve::estimate::CurveEstimate;
use crate::hypotheses::ambiguity::Ambiguity;
use crate::hypotheses::drift_and_step::{Drift, Step};
use crate::hypotheses::feature_bias::FeatureBias;
use crate::hypotheses::search::{BetterMinimum, Mirrored};
use crate::input::stops::Stops;
use crate::input::timestamps::StampReport;
use crate::models::ModelTried;
use crate::problem::parameters::{Parameters, TIME_OFFSET};
use crate::solve::iteration_record::IterationRecord;
use crate::stripe::outcome::{StripeEstimate, StripeOutcome};
use nalgebra::DMatrix;
use std::collections::BTreeMap;
use trueline_dataset::result_file::SensorFileEntry;
use trueline_lsq::Termination;

/// All findings.
#[derive(Clone, Debug)]
pub struct Findings {
    /// The kind of sensor, as in `sensor.toml`.
    pub sensor_kind: &'static str,
    /// The unknowns, and how well the scan determines them.
    pub unknowns: Unknowns,
    /// The fit of the model.
    pub fit: FitFindings,
    /// Checks of the estimate.
    pub checks: Checks,
    /// Whether one time offset holds for the whole scan.
    pub clock: ClockFindings,
    /// The recorded streams.
    pub streams: Streams,
    /// Answer of the whole stripes. `None` if there are none, or only seam points were requested.
    pub stripes: Option<StripeOutcome>,
    /// The curve, if it is the answer. Then there is no line.
    pub curve: Option<CurveEstimate>,
    /// Reason that no curve was tried although the line was refused for its structure. `None` if it was tried, or is unnecessary.
    pub curve_untried: Option<&'static str>,
    /// Requested options that do not apply to a curve.
    pub unused_on_curve: Vec<&'static str>,
    /// The external axes, in the order of the cell.
    pub axes: Vec<AxisFinding>,
    /// Whether the recording states an uncertainty of the sensor that the result does not include.
    pub uncertainty_ignored: bool,
    /// Whether the robot stood still at each reading, and the source of that. `None` if it moves.
    pub stops: Option<Stops>,
    /// Whether the sensor was held because its file was written from this scan.
    pub sensor_of_its_own_scan: bool,
    /// SHA-256 of the inputs.
    pub inputs: BTreeMap<String, String>,
    /// The options of the calibration.
    pub config: Config,
    /// The fitted models, the answer first.
    pub models_tried: Vec<ModelTried>,
}

impl Findings {
    /// The length that counts as a pixel, m, if features are lengths. `None` if they are pixels.
    #[must_use]
    pub fn length_per_px_m(&self) -> Option<f64> {
        self.fit.residuals.rms_px.is_none().then(|| self.config.length_per_px_m())
    }

    /// Outliers among the measurements of the answer: the stripes, or the seam points if those are used. Beside bowed plates correct seam points are
    /// off the seam where the plates seem to meet.
    #[must_use]
    pub(crate) fn outliers(&self) -> Outliers {
        let of_stripes = self.used_stripes().map(|estimate| estimate.counts.outliers());
        of_stripes.unwrap_or_else(|| self.outliers_of_seam_points())
    }

    /// Outliers among the seam points.
    #[must_use]
    pub(crate) fn outliers_of_seam_points(&self) -> Outliers {
        let ResidualSummary { outliers, used, .. } = self.fit.residuals;
        Outliers { count: outliers, of: used }
    }

    /// Outliers of each seam among the measurements of the answer.
    #[must_use]
    pub(crate) fn outliers_of_lines(&self) -> Vec<Outliers> {
        let of_stripes = self.used_stripes().and_then(|estimate| estimate.adjustment.as_ref());
        if let Some(stripes) = of_stripes {
            return stripes.of_joints.clone();
        }
        let mut of_lines = vec![Outliers::default(); self.unknowns.parameters.lines.len()];
        for feature in &self.fit.features {
            let own = &mut of_lines[feature.line as usize];
            own.of += 1;
            own.count += usize::from(feature.is_outlier());
        }
        of_lines
    }

    /// Estimated errors that are not noise, of the answer. `None` if it was not adjusted with them.
    #[must_use]
    pub fn errors_found(&self) -> Option<&Amplitudes> {
        let of_stripes = self.used_stripes().and_then(|estimate| estimate.adjustment.as_ref());
        of_stripes.map(|stripes| &stripes.amplitudes).or(self.fit.amplitudes.as_ref())
    }

    /// The same if the seam points were adjusted too. Where a cell states an exact seam, they are judged by noise alone.
    #[must_use]
    pub(crate) fn adjusted(&self) -> Option<&Amplitudes> {
        self.fit.amplitudes.as_ref().and_then(|_| self.errors_found())
    }

    /// Noise factor of the stripes, if the answer was computed from them.
    #[must_use]
    pub(crate) fn stripe_noise_factor(&self) -> Option<f64> {
        self.used_stripes().map(|estimate| estimate.noise_factor)
    }

    pub(crate) fn used_stripes(&self) -> Option<&StripeEstimate> {
        let used = self.stripes.as_ref().filter(|stripes| stripes.used != Measurements::Seam)?;
        used.estimate.as_deref()
    }
}

/// The unknowns with their observability.
#[derive(Clone, Debug)]
pub struct Unknowns {
    /// The unknowns at the end of the solve. Unobservable ones are arbitrary numbers.
    pub(crate) parameters: Parameters,
    /// Covariance of the tangent, SI units, from noise, sensor, robot, form of the seam and bias of the features. Unobservable parts are arbitrary.
    pub(crate) covariance: DMatrix<f64>,
    /// Its random part: noise of features, robot and stamps.
    pub(crate) noise_covariance: DMatrix<f64>,
    /// The shape of the sensor's sheet. `None` if it was held.
    pub sensor: Option<SensorShape>,
    /// The sensor as corrected by the scan. `None` if the shape was held.
    pub corrected: Option<CorrectedSensor>,
    /// The sensor as its file states it. `None` if the shape was held, or part of the hand-eye transform is unobservable.
    pub stated: Option<StatedSensor>,
    /// The corrected sensor's file, if it was written and the hand-eye transform refers to it.
    pub written: Option<SensorFileEntry>,
    /// The hand-eye transform for the file named in the result, with its covariances.
    pub(crate) of_file: HandEyeOfFile,
    /// For each component of the tangent, whether it was estimated. Else it was held.
    pub estimated: Vec<bool>,
    /// Observability of the scan.
    pub observability: Observability,
    /// The part of the robot's errors in the answer; `None` of an ideal robot, and where other sensors do not share it.
    pub(crate) of_robot: Option<OfRobot>,
    /// Whether unobservable directions were held at the initial guess, as the user allowed.
    pub held_at_guess: bool,
    /// Whether there is a time offset. A robot that stands at each reading has none.
    pub has_time_offset: bool,
}

impl Unknowns {
    /// Standard deviation of a component of the tangent, SI. `None` if it was held or is unobservable.
    #[must_use]
    pub fn sigma(&self, component: usize) -> Option<f64> {
        Some(self.covariance(component, component)?.max(0.0).sqrt())
    }

    /// The random part of [`Unknowns::sigma`]: noise of features, robot and stamps.
    #[must_use]
    pub fn noise_sigma(&self, component: usize) -> Option<f64> {
        let known = self.estimated[component] && self.observability.observable_components[component];
        known.then(|| self.of_file.noise_covariance[(component, component)].max(0.0).sqrt())
    }

    /// Covariance of two components of the tangent, SI. `None` if one was held or is unobservable.
    #[must_use]
    pub fn covariance(&self, row: usize, column: usize) -> Option<f64> {
        let known = |k: usize| self.estimated[k] && self.observability.observable_components[k];
        (known(row) && known(column)).then(|| self.of_file.covariance[(row, column)])
    }

    /// The bow of a line along its two cross axes, with their standard deviations, m at the ends of the visible part. `None` if the line was held
    /// straight or the bow is unobservable.
    #[must_use]
    pub fn bow(&self, line: usize) -> Option<[(f64, f64); 2]> {
        let curvature = self.parameters.curvatures.get(line)?;
        let first = self.parameters.unknowns().bow(line).start;
        Some([(curvature.bow_m[0], self.sigma(first)?), (curvature.bow_m[1], self.sigma(first + 1)?)])
    }

    /// The same without usable features, which makes every component unknown.
    pub(crate) fn of_no_feature(mut self) -> Self {
        self.observability = Observability::of_nothing(&self.parameters);
        self.estimated.fill(false);
        (self.sensor, self.corrected, self.stated, self.held_at_guess) = (None, None, None, false);
        self
    }

    /// The same with the hand-eye transform of the corrected sensor's file.
    pub(crate) fn for_corrected_sensor(mut self, written: SensorFileEntry) -> Option<Self> {
        let frame = self.corrected.as_ref()?.frame;
        self.of_file = HandEyeOfFile::of(frame, &self.parameters, &self.covariance, &self.noise_covariance);
        (self.stated, self.written) = (None, Some(written));
        Some(self)
    }

    /// The frame of the result's sensor file for another answer to the same scan.
    pub(crate) fn file_frame_by(&self, other: &Parameters) -> FileFrame {
        self.stated.as_ref().map_or(self.of_file.frame, |stated| stated.frame_by(other))
    }

    /// Whether a component is determined: it was held, or it is observable.
    #[must_use]
    pub fn is_known(&self, component: usize) -> bool {
        let exists = component != TIME_OFFSET || self.has_time_offset;
        exists && (self.held_at_guess || self.observability.observable_components[component])
    }
}

/// The fit of the model.
#[derive(Clone, Debug)]
pub struct FitFindings {
    /// Residual figures.
    pub residuals: ResidualSummary,
    /// The residual of every feature.
    pub features: Vec<FeatureResidual>,
    /// Recorded stamp of each of `features`, ns.
    pub feature_stamps_ns: Vec<i64>,
    /// Noise factor: residuals divided by the expected noise.
    pub noise_factor: f64,
    /// Whether they are correlated.
    pub structure: Structure,
    /// Estimated systematic errors of the seam points, if their answer was adjusted with them.
    pub amplitudes: Option<Amplitudes>,
    /// Ratio of the least certain rotation's uncertainty to that from the curvature at the optimum. `None` if they agree.
    pub widened_by: Option<f64>,
    /// Share of the model in the covariance, 0 to 1.
    pub covariance_model_share: f64,
    /// Reason that the solver ended.
    pub termination: Termination,
    /// Every step of the solver on all features.
    pub iterations: Vec<IterationRecord>,
    /// RMS of the points about the fitted laser plane, m.
    pub sheet_fit_rms_m: Option<f64>,
}

/// Checks of the estimate.
#[derive(Clone, Debug)]
pub struct Checks {
    /// Comparison with the mirrored attitude of the sensor.
    pub mirrored: Mirrored,
    /// Rival solutions, and the decision between them.
    pub ambiguity: Ambiguity,
    /// A better minimum than that from the guess.
    pub better: Option<BetterMinimum>,
    /// Cross-validation between parts of the scan.
    pub held_out: Option<HeldOut>,
    /// Stretches of the scan that disagree with the rest.
    pub outlier_segments: Vec<OutlierSegment>,
    /// Largest shift of the part beside its place in the first pass, m. `None` if it stayed.
    pub part_moved_m: Option<f64>,
    /// Predicted error of a later seam point. `None` if the hand-eye transform is not fully observable.
    pub seam_error: Option<SeamError>,
    /// Estimated shape of a sensor that was held fixed. `None` if it was estimated, or is unobservable.
    pub held_sensor: Option<SensorShape>,
    /// Confounded causes of an apparent sensor error.
    pub confounded_causes: Vec<ConfoundedCause>,
    /// Held quantities (--fix) that the scan contradicts.
    pub held_off: Vec<HeldOff>,
    /// Lines that are not where they were drawn and held.
    pub drawn_line_shifts: Vec<DrawnLineShift>,
    /// Seam error without the drawn lines, m, if smaller than with them.
    pub better_without_drawing_m: Option<f64>,
    /// Cause of residuals that are not noise, if one usual cause explains them.
    pub cause: Option<MisfitCause>,
    /// Correction of the lens, if that is the cause.
    pub lens: Option<LensCorrection>,
    /// Assumed robot errors within the scan.
    pub robot_taken: RobotSigmas,
    /// Robot errors from the residuals, if clearly larger.
    pub robot_seems: Option<RobotSigmas>,
    /// The bias of the features with the tilt, if it was estimated and removed.
    pub feature_bias: Option<FeatureBias>,
    /// Error of a seam point in use. `None` if part of the hand-eye transform is unobservable.
    pub seam_point_error: Option<SeamPointError>,
}

impl Checks {
    /// Whether the scan contradicts a held quantity: then the residuals, and all conclusions from them, are
    /// due to that error.
    #[must_use]
    pub(crate) fn contradict_what_is_held(&self) -> bool {
        !self.held_off.is_empty()
            || !self.drawn_line_shifts.is_empty()
            || self.held_sensor.is_some_and(|shape| shape.is_off())
    }
}

/// Whether one time offset holds for the whole scan.
#[derive(Clone, Copy, Debug)]
pub struct ClockFindings {
    /// Drift of the time offset, even if not significant.
    pub drift: Option<Drift>,
    /// A significant drift of the image clock, which was removed.
    pub drifted: Option<Drift>,
    /// The most likely clock step, even if not significant.
    pub step: Option<Step>,
    /// A significant clock step.
    pub stepped: Option<Step>,
    /// Noise factor of the residuals without that step.
    pub noise_factor_without_step: Option<f64>,
}

/// The recorded streams.
#[derive(Clone, Debug)]
pub struct Streams {
    /// Robot stamps.
    pub robot: StampReport,
    /// Image stamps.
    pub images: StampReport,
    /// Rows of the robot stream.
    pub robot_rows: usize,
    /// Features of the recording, without repeated rows of an image.
    pub features: usize,
    /// Noise of a recorded robot position, per axis, measured on the stream, m.
    pub robot_noise_m: f64,
    /// Robot samples that only repeat the previous pose. They were removed.
    pub robot_poses_repeated: usize,
    /// Whether the robot's poses were smoothed by a local fit.
    pub robot_smoothed: bool,
    /// Recorded stamp of the time origin: the first robot sample, ns.
    pub origin_ns: i64,
    /// Shift subtracted from the image stamps before the estimate, s. 0 without a shift.
    pub images_ahead_s: f64,
}

impl Streams {
    /// A time since the start, as it appears in the files, s.
    #[must_use]
    pub fn stamp_s(&self, since_start_s: f64) -> f64 {
        self.origin_ns as f64 * 1e-9 + since_start_s
    }
}
