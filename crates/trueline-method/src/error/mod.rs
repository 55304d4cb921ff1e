//! Errors without any calibration.

pub mod cad_problem;
pub mod no_plates;
pub mod noise_unused;

use crate::error::cad_problem::CadProblem;
use crate::error::no_plates::NoPlates;
use crate::error::noise_unused::NoiseUnused;
use trueline_dataset::Carries;
use trueline_dataset::picture_rows::PicturesDisagree;
use trueline_dataset::unit::MM_PER_M;
use trueline_geometry::trajectory::TrajectoryError;

/// A wrong statement about an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AxisMistake {
    /// It carries something else.
    Carries(Carries),
    /// Its values are radians and were read as degrees.
    ValuesInRadians,
    /// Its values are degrees and were read as radians.
    ValuesInDegrees,
}

impl AxisMistake {
    fn explains(self) -> &'static str {
        match self {
            Self::Carries(Carries::Part) => "; with carries = \"part\" it would fit",
            Self::Carries(Carries::Robot) => "; with carries = \"robot\" it would fit",
            Self::Carries(Carries::Sensor) => "; with carries = \"sensor\" it would fit",
            Self::ValuesInRadians => "; with its values in radians it would fit",
            Self::ValuesInDegrees => "; with its values in degrees it would fit",
        }
    }
}

/// A recording from which nothing can be estimated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The robot's poses are not a trajectory.
    #[error("the robot stream cannot be used: {0}")]
    Trajectory(TrajectoryError),
    /// A laser plane behind the camera.
    #[error("sensor.toml, [laser_plane]: {pixels} of {of} pixels see this plane behind the camera")]
    LaserPlaneBehind {
        /// Pixels that do.
        pixels: usize,
        /// Pixels that were looked at.
        of: usize,
    },
    /// A laser plane that passes through the camera.
    #[error(
        "sensor.toml, [laser_plane]: by this plane most seam points are nearer to the camera than {} mm",
        nearest_m * 1e3
    )]
    LaserPlaneInLens {
        /// No camera sees a seam nearer than this, m.
        nearest_m: f64,
    },
    /// Too few features for the unknowns.
    #[error("line {line}: {usable} usable features, at least {needed} are needed")]
    TooFewFeatures {
        /// The line.
        line: u32,
        /// Features that could be used.
        usable: usize,
        /// Required number.
        needed: usize,
    },
    /// Lines are not numbered from 0 without a gap.
    #[error(
        "line {line} has no feature, though line {highest} has some: lines are numbered from 0 without gaps"
    )]
    LineMissing {
        /// The empty line.
        line: u32,
        /// The highest line.
        highest: u32,
    },
    /// Axes in a place where they are not estimated.
    #[error("external axes cannot be calibrated {why}")]
    AxesNotThere {
        /// The place.
        why: &'static str,
    },
    /// Several axes of unknown position.
    #[error("the positions of several axes are unknown: {names}")]
    AxesNeedGuess {
        /// Their names.
        names: String,
    },
    /// A moving axis of unknown position.
    #[error("axis `{name}` moves, and its position is unknown")]
    AxisUnknown {
        /// Its name.
        name: String,
    },
    /// An axis without any position that explains the scan.
    #[error("no position of axis `{name}` explains the scan{}", instead.map_or("", AxisMistake::explains))]
    AxisNotFound {
        /// Its name.
        name: String,
        /// The mistake that explains it.
        instead: Option<AxisMistake>,
    },
    /// Points that do not define a laser plane.
    #[error("the points do not define a laser plane: they all lie on one line in the camera frame")]
    SheetUndefined,
    /// Points that do not lie in a plane.
    #[error(
        "the points do not lie in one laser plane: {:.2} mm RMS; use the point-to-line residual, or give the plane",
        rms_m * MM_PER_M
    )]
    PointsNotInSheet {
        /// RMS distance from the best plane, m.
        rms_m: f64,
    },
    /// Points off the plane of the sensor's file.
    #[error(
        "half of the points lie more than {:.2} mm off the laser plane of sensor.toml",
        median_m * MM_PER_M
    )]
    PointsOffStatedPlane {
        /// Median distance, m.
        median_m: f64,
    },
    /// The images and the robot do not overlap in time.
    #[error(
        "images and robot do not overlap in time: counted from the first pose, the robot lasts from {robot_start_s:.3} to \
         {robot_end_s:.3} s, the images from {image_start_s:.3} to {image_end_s:.3} s"
    )]
    NoOverlap {
        /// First robot stamp, s.
        robot_start_s: f64,
        /// Last robot stamp, s.
        robot_end_s: f64,
        /// First image stamp, s.
        image_start_s: f64,
        /// Last image stamp, s.
        image_end_s: f64,
    },
    /// Too few distinct image stamps.
    #[error("only {images} distinct image time stamp(s); at least {needed} are needed")]
    TooFewImages {
        /// Images with distinct stamps.
        images: usize,
        /// Required number.
        needed: usize,
    },
    /// Too few stops.
    #[error("there are readings at {stops} stop(s), and at least {needed} are needed")]
    TooFewStops {
        /// Stops with a reading.
        stops: usize,
        /// Required number.
        needed: usize,
    },
    /// Robot poses too far apart in time, so that the motion between them is unknown.
    #[error("the robot's poses are {period_s:.3} s apart; at most {most_s} s is allowed")]
    RobotTooSlow {
        /// Median time between poses, s.
        period_s: f64,
        /// Largest allowed time, s.
        most_s: f64,
    },
    /// The robot does not move.
    #[error("the robot does not move: all its poses are within {shift_mm:.3} mm and {turn_deg:.3}°")]
    RobotStandsStill {
        /// Largest shift, mm.
        shift_mm: f64,
        /// Largest turn, degrees.
        turn_deg: f64,
    },
    /// A reading at a stop without a pose.
    #[error("the reading at {stamp_s:.3} s has no robot pose")]
    NoPoseAtStop {
        /// Its stamp, s.
        stamp_s: f64,
    },
    /// A reading at a stop during which the robot moves.
    #[error(
        "the robot does not stand still at the reading at {stamp_s:.3} s: it moves by {shift_mm:.2} mm and \
        {turn_deg:.2}° within 0.3 s"
    )]
    MovesAtStop {
        /// Its stamp, s.
        stamp_s: f64,
        /// Its motion, mm.
        shift_mm: f64,
        /// Its rotation, degrees.
        turn_deg: f64,
    },
    /// A quantity is held without an initial value.
    #[error("`{held}` cannot be held fixed: there is no initial value for it")]
    NothingToHold {
        /// The quantity held fixed.
        held: &'static str,
    },
    /// A stated noise applies to no feature.
    #[error("{why}")]
    FeatureNoiseUnused {
        /// Reason.
        why: NoiseUnused,
    },
    /// A drawn line that the scan does not have.
    #[error("line {line} has a drawing, but the features name {lines} line(s)")]
    NoSuchLine {
        /// Its number.
        line: usize,
        /// Lines of the features.
        lines: usize,
    },
    /// Stripes do not support drawn lines.
    #[error("whole stripes cannot be used with a drawn line")]
    StripesOfDrawnLine,
    /// Stripes beside a curve that cannot be used.
    #[error("the stripes beside the curve cannot be used: {why}")]
    StripesBesideCurve {
        /// Reason.
        why: &'static str,
    },
    /// Partial acceptance needs a guess.
    #[error("--accept-partial needs an initial guess, but there is none")]
    NoGuessToHold,
    /// Every point lies beyond the ends of the reference.
    #[error(
        "all {points} seam points lie beyond the ends of the reference; the nearest is {nearest_mm:.1} mm from it"
    )]
    BeyondReference {
        /// Points that were placed.
        points: usize,
        /// Distance of the nearest, mm.
        nearest_mm: f64,
    },
    /// A seam without a reference.
    #[error("the features name {seams} lines, and the reference has {references}")]
    ReferenceMissing {
        /// Lines of the features.
        seams: usize,
        /// Number of references.
        references: usize,
    },
    /// Too few seam points for an evaluation.
    #[error("only {points} seam point(s) could be placed: too few to evaluate")]
    NothingToFit {
        /// Points that could be placed.
        points: usize,
    },
    /// Stripes were requested, and there are none.
    #[error("whole stripes cannot be used: the recording has none")]
    NoStripes,
    /// Stripes that do not determine two plates that meet.
    #[error("whole stripes cannot be used: {why}")]
    NoPlates {
        /// Reason.
        why: NoPlates,
    },
    /// Stripes without seam points, too few of which intersect.
    #[error(
        "there are no seam points, and only {crossings} frames have two stripes that cross; at least \
        {needed} are needed"
    )]
    NoCrossings {
        /// Number of frames in which they do.
        crossings: usize,
        /// Required number.
        needed: usize,
    },
    /// Two tables that count their frames differently.
    #[error(transparent)]
    PicturesDisagree(#[from] PicturesDisagree),
    /// The paper's residual does not support stripes.
    #[error("whole stripes cannot be used with the point-to-line residual")]
    StripesNeedSheet,
    /// Stripes do not support directions held at a guess.
    #[error("whole stripes cannot be used with --accept-partial")]
    StripesHeldAtGuess,
    /// A curve was requested.
    #[error("a curve cannot be fitted: {why}")]
    NoCurve {
        /// Reason that there is none.
        why: &'static str,
    },
    /// A drawing of the seam cannot be used.
    #[error(transparent)]
    Cad(#[from] CadProblem),
    /// No start led to a finite cost.
    #[error("the solver has no valid start: the line runs along the laser plane, or no feature is usable")]
    NoStart,
}

impl Error {
    /// Hint for the user.
    #[must_use]
    pub fn hint(&self) -> &'static str {
        match self {
            Self::Trajectory(_) => "was robot.csv recorded over the whole scan?",
            Self::LaserPlaneBehind { .. }
            | Self::LaserPlaneInLens { .. }
            | Self::SheetUndefined
            | Self::PointsNotInSheet { .. }
            | Self::PointsOffStatedPlane { .. } => self.hint_of_sheet(),
            Self::TooFewFeatures { .. } => "record a longer scan, or check why features were skipped",
            Self::LineMissing { .. } => "number the lines 0, 1, 2, … in the column `line`",
            Self::NoOverlap { .. } => "both streams must be stamped by the same clock, up to the time offset",
            Self::TooFewStops { .. } => "add stops, with the sensor tilted and turned differently at each",
            Self::TooFewImages { .. } => {
                "does the stamp advance from picture to picture, or from profile to profile?"
            }
            Self::RobotTooSlow { .. }
            | Self::NoPoseAtStop { .. }
            | Self::MovesAtStop { .. }
            | Self::RobotStandsStill { .. } => self.hint_of_poses(),
            Self::NoStripes => {
                "stripes.csv has them: `trueline features DATASET` writes it from pictures or profiles"
            }
            Self::NoCrossings { .. } => {
                "number the plates that meet in a seam 0 and 1; of a lap or of one plate the edge is the seam: give its points in features.csv"
            }
            Self::StripesNeedSheet => "use it with --residual sheet",
            Self::NoPlates { why } => why.hint(),
            Self::PicturesDisagree(pictures) => pictures.hint(),
            Self::StripesHeldAtGuess | Self::StripesOfDrawnLine => "use the seam points",
            Self::StripesBesideCurve { .. } => {
                "use the seam points (--use seam) only if they are not where straight lines through bent stripes meet"
            }
            Self::FeatureNoiseUnused { why: NoiseUnused::EachHasItsOwn } => {
                "change these, or remove their columns from features.csv"
            }
            Self::FeatureNoiseUnused { .. } => "state it in the unit of the features",
            Self::NoSuchLine { .. } => "lines are numbered from 0, as in the column `line`",
            Self::NoCurve { .. } => {
                "leave --target curve out for a straight seam; for a curve scan the whole of it two or three times, tilting by ±10° or more"
            }
            Self::AxesNotThere { .. }
            | Self::AxesNeedGuess { .. }
            | Self::AxisUnknown { .. }
            | Self::AxisNotFound { .. } => self.hint_of_axes(),
            Self::Cad(problem) => problem.hint(),
            Self::NothingToHold { .. } | Self::NoGuessToHold => "give an initial guess",
            Self::BeyondReference { .. } => {
                "are the reference's units and frame right? it is in the robot's base"
            }
            Self::ReferenceMissing { .. } => "give a [[lines]] for each line of the features, in their order",
            Self::NothingToFit { .. } => {
                "do images and robot overlap in time, with the calibration's time offset?"
            }
            Self::NoStart => {
                "does the laser stripe cross the line, are the frames of the poses right, and does robot.csv cover the features' time?"
            }
        }
    }

    fn hint_of_sheet(&self) -> &'static str {
        match self {
            Self::LaserPlaneBehind { .. } => {
                "the sign of `offset_mm` is probably wrong: n·p = offset in the camera frame, z forward, y down"
            }
            Self::LaserPlaneInLens { .. } => {
                "`offset_mm` is the distance of the plane from the camera's centre in mm: it is zero or in another unit here"
            }
            Self::SheetUndefined => {
                "give the laser plane in sensor.toml, or sweep the feature through the field of view"
            }
            Self::PointsNotInSheet { .. } => {
                "are all points measured by the same laser plane, in the camera frame?"
            }
            Self::PointsOffStatedPlane { .. } => {
                "correct its [laser_plane], or leave it out to fit it to the points"
            }
            _ => "",
        }
    }

    fn hint_of_poses(&self) -> &'static str {
        match self {
            Self::RobotTooSlow { .. } => {
                "check that time_s is in seconds, not ms or µs; otherwise record the robot's poses at 10 Hz \
                    or more. If the robot stands still at each reading, use --at-stops"
            }
            Self::NoPoseAtStop { .. } => {
                "record the robot while it stands, or write one pose a stop into poses.csv: stop,x_mm,y_mm,z_mm,qw,qx,qy,qz"
            }
            Self::MovesAtStop { .. } => {
                "wait until the robot stands still before a reading, or leave this reading out; for a moving \
                    robot leave --at-stops out"
            }
            Self::RobotStandsStill { .. } => {
                "record the scan while it moves; if it did, is the stream frozen, or of another robot?"
            }
            _ => "",
        }
    }

    fn hint_of_axes(&self) -> &'static str {
        match self {
            Self::AxesNotThere { .. } => {
                "leave `[[axis]]` out of cell.toml if the axis stands still throughout"
            }
            Self::AxesNeedGuess { .. } => {
                "give all but one a rough `direction` and `point_mm` in cell.toml, or scan while one of them moves at a time"
            }
            Self::AxisUnknown { .. } => "use a calibration of a scan in which this axis moved",
            Self::AxisNotFound { .. } => {
                "is `carries` right (part, robot, sensor), are degrees and mm right, and do the axis's stamps have the robot's clock?"
            }
            _ => "",
        }
    }
}
