//! The plan: a motion within all limits, its prediction and its use of the limits.

use crate::constraints::{Constraint, Constraints};
use crate::criterion::Goal;
use crate::joint::NoJoint;
use crate::motion::Motion;
pub use crate::motion::PATH_PERIOD_S;
use crate::mounted_arm::JointPath;
use crate::prediction::Prediction;
use crate::robustness_to_guess::{Loss, SeenBy};
use crate::seam_goal::SeamGoal;
use crate::shape::Shape;
use crate::target::Target;
use nalgebra::DVector;
use trueline_dataset::RobotSample;
use trueline_geometry::Pose;
use trueline_method::Measurements;

/// Request of a plan.
#[derive(Clone, Debug)]
pub struct PlanRequest {
    /// Duration of the scan, s.
    pub duration_s: f64,
    /// Its goal.
    pub goal: Goal,
    /// The required seam error, if any: paths are then compared by it.
    pub seam: Option<SeamGoal>,
    /// The measurements of the calibration: whole stripes need a cell with named plates.
    pub measurements: Measurements,
    /// Shapes that may be used; the best wins.
    pub shapes: Vec<Shape>,
    /// Seed of the search: the same gives the same plan.
    pub seed: u64,
    /// Designs that are tried, times the number of shapes: a quarter to find out which valleys are deep, the rest for the deepest.
    pub evaluations: usize,
    /// Threads that search shapes side by side; the plan does not depend on it.
    pub threads: usize,
}

impl Default for PlanRequest {
    fn default() -> Self {
        Self {
            duration_s: 20.0,
            goal: Goal::default(),
            seam: None,
            measurements: Measurements::Seam,
            shapes: Shape::ALL.to_vec(),
            seed: 1,
            evaluations: 8_000,
            threads: 1,
        }
    }
}

/// Weight of the noise sigmas beside a required seam error: of two paths with about the same seam error, the one with the smaller
/// sigmas is better.
const TIE_BREAK: f64 = 0.04;

impl PlanRequest {
    /// Score of a path by the ratio of its seam error to the required one, and by its sigmas. Required sigmas count as
    /// much as the seam error.
    #[must_use]
    pub(crate) fn seam_score(&self, of_wanted: f64, by_sigmas: f64) -> f64 {
        let worst = if self.goal == Goal::default() { of_wanted } else { of_wanted.max(by_sigmas) };
        worst * (1.0 + TIE_BREAK * by_sigmas)
    }
}

/// A planned scan.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The motion.
    pub motion: Motion,
    /// Measurements of its prediction.
    pub target: Target,
    /// Its prediction at the guess. Each frame counts as often as wrong cells see it.
    pub prediction: Prediction,
    /// Its use of the limits, at the robot's own rate.
    pub constraints: Constraints,
    /// Frames lost in cells with a wrong guess.
    pub loss: Loss,
    /// Angles of the arm's joints at each pose of the path; `None` without an arm.
    pub joints: Option<JointPath>,
    /// Share of those cells that see each frame.
    pub seen_by: Vec<SeenBy>,
    /// Its score: see [`Goal::score`]. With a required seam error, the ratio to it.
    pub score: f64,
    /// The motion's point in the unit box.
    pub(crate) point: DVector<f64>,
}

impl Plan {
    /// Whether all counting requirements of a goal are met.
    #[must_use]
    pub fn reaches(&self, goal: &Goal) -> bool {
        goal.missed_by(&self.prediction.covariance) <= 1.0
    }

    /// The poses to send, one every [`PATH_PERIOD_S`].
    #[must_use]
    pub fn path(&self) -> Vec<Pose> {
        self.motion.sampled(PATH_PERIOD_S)
    }

    /// The same with their times, from zero.
    #[must_use]
    pub fn samples(&self) -> Vec<RobotSample> {
        let sample = |(k, base_from_tool)| RobotSample {
            stamp_ns: (k as f64 * PATH_PERIOD_S * 1e9).round() as i64,
            device_ns: None,
            base_from_tool,
        };
        self.path().into_iter().enumerate().map(sample).collect()
    }
}

/// Why there is no plan.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PlanError {
    /// The seam has no length.
    #[error("the seam's two ends are one point")]
    NoSeam,
    /// Whole stripes are required, but their plates are not known.
    #[error(transparent)]
    NoJoint(#[from] NoJoint),
    /// No motion keeps to the limits.
    #[error(
        "no scan of {duration_s} s keeps all limits: the best one found needs {percent:.0} % of the limit \
            for {name}",
        percent = 100.0 * used, name = constraint.name()
    )]
    NoRoom {
        /// Its duration, s.
        duration_s: f64,
        /// The limit that prevents it.
        constraint: Constraint,
        /// Fraction of it that would be used.
        used: f64,
    },
    /// At no stand-off that is allowed the sensor sees a seam in the middle of its stripe.
    #[error(
        "the seam is out of the field of view at all stand-offs from {:.0} to {:.0} mm{}",
        1e3 * allowed_m[0], 1e3 * allowed_m[1], where_seen(*seen_m)
    )]
    Blind {
        /// Stand-offs that are allowed, m.
        allowed_m: [f64; 2],
        /// Stand-offs with the seam in view, m; `None` if there are none.
        seen_m: Option<[f64; 2]>,
    },
    /// All motions within the limits leave something unseen.
    #[error(
        "within these limits a scan of {duration_s} s determines {rank} of {of} unknowns{}",
        named(hidden)
    )]
    NotShown {
        /// Its duration, s.
        duration_s: f64,
        /// Directions shown.
        rank: usize,
        /// Total number.
        of: usize,
        /// Hidden links of a cell with external axes, and the motion that determines each.
        hidden: Vec<String>,
    },
    /// The arm cannot bring the sensor over the seam.
    #[error("the arm does not reach {}", if *middle { "the middle of the seam" } else { "both ends of the \
        seam in one configuration, within its joint limits and without a wrist singularity" })]
    OutOfReach {
        /// Not even to the middle of the seam.
        middle: bool,
    },
    /// A duration that no scan has.
    #[error("a scan must take {least_s} to {most_s} s; {duration_s} s were requested")]
    Duration {
        /// The requested duration, s.
        duration_s: f64,
        /// The shortest, s.
        least_s: f64,
        /// The longest, s.
        most_s: f64,
    },
}

fn named(hidden: &[String]) -> String {
    if hidden.is_empty() { String::new() } else { format!(". Hidden: {}", hidden.join("; ")) }
}

fn where_seen(seen_m: Option<[f64; 2]>) -> String {
    let at = |[near, far]: [f64; 2]| format!(": it is in view from {:.0} to {:.0} mm", near * 1e3, far * 1e3);
    seen_m.map_or_else(|| ", and at all others".to_owned(), at)
}

impl PlanError {
    /// Hint for the user.
    #[must_use]
    pub fn hint(&self) -> &'static str {
        match self {
            Self::NoSeam => "give the points where the scan begins and ends",
            Self::NoJoint(why) => why.hint(),
            Self::NoRoom { constraint: Constraint::View, .. } => {
                "measure the guess better and lower [guess_error]: 95 % of the cells that it allows must see the seam in 95 % of \
                 the frames. Where the view widens with the distance, a larger stand_off_mm helps"
            }
            Self::Blind { seen_m: Some(_), .. } => {
                "set limits.stand_off_mm to distances within the sensor's range; the stand-off is measured \
                    along the camera's axis"
            }
            Self::Blind { seen_m: None, .. } => {
                "check that laser plane, picture size and view.margin_px belong to this sensor"
            }
            Self::NoRoom { constraint: Constraint::SeamEnds, .. } => {
                "the seam is too short for the stated error of the guess: use a longer one, or measure the \
                 guess better and lower [guess_error]"
            }
            Self::NoRoom { constraint: Constraint::Workspace, .. } => {
                "check that the box is in base and contains the tool's origin, not the seam"
            }
            Self::NoRoom { constraint: Constraint::Clearance, .. } => {
                "a sphere comes nearer to a plate than limits.clearance_mm: check at_mm and normal, or use a \
                    larger stand-off"
            }
            Self::NoRoom {
                constraint: Constraint::Reach | Constraint::JointRange | Constraint::Wrist,
                ..
            } => {
                "another configuration ([arm] near_deg), other limits of tilts and stand-off, or a shorter seam"
            }
            Self::OutOfReach { .. } => {
                "check base_from_arm and flange_from_tool, and that the sensor looks along [attitude]"
            }
            Self::NoRoom { .. } => "use a longer duration or higher limits",
            Self::NotShown { .. } => {
                "allow tilts about two axes; a better guess with a lower [guess_error] leaves more of the \
                    view for the sweep"
            }
            Self::Duration { .. } => "20 s are sufficient in most cells",
        }
    }
}

/// Durations that are planned, s.
pub const DURATION_S: [f64; 2] = [2.0, 600.0];
