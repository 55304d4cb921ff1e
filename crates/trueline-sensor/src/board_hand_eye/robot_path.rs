//! Pose of the robot when a picture was taken.

use nalgebra::{UnitQuaternion, Vector3};
use trueline_geometry::{Pose, Trajectory};

/// The robot's poses, one for each picture or over time.
#[derive(Clone, Copy, Debug)]
pub enum RobotPath<'a> {
    /// The robot stands: `base_from_tool` at each picture.
    Stops(&'a [Pose]),
    /// The robot moves.
    Moving {
        /// `base_from_tool` over time, s.
        trajectory: &'a Trajectory,
        /// Stamps of the pictures in the same time, s.
        stamps_s: &'a [f64],
    },
    /// The robot moves, and the time offset is held at its start.
    MovingAtKnownOffset {
        /// `base_from_tool` over time, s.
        trajectory: &'a Trajectory,
        /// Stamps of the pictures in the same time, s.
        stamps_s: &'a [f64],
    },
}

/// Pose and rates of the tool at one exposure.
#[derive(Clone, Copy, Debug)]
pub struct ToolState {
    /// `base_from_tool`.
    pub base_from_tool: Pose,
    /// Angular rate in the tool frame, rad/s.
    pub body_rate: Vector3<f64>,
    /// Velocity of the tool's origin in base, m/s.
    pub velocity: Vector3<f64>,
}

impl<'p> RobotPath<'p> {
    /// The tool at the exposure of picture `k`, its stamp less the time offset; `None` without a recorded pose.
    #[must_use]
    pub fn at(&self, k: usize, time_offset_s: f64) -> Option<ToolState> {
        match self {
            Self::Stops(poses) => Some(ToolState {
                base_from_tool: *poses.get(k)?,
                body_rate: Vector3::zeros(),
                velocity: Vector3::zeros(),
            }),
            Self::Moving { trajectory, stamps_s } | Self::MovingAtKnownOffset { trajectory, stamps_s } => {
                let time_s = stamps_s.get(k)? - time_offset_s;
                let segment = trajectory.segments().get(trajectory.bracket(time_s)?)?;
                if segment.duration > trajectory.gap_limit() {
                    return None;
                }
                Some(ToolState {
                    base_from_tool: segment.pose_at(time_s),
                    body_rate: segment.body_rate,
                    velocity: segment.velocity,
                })
            }
        }
    }

    /// The attitude alone.
    #[must_use]
    pub fn attitude(&self, k: usize, time_offset_s: f64) -> Option<UnitQuaternion<f64>> {
        Some(self.at(k, time_offset_s)?.base_from_tool.rotation)
    }

    /// Whether a time offset is among the unknowns.
    #[must_use]
    pub fn has_time_offset(&self) -> bool {
        matches!(self, Self::Moving { .. })
    }

    /// Poses at the pictures; none while the robot moves.
    #[must_use]
    pub fn stops(&self) -> &[Pose] {
        match self {
            Self::Stops(poses) => poses,
            Self::Moving { .. } | Self::MovingAtKnownOffset { .. } => &[],
        }
    }

    /// The same path at other pictures: with these stamps, s, or at stops with these poses.
    #[must_use]
    pub fn at_others<'a>(&self, stamps_s: &'a [f64], poses: &'a [Pose]) -> RobotPath<'a>
    where
        'p: 'a,
    {
        match *self {
            Self::Stops(_) => RobotPath::Stops(poses),
            Self::Moving { trajectory, .. } => RobotPath::Moving { trajectory, stamps_s },
            Self::MovingAtKnownOffset { trajectory, .. } => {
                RobotPath::MovingAtKnownOffset { trajectory, stamps_s }
            }
        }
    }

    /// Stamps of the pictures, s; none at stops.
    #[must_use]
    pub fn stamps_s(&self) -> &[f64] {
        match self {
            Self::Stops(_) => &[],
            Self::Moving { stamps_s, .. } | Self::MovingAtKnownOffset { stamps_s, .. } => stamps_s,
        }
    }
}
