//! Phases of a scan, the operator's commands, and how a scan can end.

use super::path_timing::PathState;
use std::fmt;
use trueline_geometry::Pose;

/// Commands of the operator.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum OperatorCommand {
    /// Go on.
    Go,
    /// Stop along the path, then hold.
    Stop,
    /// Send one final hold command, then stop sending.
    Silence,
}

/// Longest time between messages of a robot that is guided, s: a reference is a step of that length.
pub(crate) const SLOWEST_S: f64 = 0.020;

/// Why a scan ended.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum EndReason {
    /// The path was travelled to its end.
    #[error("the path was travelled")]
    Travelled,
    /// The operator stopped it.
    #[error("stopped by the operator")]
    Stopped,
    /// The controller did not let itself be guided for too long.
    #[error("the controller did not begin to be guided in time")]
    NeverBegan,
    /// The controller began another session.
    #[error("the controller restarted")]
    Restarted,
    /// A reference would have been outside the limits.
    #[error("a reference would have been outside the limits")]
    OutsideLimits,
    /// The robot stood too far from the path's first pose.
    #[error("the robot is {:.1} mm and {:.2}° from where the path begins", distance_m * 1e3, angle_rad.to_degrees())]
    StartTooFar {
        /// Distance, m.
        distance_m: f64,
        /// Angle, rad.
        angle_rad: f64,
    },
    /// The controller no longer follows the PC.
    #[error("the controller left guidance (motors off, RAPID stopped, or EGM ended)")]
    LeftGuidance,
    /// Nothing was received for too long.
    #[error("nothing was received from the robot for {:.0} ms", *silent_s * 1e3)]
    RobotSilent {
        /// How long, s.
        silent_s: f64,
    },
    /// It sends too rarely to be guided.
    #[error("the robot sends every {:.0} ms; to be guided it must send every {:.0} ms or more often (\\SampleRate)", *period_s * 1e3, SLOWEST_S * 1e3)]
    TooSlow {
        /// Time between its messages, s.
        period_s: f64,
    },
    /// The robot reports an impossible pose.
    #[error("the reported pose leapt by {:.1} mm and {:.2}°, which the robot cannot have moved", distance_m * 1e3, angle_rad.to_degrees())]
    NotBelieved {
        /// Distance from the last pose that was believed, m.
        distance_m: f64,
        /// Angle, rad.
        angle_rad: f64,
    },
    /// The robot is elsewhere.
    #[error("the robot is {:.1} mm and {:.2}° from its reference", distance_m * 1e3, angle_rad.to_degrees())]
    Deviation {
        /// Distance, m.
        distance_m: f64,
        /// Angle, rad.
        angle_rad: f64,
    },
    /// The controller reports that the robot cannot follow.
    #[error("the robot cannot follow: {percent:.0} % utilised")]
    Overload {
        /// `utilizationRate`, %.
        percent: f64,
    },
    /// The controller detected a collision.
    #[error("the controller detected a collision")]
    Collision,
}

/// Phase of the guidance.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Phase {
    /// Waits for the controller to let itself be guided.
    #[default]
    Waiting,
    /// On the path.
    Travelling {
        /// Place on the path.
        on_path: PathState,
        /// Braking for the path's end.
        braking_for_end: bool,
        /// Timely frames still needed before the motion continues after a hold-up of this program.
        paused_for: u32,
    },
    /// At rest on the path because nothing was received for some periods; it continues if the robot is soon received
    /// again.
    Interrupted {
        /// Place on the path, at rest.
        on_path: PathState,
    },
    /// Braking along the path.
    Stopping {
        /// Place on the path.
        on_path: PathState,
        /// Why.
        why: EndReason,
    },
    /// At rest where the path was left, or where the robot was.
    Holding {
        /// The pose.
        at: Pose,
        /// Since when, on the steady clock, ns.
        since_ns: i64,
        /// Why.
        why: EndReason,
    },
    /// Nothing is sent any more.
    Silent {
        /// Why.
        why: EndReason,
    },
}

impl fmt::Display for Phase {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Waiting => f.write_str("waiting for the controller to be guided"),
            Self::Travelling { on_path, paused_for: 0, .. } => {
                write!(f, "on the path at {:.1} s", on_path.path_s)
            }
            Self::Travelling { on_path, .. } => {
                write!(f, "paused at {:.1} s: frames came late", on_path.path_s)
            }
            Self::Interrupted { on_path } => {
                write!(f, "at rest at {:.1} s: the robot is silent", on_path.path_s)
            }
            Self::Stopping { why, .. } => write!(f, "stopping: {why}"),
            Self::Holding { why, .. } => write!(f, "holding: {why}"),
            Self::Silent { why } => write!(f, "silent: {why}"),
        }
    }
}
