//! Everything that was found of a scan, before it is judged.

use crate::adjustment::answer::Amplitudes;
use crate::assess::corrected_sensor::CorrectedSensor;
use crate::assess::correlated_noise::Structure;
use crate::assess::cross_validation::HeldOut;
use crate::assess::drawn_line_shift::DrawnLineShift;
use crate::assess::file_frame::{FileFrame, HandEyeOfFile, StatedSensor};
use crate::assess::instead_of_sensor::InsteadOfSensor;
use crate::assess::lens::LensCorrection;
use crate::assess::misfit_cause::MisfitCause;
use crate::assess::observability::Observability;
use crate::assess::outlier_segments::OutlierSegment;
use crate::assess::outliers::Outliers;
use crate::assess::residuals::{FeatureResidual, ResidualSummary};
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
use crate::models::tried::ModelTried;
use crate::problem::parameters::{Parameters, TIME_OFFSET};
use crate::solve::iteration_record::IterationRecord;
use crate::stripe::outcome::{StripeEstimate, StripeOutcome};
use nalgebra::DMatrix;
use std::collections::BTreeMap;
use trueline_dataset::result_file::SensorFileEntry;
use trueline_lsq::Termination;

/// Everything that was found.
#[derive(Clone, Debug)]
pub struct Findings {
    /// The unknowns, and what the scan shows of them.
    pub unknowns: Unknowns,
    /// How the model fits.
    pub fit: FitFindings,
    /// Checks of the estimate.
    pub checks: Checks,
    /// Whether one time offset holds for the whole scan.
    pub clock: ClockFindings,
    /// The streams that were recorded.
    pub streams: Streams,
    /// Answer of the whole stripes; `None` if there are none, or only seam points were requested.
    pub stripes: Option<StripeOutcome>,
    /// The curve, where that is the answer and there is no line.
    pub curve: Option<CurveEstimate>,
    /// Why a curve was not tried where the answer of a line is refused by its structure; `None` where it was, or need not be.
    pub curve_untried: Option<&'static str>,
    /// What was asked for that has no part in the answer of a curve.
    pub unused_on_curve: Vec<&'static str>,
    /// The external axes, in the order of the cell.
    pub axes: Vec<AxisFinding>,
    /// Whether the recording states how well the sensor is known, which the ± do not contain.
    pub uncertainty_ignored: bool,
    /// Whether the robot stood still at each reading, and the source of that; `None` if it moves.
    pub stops: Option<Stops>,
    /// Whether the sensor was held because its file was written from this scan.
    pub sensor_of_its_own_scan: bool,
    /// SHA-256 of the inputs.
    pub inputs: BTreeMap<String, String>,
    /// The options it was made with.
    pub config: Config,
    /// The models that were fitted, that of the answer first.
    pub models_tried: Vec<ModelTried>,
}

impl Findings {
    /// The length that counts as a pixel, m, where features are lengths; `None` where they are pixels.
    #[must_use]
    pub fn length_per_px_m(&self) -> Option<f64> {
        self.fit.residuals.rms_px.is_none().then(|| self.config.length_per_px_m())
    }

    /// Outliers among the measurements: of the seam points, or of the stripes if those were used and more of them
    /// are off.
    #[must_use]
    pub(crate) fn outliers(&self) -> Outliers {
        let ResidualSummary { outliers, used, .. } = self.fit.residuals;
        let of_seam = Outliers { count: outliers, of: used };
        let of_stripes = self.used_stripes().map(|estimate| estimate.counts.outliers());
        of_stripes.filter(|stripes| stripes.share() > of_seam.share()).unwrap_or(of_seam)
    }

    /// Noise factor of the stripes, if the answer was computed from them.
    #[must_use]
    pub(crate) fn stripe_noise_factor(&self) -> Option<f64> {
        self.used_stripes().map(|estimate| estimate.noise_factor)
    }

    fn used_stripes(&self) -> Option<&StripeEstimate> {
        let used = self.stripes.as_ref().filter(|stripes| stripes.used != Measurements::Seam)?;
        used.estimate.as_deref()
    }
}

/// The unknowns, and what the scan shows of them.
#[derive(Clone, Debug)]
pub struct Unknowns {
    /// Where the solver ended; what is not observable is an arbitrary number.
    pub(crate) parameters: Parameters,
    /// Covariance of the tangent, SI units; likewise: noise, sensor, robot, form of the seam, bias of the features.
    pub(crate) covariance: DMatrix<f64>,
    /// The random part of it: noise of features, robot and stamps.
    pub(crate) noise_covariance: DMatrix<f64>,
    /// The shape of the sensor's sheet; `None` where it was held.
    pub sensor: Option<SensorShape>,
    /// The sensor as the scan corrects it; likewise.
    pub corrected: Option<CorrectedSensor>,
    /// The sensor as its file states it; likewise, and where the scan does not show the whole hand-eye transform.
    pub stated: Option<StatedSensor>,
    /// The corrected sensor's file, where it was written and the hand-eye transform is that of it.
    pub written: Option<SensorFileEntry>,
    /// The hand-eye transform of the file that the result names, with the covariances that go with it.
    pub(crate) of_file: HandEyeOfFile,
    /// Whether a component of the tangent was estimated, not held.
    pub estimated: Vec<bool>,
    /// Observability of the scan.
    pub observability: Observability,
    /// Whether what it does not show was held at the initial guess, as the user allowed.
    pub held_at_guess: bool,
    /// Whether there is a time offset at all: a robot that stands at each reading has none.
    pub has_time_offset: bool,
}

impl Unknowns {
    /// Standard deviation of a component of the tangent, SI; `None` if it was held or is not observable.
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

    /// Covariance of two components of the tangent, SI; `None` if one was held or is not observable.
    #[must_use]
    pub fn covariance(&self, row: usize, column: usize) -> Option<f64> {
        let known = |k: usize| self.estimated[k] && self.observability.observable_components[k];
        (known(row) && known(column)).then(|| self.of_file.covariance[(row, column)])
    }

    /// The bow of a line along its two cross axes, with one standard deviation of each, m at the ends of what was visible;
    /// `None` if it was taken as straight or is not observable.
    #[must_use]
    pub fn bow(&self, line: usize) -> Option<[(f64, f64); 2]> {
        let curvature = self.parameters.curvatures.get(line)?;
        let first = self.parameters.unknowns().bow(line).start;
        Some([(curvature.bow_m[0], self.sigma(first)?), (curvature.bow_m[1], self.sigma(first + 1)?)])
    }

    /// The same where no feature could be used: then none of them means anything.
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

    /// The frame of the result's sensor file by another answer to the same scan.
    pub(crate) fn file_frame_by(&self, other: &Parameters) -> FileFrame {
        self.stated.as_ref().map_or(self.of_file.frame, |stated| stated.frame_by(other))
    }

    /// Whether the value of a component means anything: it was held, or it is observable.
    #[must_use]
    pub fn is_known(&self, component: usize) -> bool {
        let exists = component != TIME_OFFSET || self.has_time_offset;
        exists && (self.held_at_guess || self.observability.observable_components[component])
    }
}

/// How the model fits.
#[derive(Clone, Debug)]
pub struct FitFindings {
    /// Residual figures.
    pub residuals: ResidualSummary,
    /// Every feature's residual.
    pub features: Vec<FeatureResidual>,
    /// Recorded stamp of each of `features`, ns.
    pub feature_stamps_ns: Vec<i64>,
    /// Noise factor: residuals divided by the expected noise.
    pub noise_factor: f64,
    /// Whether they are alike from one to the next.
    pub structure: Structure,
    /// Estimated systematic errors, if the answer was adjusted with them.
    pub amplitudes: Option<Amplitudes>,
    /// Factor by which the ± of the least certain rotation exceeds that from the curvature at the optimum; `None` where they agree.
    pub widened_by: Option<f64>,
    /// Part of the covariance that is the model's, 0 to 1.
    pub covariance_model_share: f64,
    /// Why the solver ended.
    pub termination: Termination,
    /// Every step of the solver on all features.
    pub iterations: Vec<IterationRecord>,
    /// RMS of the points about the laser plane that was fitted to them, m.
    pub sheet_fit_rms_m: Option<f64>,
}

/// Checks of the estimate.
#[derive(Clone, Debug)]
pub struct Checks {
    /// Whether a mirrored attitude of the sensor fits as well.
    pub mirrored: Mirrored,
    /// Rival solutions, and the decision between them.
    pub ambiguity: Ambiguity,
    /// A better minimum than the guess led to.
    pub better: Option<BetterMinimum>,
    /// The parts of the scan against each other.
    pub held_out: Option<HeldOut>,
    /// Stretches of the scan that do not belong to the rest.
    pub outlier_segments: Vec<OutlierSegment>,
    /// Predicted error of a later seam point; `None` if the hand-eye transform is not fully observable.
    pub seam_error: Option<SeamError>,
    /// Estimated shape of a sensor that was held fixed; `None` if it was estimated, or cannot be.
    pub held_sensor: Option<SensorShape>,
    /// Causes that the scan cannot separate from a sensor that is off, where it seems so.
    pub instead_of_sensor: Vec<InsteadOfSensor>,
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
    /// The bias of the features with the tilt, where it was estimated and taken out.
    pub feature_bias: Option<FeatureBias>,
    /// Error of a seam point where it is used; `None` if something of the hand-eye is not observable.
    pub seam_point_error: Option<SeamPointError>,
}

impl Checks {
    /// Whether the scan contradicts a sensor or a line that was held: then the residuals, and all that follows from them, are
    /// those of that error.
    #[must_use]
    pub(crate) fn contradict_what_is_held(&self) -> bool {
        !self.drawn_line_shifts.is_empty() || self.held_sensor.is_some_and(|shape| shape.is_off())
    }
}

/// Whether one time offset holds for the whole scan.
#[derive(Clone, Copy, Debug)]
pub struct ClockFindings {
    /// Drift of the time offset, even if it is not significant.
    pub drift: Option<Drift>,
    /// A drift of the image clock that was significant and has been taken out.
    pub drifted: Option<Drift>,
    /// The most likely step of a clock, even if it is not significant.
    pub step: Option<Step>,
    /// A step of a clock that is significant.
    pub stepped: Option<Step>,
    /// Noise factor of the residuals without that step.
    pub noise_factor_without_step: Option<f64>,
}

/// The streams that were recorded.
#[derive(Clone, Debug)]
pub struct Streams {
    /// Robot stamps.
    pub robot: StampReport,
    /// Image stamps.
    pub images: StampReport,
    /// Rows of the robot stream.
    pub robot_rows: usize,
    /// Features of the recording, without rows that repeat another of their image.
    pub features: usize,
    /// Noise of a recorded robot position, per axis, as measured on the stream, m.
    pub robot_noise_m: f64,
    /// Robot samples that only repeat the pose before, and were left out.
    pub robot_poses_repeated: usize,
    /// Whether the robot's poses were replaced by a local fit.
    pub robot_smoothed: bool,
    /// Recorded stamp of time 0 of all stamps in seconds: the first robot sample, ns.
    pub origin_ns: i64,
    /// Shift subtracted from the image stamps before the estimate, s; 0 without a shift.
    pub images_ahead_s: f64,
}

impl Streams {
    /// A time since the start as it stands in the files, s.
    #[must_use]
    pub fn stamp_s(&self, since_start_s: f64) -> f64 {
        self.origin_ns as f64 * 1e-9 + since_start_s
    }
}
