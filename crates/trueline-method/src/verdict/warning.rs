//! Warnings about a calibration that can be used.

use super::quantity::{Axis, MM_PER_M, Quantity};
use super::sensor_words::sensor_off;
use super::stream_name::StreamName;
use super::warning_words::{
    CURVE_FROM_ONE_PASS, axis_not_shown, clock_drift, clock_step, coarse_stamps, curve_untried,
    decided_by_user, drawn_line_not_needed, feature_bias, held_at_guess, joint_lags, knots_near_weave,
    left_out, lens_off, likely_cause, many_outliers, misfit, moves, other_line, outlier_stretch,
    poorly_known, repeated_poses, repeated_robot_stamps, robot_moves, robot_samples_missing, robot_worse,
    stamp_steps, stripe_noise, stripes_disagree, stripes_stamped_apart, structured, unused_on_curve,
    unusual_noise, wavy_plates, wavy_seam, widened,
};
use crate::assess::cause_kind::CauseKind;
use crate::assess::confounded_causes::ConfoundedCause;
use crate::assess::lens::LensCorrection;
use crate::assess::observability::Unobservable;
use crate::assess::robot_field::RobotSigmas;
use crate::assess::sensor_shape::SensorShape;
use crate::axes::finding::AxisPart;
use crate::error::no_plates::NoPlates;
use crate::hypotheses::choice::DecidedBy;
use crate::hypotheses::feature_bias::FeatureBias;
use crate::input::skip::Skip;
use crate::stripe::outcome::Apart;
use std::collections::BTreeMap;
use std::fmt;

/// One warning. Times are those of the recording's files, s.
#[derive(Clone, Debug, PartialEq)]
pub enum Warning {
    /// Many features could not be used.
    FeaturesSkipped {
        /// Counts by reason.
        skipped: BTreeMap<Skip, usize>,
    },
    /// The scan alone cannot separate the answer from others: a guess or a statement decided.
    DecidedByUser {
        /// The decision's source.
        by: DecidedBy,
        /// Time offsets of the others, s.
        other_time_offsets_s: Vec<f64>,
    },
    /// The recording states an uncertainty of the sensor, but the paper's residual treats it as exact.
    UncertaintyNotApplied,
    /// The sensor's file was derived from this scan: the sensor is held fixed.
    SensorOfItsOwnScan,
    /// The sensor's own calibration is off; the result corrects it.
    SensorOff {
        /// Its estimated shape.
        shape: SensorShape,
        /// Alternative causes.
        instead: Vec<ConfoundedCause>,
    },
    /// The lens differs from the sensor's file.
    LensOff {
        /// Its correction.
        lens: LensCorrection,
    },
    /// The scan determines a line better than the drawing by which it was held.
    DrawnLineNotNeeded {
        /// Seam error with the drawing, m.
        with_m: f64,
        /// Seam error without the drawing, m.
        without_m: f64,
    },
    /// One usual cause explains nearly all of the systematic residuals.
    LikelyCause {
        /// Which.
        kind: CauseKind,
        /// Its size: s², m, s or px, depending on the kind.
        size_si: f64,
        /// Its standard deviation from noise.
        sigma_si: f64,
        /// The length that counts as a pixel, m, if features are lengths.
        per_px_m: Option<f64>,
    },
    /// The detector's point moves with the tilt; the result is corrected for it.
    FeatureBias {
        /// Its size.
        bias: FeatureBias,
        /// The length that counts as a pixel, m, if features are lengths.
        per_px_m: Option<f64>,
    },
    /// The mirrored attitude is excluded only if the sensor agrees with its file.
    MirrorBySensor,
    /// Undetermined unknowns were held at the initial guess, as the user allowed.
    HeldAtGuess {
        /// The quantities held fixed.
        held: Vec<Unobservable>,
    },
    /// Many stripes could not be used.
    StripesSkipped {
        /// Counts by reason.
        skipped: BTreeMap<Skip, usize>,
    },
    /// The stripes cannot be used.
    StripesUnused {
        /// Reason.
        why: NoPlates,
    },
    /// The two tables have different stamps for the same images.
    StripesStampedApart {
        /// Largest delay of the stripes' stamps, s.
        later_s: f64,
    },
    /// Whole stripes and seam points give different answers.
    StripesDisagree {
        /// Distance of both answers, σ.
        sigmas: f64,
        /// Distance of both answers in time and place.
        apart: Apart,
        /// Whether the stripes' answer is used nevertheless.
        used: bool,
    },
    /// The cost is not quadratic within the uncertainty, which was widened to the likelihood profile.
    WidenedByProfile {
        /// Factor for the least certain rotation.
        by: f64,
    },
    /// The residuals show larger robot errors than assumed.
    RobotWorse {
        /// Robot errors within the scan, estimated from the residuals.
        seems: RobotSigmas,
        /// Assumed errors.
        taken: RobotSigmas,
        /// Whether these were stated by the user.
        stated: bool,
    },
    /// A seam point has a large uncertainty from the scan alone.
    PoorlyKnown {
        /// Standard deviation of a seam point from the scan alone, m.
        scan_alone_m: f64,
        /// The same with the assumed errors of robot, sensor and bias, m.
        all_m: f64,
    },
    /// The stripes of the answer are noisier, or less noisy, than stated.
    StripeNoise {
        /// Noise factor.
        noise_factor: f64,
    },
    /// In a stretch of the scan nearly all features lie on another line.
    OtherLine {
        /// First and last stamp, s.
        span_s: [f64; 2],
        /// Features in it.
        features: usize,
        /// Distance from the seam, m.
        beside_m: f64,
    },
    /// In a stretch of the scan nearly all features are outliers.
    OutlierStretch {
        /// First and last stamp, s.
        span_s: [f64; 2],
        /// Features in it.
        features: usize,
    },
    /// The residuals are larger or smaller than the stated noise explains.
    UnusualNoise {
        /// Noise factor.
        noise_factor: f64,
        /// Whether a reported cause explains most of them.
        is_explained: bool,
        /// Whether the answer uses these seam points.
        of_answer: bool,
    },
    /// The residuals follow the motion and are not noise.
    StructuredResiduals {
        /// Correlation of neighbours after removal of correlated noise.
        left: f64,
    },
    /// The seam has a form beyond its bow.
    WavySeam {
        /// RMS over the scan, m.
        rms_m: f64,
    },
    /// The plates have a form beyond their bow and twist, and their stripes give the answer.
    WavyPlates {
        /// RMS over the scan, m.
        rms_m: f64,
    },
    /// The arm is off its reported poses along this scan.
    RobotMoves {
        /// RMS over the scan, m.
        rms_m: f64,
    },
    /// The joints of the arm follow the recorded poses by different times.
    JointLags {
        /// RMS over the scan, m.
        rms_m: f64,
    },
    /// One of the clocks stepped; the result is corrected for it.
    ClockStep {
        /// When, s.
        at_s: f64,
        /// Change of the time offset, s.
        step_s: f64,
    },
    /// Many features are outliers.
    ManyOutliers {
        /// Share of the features.
        share: f64,
    },
    /// The image clock drifts; the result is corrected for it.
    ClockDrift {
        /// Against the robot's clock, parts per million.
        ppm: f64,
        /// Its standard deviation, ppm.
        sigma_ppm: f64,
        /// Time at which the time offset holds, s.
        about_s: f64,
    },
    /// Many of the robot's samples are missing.
    RobotSamplesMissing {
        /// Number.
        missing: usize,
        /// Total number of clock ticks.
        of: usize,
    },
    /// Robot rows that repeat the previous pose were left out.
    RepeatedPoses {
        /// Number.
        repeated: usize,
        /// Total number.
        rows: usize,
    },
    /// Robot rows repeat the previous stamp.
    RepeatedRobotStamps {
        /// Number.
        repeated: usize,
    },
    /// Stamps are multiples of a coarse grain.
    CoarseStamps {
        /// The stream.
        stream: StreamName,
        /// The grain, s.
        grain_s: f64,
    },
    /// The stamps of a stream step.
    StampSteps {
        /// The stream.
        stream: StreamName,
        /// Time and height, s.
        steps: Vec<(f64, f64)>,
        /// Steps are known up to whole periods, s.
        period_s: f64,
    },
    /// The prediction of a part from the other parts is off.
    CrossValidationMisfit {
        /// RMS of the prediction, m.
        rms_m: f64,
        /// RMS of the fit, m.
        fitted_rms_m: f64,
    },
    /// Without a part of the scan the estimate changes by more than noise explains.
    CrossValidationShift {
        /// First and last stamp of the part, s.
        span_s: [f64; 2],
        /// The quantity with the largest change.
        quantity: Quantity,
        /// The axis of the tool. `None` for the time offset.
        axis: Option<Axis>,
        /// The change, in the quantity's SI unit.
        moved_si: f64,
        /// The change in standard deviations.
        sigmas: f64,
    },
    /// An unobservable part of an external axis.
    AxisNotShown {
        /// Name of the axis.
        name: String,
        /// The undetermined part.
        part: AxisPart,
        /// The motion that determines it.
        cure: &'static str,
    },
    /// No place of the curve was scanned twice.
    CurveFromOnePass,
    /// The curve needs knots that follow the weave.
    KnotsNearWeave {
        /// Distance of the knots, m.
        spacing_m: f64,
        /// Length of one weave period, m.
        weave_m: f64,
    },
    /// No straight line explains the scan, and a curve was not tried.
    CurveUntried {
        /// Reason.
        why: &'static str,
    },
    /// Options that do not apply to a curve.
    UnusedOnCurve {
        /// Their names.
        options: Vec<&'static str>,
    },
    /// The error at the torch is not predicted, because no point of the laser plane below the scan has that stand-off.
    NoPointAtStandOff {
        /// Stand-off, m.
        stand_off_m: f64,
    },
}

impl Warning {
    /// A stable code.
    #[must_use]
    pub fn code(&self) -> &'static str {
        match self {
            Self::FeaturesSkipped { .. } => "features-skipped",
            Self::DecidedByUser { .. } => "decided-by-user",
            Self::UncertaintyNotApplied => "uncertainty-not-applied",
            Self::SensorOfItsOwnScan => "sensor-of-its-own-scan",
            Self::SensorOff { .. } => "sensor-off",
            Self::LensOff { .. } => "lens-off",
            Self::DrawnLineNotNeeded { .. } => "drawn-line-not-needed",
            Self::LikelyCause { kind, .. } => kind.code(),
            Self::FeatureBias { .. } => "feature-bias",
            Self::MirrorBySensor => "mirror-by-sensor",
            Self::StripesSkipped { .. } => "stripes-skipped",
            Self::StripesUnused { .. } => "stripes-unused",
            Self::StripesStampedApart { .. } => "stripes-stamped-apart",
            Self::StripesDisagree { .. } => "stripes-disagree",
            Self::WidenedByProfile { .. } => "widened",
            Self::RobotWorse { .. } => "robot-inaccurate",
            Self::PoorlyKnown { .. } => "poorly-known",
            Self::StripeNoise { .. } => "stripe-noise",
            Self::HeldAtGuess { .. } => "held-at-guess",
            Self::OtherLine { .. } => "other-line",
            Self::OutlierStretch { .. } => "outlier-stretch",
            Self::UnusualNoise { .. } => "unusual-noise",
            Self::StructuredResiduals { .. } => "structured-residuals",
            Self::WavySeam { .. } => "wavy-seam",
            Self::WavyPlates { .. } => "wavy-plates",
            Self::RobotMoves { .. } => "robot-moves",
            Self::JointLags { .. } => "joint-lags",
            Self::ClockStep { .. } => "clock-step",
            Self::ManyOutliers { .. } => "many-outliers",
            Self::ClockDrift { .. } => "clock-drift",
            Self::RobotSamplesMissing { .. } => "robot-samples-missing",
            Self::RepeatedPoses { .. } => "repeated-poses",
            Self::RepeatedRobotStamps { .. } => "repeated-robot-stamps",
            Self::CoarseStamps { .. } => "coarse-stamps",
            Self::StampSteps { .. } => "stamp-steps",
            Self::AxisNotShown { .. } => "axis-not-shown",
            Self::CurveFromOnePass => "curve-from-one-pass",
            Self::KnotsNearWeave { .. } => "knots-near-weave",
            Self::CurveUntried { .. } => "curve-untried",
            Self::UnusedOnCurve { .. } => "unused-on-curve",
            Self::CrossValidationMisfit { .. } => "cross-validation-misfit",
            Self::CrossValidationShift { .. } => "cross-validation-shift",
            Self::NoPointAtStandOff { .. } => "no-point-at-stand-off",
        }
    }
}

const MIRROR_BY_SENSOR: &str = "a mirrored attitude of the sensor explains the scan equally well if the \
     sensor differs from its file by about 1 %. Tilt the torch further, or give an initial guess";

const SENSOR_OF_ITS_OWN_SCAN: &str = "sensor.toml was derived from this scan, so it is not counted again; the \
     sensor is held fixed, and the ± include its stated uncertainty";
const UNCERTAINTY_NOT_APPLIED: &str = "the ± do not include the stated uncertainty of the sensor: the \
     point-to-line residual assumes an exact sensor. Use --residual sheet";

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&match *self {
            Self::FeaturesSkipped { ref skipped } => left_out("features", skipped),
            Self::DecidedByUser { by, ref other_time_offsets_s } => decided_by_user(by, other_time_offsets_s),
            Self::SensorOfItsOwnScan => SENSOR_OF_ITS_OWN_SCAN.to_owned(),
            Self::UncertaintyNotApplied => UNCERTAINTY_NOT_APPLIED.to_owned(),
            Self::SensorOff { ref shape, ref instead } => sensor_off(shape, instead),
            Self::LensOff { ref lens } => lens_off(lens),
            Self::DrawnLineNotNeeded { with_m, without_m } => drawn_line_not_needed([with_m, without_m]),
            Self::LikelyCause { kind, size_si, sigma_si, per_px_m } => {
                likely_cause(kind, [size_si, sigma_si], per_px_m)
            }
            Self::FeatureBias { ref bias, per_px_m } => feature_bias(bias, per_px_m),
            Self::MirrorBySensor => MIRROR_BY_SENSOR.to_owned(),
            Self::StripesSkipped { ref skipped } => left_out("stripes", skipped),
            Self::StripesUnused { why } => format!("the stripes are not used: {why}; {}", why.hint()),
            Self::StripesStampedApart { later_s } => stripes_stamped_apart(later_s),
            Self::StripesDisagree { sigmas, apart, used } => stripes_disagree(sigmas, &apart, used),
            Self::WidenedByProfile { by } => widened(by),
            Self::RobotWorse { seems, taken, stated } => robot_worse(seems, taken, stated),
            Self::PoorlyKnown { scan_alone_m, all_m } => poorly_known(scan_alone_m, all_m),
            Self::StripeNoise { noise_factor } => stripe_noise(noise_factor),
            Self::HeldAtGuess { ref held } => held_at_guess(held),
            Self::OtherLine { span_s, features, beside_m } => other_line(span_s, features, beside_m),
            Self::OutlierStretch { span_s, features } => outlier_stretch(span_s, features),
            Self::UnusualNoise { noise_factor, is_explained, of_answer } => {
                unusual_noise(noise_factor, is_explained, of_answer)
            }
            Self::StructuredResiduals { left } => structured(left),
            Self::WavySeam { rms_m } => wavy_seam(rms_m),
            Self::WavyPlates { rms_m } => wavy_plates(rms_m),
            Self::RobotMoves { rms_m } => robot_moves(rms_m),
            Self::JointLags { rms_m } => joint_lags(rms_m),
            Self::ClockStep { at_s, step_s } => clock_step(at_s, step_s),
            Self::ManyOutliers { share } => many_outliers(share),
            Self::ClockDrift { ppm, sigma_ppm, about_s } => clock_drift(ppm, sigma_ppm, about_s),
            Self::RobotSamplesMissing { missing, of } => robot_samples_missing(missing, of),
            Self::RepeatedPoses { repeated, rows } => repeated_poses(repeated, rows),
            Self::RepeatedRobotStamps { repeated } => repeated_robot_stamps(repeated),
            Self::CoarseStamps { stream, grain_s } => coarse_stamps(stream, grain_s),
            Self::StampSteps { stream, ref steps, period_s } => stamp_steps(stream, steps, period_s),
            Self::AxisNotShown { ref name, part, cure } => axis_not_shown(name, part, cure),
            Self::CurveFromOnePass => CURVE_FROM_ONE_PASS.to_owned(),
            Self::KnotsNearWeave { spacing_m, weave_m } => knots_near_weave(spacing_m, weave_m),
            Self::CurveUntried { why } => curve_untried(why),
            Self::UnusedOnCurve { ref options } => unused_on_curve(options),
            Self::CrossValidationMisfit { rms_m, fitted_rms_m } => misfit(rms_m, fitted_rms_m),
            Self::CrossValidationShift { span_s: [from, to], quantity, axis, moved_si, sigmas } => format!(
                "the parts of the scan disagree: without {from:.2} to {to:.2} s {}, {sigmas:.1} times more \
                 than noise explains",
                moves(quantity, axis, moved_si)
            ),
            Self::NoPointAtStandOff { stand_off_m } => format!(
                "no seam error is predicted: no point of the laser plane in the scanned range is {:.0} mm \
                 from the sensor. Correct --stand-off-mm",
                stand_off_m * MM_PER_M
            ),
        })
    }
}
