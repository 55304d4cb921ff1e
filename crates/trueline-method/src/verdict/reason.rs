//! Reasons against a calibration.

use super::quantity::{MS_PER_S, Quantity, Significant};
use super::reason_words::{
    at_stops, bent_stripes, clock_step, coarse_robot_stamps, curve_collapsed, drawn_line_off, held_off,
    line_of_outliers, other_time_offset, part_moved, requirement_missed, residuals_too_large,
    robot_stream_froze, seam_error_too_large, stripes_contradict, too_few_used, too_many_outliers,
    worse_minimum, wrong_time_offset,
};
use super::sensor_words::contradicted_sensor;
use super::stream_name::StreamName;
use crate::assess::confounded_causes::ConfoundedCause;
use crate::assess::drawn_line_shift::DrawnLineShift;
use crate::assess::held_off::HeldOff;
use crate::assess::observability::Unobservable;
use crate::assess::outliers::Outliers;
use crate::assess::seam_error::Largest;
use crate::assess::sensor_shape::SensorShape;
use crate::hypotheses::choice::Statement;
use crate::input::skip::Skip;
use crate::stripe::outcome::{Apart, Because};
use std::fmt;
use trueline_lsq::Termination;

/// One of several answers that a scan cannot separate.
#[derive(Clone, Debug, PartialEq)]
pub struct Answer {
    /// Its time offset, s.
    pub time_offset_s: f64,
    /// Statements about the cell, each of which would select it.
    pub statements: Vec<Statement>,
}

/// One reason against a calibration. Times are those of the recording's files, s.
#[derive(Clone, Debug, PartialEq)]
pub enum Reason {
    /// The scan does not show an unknown.
    Unobservable(Unobservable),
    /// The robot stands still at each reading, without --at-stops.
    AtStops {
        /// Number of stops.
        stops: usize,
    },
    /// Two mirrored attitudes of the sensor fit equally well.
    MirrorAmbiguity,
    /// The likelihood hardly changes when the sensor is rotated by more than its uncertainty, so the uncertainty has no bound.
    UndeterminedTurn,
    /// From the guess the solver ended in a worse minimum than that found without it.
    WorseMinimum {
        /// Time offset of the better one, s.
        better_time_offset_s: f64,
    },
    /// From the guess the solver ended at a time offset that explains the scan worse than another.
    WrongTimeOffset {
        /// Estimated time offset, s.
        time_offset_s: f64,
        /// Time offset that explains the scan better, s.
        better_time_offset_s: f64,
        /// Share of the features that this one explains.
        explains: f64,
        /// Share of the features that the better one explains.
        better_explains: f64,
    },
    /// A curve whose length changed during its fit: the scan does not determine its size and the correlated lever arm.
    CurveCollapsed {
        /// Its length, m.
        length_m: f64,
        /// Its length before, m.
        before_m: f64,
    },
    /// The passes over a seam see it at different places: the part moved between them.
    PartMoved {
        /// Largest distance from its place in the first pass, m.
        shift_m: f64,
    },
    /// Seam points over a curve that the stripes of the same frames do not confirm.
    BentStripes {
        /// Why the stripes are not used.
        because: Because,
    },
    /// Several answers explain the scan equally well, because its path repeats itself.
    AmbiguousTimeOffset {
        /// The answers, the one given first.
        answers: Vec<Answer>,
        /// Duration of the scan, s.
        lasts_s: f64,
    },
    /// The answer contradicts a statement about the cell.
    StatementContradicted,
    /// The solver did not converge.
    NotConverged {
        /// Reason for the end.
        termination: Termination,
    },
    /// Residuals are larger than noise explains.
    ResidualsTooLarge {
        /// Noise factor.
        noise_factor: f64,
        /// Whether time offset or hand-eye were held and may be wrong.
        is_held: bool,
        /// Number of stops, if so few may be the cause.
        few_stops: Option<usize>,
    },
    /// Too few of the measurements could be used.
    TooFewUsed {
        /// Number of usable features.
        used: usize,
        /// Total number.
        features: usize,
        /// Reason that most of the others were not.
        mostly: Skip,
        /// Their number.
        mostly_count: usize,
    },
    /// The sensor's own calibration is off, and it was held.
    SensorOff {
        /// Its estimated shape.
        shape: Box<SensorShape>,
        /// Alternative causes.
        instead: Vec<ConfoundedCause>,
        /// Whether it was estimated with its file's uncertainty. Else it was held.
        beyond_stated: bool,
    },
    /// A held quantity (--fix) is wrong.
    HeldOff {
        /// What, and how far.
        off: HeldOff,
    },
    /// A line was held where it was drawn, and is not there.
    DrawnLineOff {
        /// The line and its shift.
        shift: DrawnLineShift,
    },
    /// Robot stamps repeat too often to time the poses.
    CoarseRobotStamps {
        /// Rows that repeat the stamp of the row before.
        repeated: usize,
        /// Total number.
        rows: usize,
    },
    /// The whole stripes and the seam points contradict each other.
    StripesContradict {
        /// Distance of both answers, σ.
        sigmas: f64,
        /// The same in time and place.
        apart: Apart,
    },
    /// Most features are outliers.
    TooManyOutliers {
        /// Their number, and the total.
        outliers: Outliers,
    },
    /// Most features of one of several lines are outliers, so the line is undetermined.
    LineOfOutliers {
        /// The line.
        line: u32,
        /// Their number, and the total.
        outliers: Outliers,
    },
    /// In a stretch of the scan another time offset holds.
    OtherTimeOffset {
        /// First and last stamp, s.
        span_s: [f64; 2],
        /// Additional delay of images there, s.
        step_s: f64,
        /// The stream whose clock stepped, where its stamps have a gap as long as the step.
        clock: Option<StreamName>,
    },
    /// The recorded pose stood still while the seam moved in the images.
    RobotStreamFroze {
        /// First and last stamp, s.
        span_s: [f64; 2],
    },
    /// One of the clocks stepped.
    ClockStep {
        /// When, s.
        at_s: f64,
        /// Change of the time offset, s.
        step_s: f64,
        /// Its standard deviation, s.
        sigma_s: f64,
        /// The number of images in that change, if it is a whole number.
        pictures: Option<u32>,
    },
    /// The error of a seam point is too large.
    SeamErrorTooLarge {
        /// Standard deviation of a later seam point, m.
        rms_m: f64,
        /// Its limit, m.
        ceiling_m: f64,
        /// Largest contribution.
        mostly: Largest,
        /// The unit direction in the tool in which it is largest, and its size there, m.
        weakest: Option<([f64; 3], f64)>,
    },
    /// A required accuracy is missed.
    RequirementMissed {
        /// The quantity.
        quantity: Quantity,
        /// Its standard deviation (largest of the axes) in the quantity's SI unit.
        sigma_si: f64,
        /// Required accuracy, in the same unit.
        required_si: f64,
    },
    /// An accuracy was required for an unobservable quantity.
    RequirementUnobservable {
        /// The quantity.
        quantity: Quantity,
        /// Required accuracy, in the quantity's SI unit.
        required_si: f64,
    },
}

impl Reason {
    /// A stable code.
    #[must_use]
    pub fn code(&self) -> &'static str {
        match self {
            Self::Unobservable(_) | Self::AtStops { .. } => "unobservable",
            Self::MirrorAmbiguity => "mirror-ambiguity",
            Self::UndeterminedTurn => "undetermined-turn",
            Self::WorseMinimum { .. } => "worse-minimum",
            Self::WrongTimeOffset { .. } => "wrong-time-offset",
            Self::CurveCollapsed { .. } => "curve-collapsed",
            Self::PartMoved { .. } => "part-moved",
            Self::BentStripes { .. } => "bent-stripes",
            Self::AmbiguousTimeOffset { .. } => "ambiguous-time-offset",
            Self::NotConverged { .. } => "not-converged",
            Self::ResidualsTooLarge { .. } => "residuals-too-large",
            Self::TooFewUsed { .. } => "too-few-used",
            Self::SensorOff { .. } => "sensor-off",
            Self::HeldOff { .. } => "held-off",
            Self::DrawnLineOff { .. } => "drawn-line-off",
            Self::CoarseRobotStamps { .. } => "coarse-robot-stamps",
            Self::StripesContradict { .. } => "stripes-contradict",
            Self::TooManyOutliers { .. } | Self::LineOfOutliers { .. } => "too-many-outliers",
            Self::OtherTimeOffset { .. } => "other-time-offset",
            Self::RobotStreamFroze { .. } => "robot-stream-froze",
            Self::ClockStep { .. } => "clock-step",
            Self::StatementContradicted => "statement-contradicted",
            Self::SeamErrorTooLarge { .. } => "seam-error-too-large",
            Self::RequirementMissed { .. } => "requirement-missed",
            Self::RequirementUnobservable { .. } => "requirement-unobservable",
        }
    }
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&match *self {
            Self::Unobservable(ref what) => what.to_string(),
            Self::AtStops { stops } => at_stops(stops),
            Self::MirrorAmbiguity => {
                "two mirrored attitudes of the sensor fit equally well. Tilt the torch by at least ±10°, or \
                 give an initial guess of the hand-eye transform"
                    .to_owned()
            }
            Self::UndeterminedTurn => {
                "the rotation about one axis is nearly unconstrained. Tilt the torch by ±10° or more, or \
                 change the stand-off more; fix the warnings first"
                    .to_owned()
            }
            Self::WorseMinimum { better_time_offset_s } => worse_minimum(better_time_offset_s),
            Self::WrongTimeOffset { time_offset_s, better_time_offset_s, explains, better_explains } => {
                wrong_time_offset([time_offset_s, better_time_offset_s], [explains, better_explains])
            }
            Self::CurveCollapsed { length_m, before_m } => curve_collapsed(length_m, before_m),
            Self::PartMoved { shift_m } => part_moved(shift_m),
            Self::BentStripes { because } => bent_stripes(because),
            Self::AmbiguousTimeOffset { ref answers, lasts_s } => ambiguous_time_offset(answers, lasts_s),
            Self::StatementContradicted => {
                "the answer contradicts your statement about the cell: the time offset is outside the \
                 window, or the sensor looks along another axis of the tool"
                    .to_owned()
            }
            Self::NotConverged { termination } => format!("the solver did not converge ({termination})"),
            Self::ResidualsTooLarge { noise_factor, is_held, few_stops } => {
                residuals_too_large(noise_factor, is_held, few_stops)
            }
            Self::SensorOff { ref shape, ref instead, beyond_stated } => {
                contradicted_sensor(shape, instead, beyond_stated)
            }
            Self::HeldOff { off } => held_off(&off),
            Self::DrawnLineOff { shift } => drawn_line_off(&shift),
            Self::TooFewUsed { used, features, mostly, mostly_count } => {
                too_few_used([used, features], mostly, mostly_count)
            }
            Self::CoarseRobotStamps { repeated, rows } => coarse_robot_stamps(repeated, rows),
            Self::StripesContradict { sigmas, ref apart } => stripes_contradict(sigmas, apart),
            Self::TooManyOutliers { outliers } => too_many_outliers(outliers),
            Self::LineOfOutliers { line, outliers } => line_of_outliers(line, outliers),
            Self::OtherTimeOffset { span_s, step_s, clock } => other_time_offset(span_s, step_s, clock),
            Self::RobotStreamFroze { span_s } => robot_stream_froze(span_s),
            Self::ClockStep { at_s, step_s, sigma_s, pictures } => {
                clock_step([at_s, step_s, sigma_s], pictures)
            }
            Self::SeamErrorTooLarge { rms_m, ceiling_m, mostly, weakest } => {
                seam_error_too_large([rms_m, ceiling_m], mostly, weakest)
            }
            Self::RequirementMissed { quantity, sigma_si, required_si } => {
                requirement_missed(quantity, sigma_si, required_si)
            }
            Self::RequirementUnobservable { quantity, required_si } => format!(
                "{quantity}: ± {} {} is required, but this scan cannot determine it",
                Significant(quantity.shown(required_si)),
                quantity.unit()
            ),
        })
    }
}

/// A shorter scan covers only some periods of a weave, s.
const SHORT_S: f64 = 8.0;

fn ambiguous_time_offset(answers: &[Answer], lasts_s: f64) -> String {
    let list: Vec<String> = answers.iter().map(answer).collect();
    if answers.iter().all(|answer| answer.time_offset_s == 0.0) {
        // At stops there is no time offset.
        return format!(
            "{} attitudes of the sensor explain the readings equally well. Give an initial guess, or tilt \
            the tool by ±15° or more about two axes",
            list.len()
        );
    }
    let (because, instead) = if lasts_s < SHORT_S {
        let because = format!("it lasts only {lasts_s:.1} s, or its path repeats itself");
        (because, "scan for 20 s, with frequencies that have no common multiple")
    } else {
        ("the path repeats itself".to_owned(), "scan with frequencies that have no common multiple")
    };
    format!(
        "{} answers explain the scan equally well, because {because}: {}. State what you know about the \
         cell, give an initial guess, or {instead}",
        list.len(),
        list.join("; ")
    )
}

fn answer(answer: &Answer) -> String {
    let offset = format!("time offset {:.1} ms", answer.time_offset_s * MS_PER_S);
    let statements: Vec<String> = answer.statements.iter().map(ToString::to_string).collect();
    if statements.is_empty() { offset } else { format!("{offset} ({})", statements.join(" or ")) }
}
