//! How much of every limit a motion uses: 1 is all of it.

use crate::cell::Cell;
use crate::motion::Motion;
use crate::wrong_cells::Loss;
use nalgebra::Vector3;
use trueline_geometry::{Pose, so3};

/// Something that a motion must keep to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Constraint {
    /// Speed of the tool.
    Speed,
    /// Its acceleration.
    Acceleration,
    /// Its jerk.
    Jerk,
    /// Angular speed.
    TurnRate,
    /// Angular acceleration.
    TurnAcceleration,
    /// Angular jerk.
    TurnJerk,
    /// The box that the tool stays in.
    Workspace,
    /// The seam in view: at the guess in every frame, in cells where the guess is wrong in as many as [`Loss`] allows.
    View,
    /// The same where what is lost is lost beyond an end of the seam.
    SeamEnds,
}

impl Constraint {
    /// All of them.
    pub const ALL: [Self; 9] = [
        Self::Speed,
        Self::Acceleration,
        Self::Jerk,
        Self::TurnRate,
        Self::TurnAcceleration,
        Self::TurnJerk,
        Self::Workspace,
        Self::View,
        Self::SeamEnds,
    ];

    /// The name for a person.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Speed => "speed",
            Self::Acceleration => "acceleration",
            Self::Jerk => "jerk",
            Self::TurnRate => "angular speed",
            Self::TurnAcceleration => "angular acceleration",
            Self::TurnJerk => "angular jerk",
            Self::Workspace => "workspace",
            Self::View => "field of view",
            Self::SeamEnds => "length of the seam",
        }
    }
}

/// The part of each limit that is used, in the order of [`Constraint::ALL`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Constraints {
    used: [f64; Constraint::ALL.len()],
}

impl Constraints {
    /// The part of one limit that is used.
    #[must_use]
    pub fn used(&self, constraint: Constraint) -> f64 {
        self.used[constraint as usize]
    }

    fn raise(&mut self, constraint: Constraint, used: f64) {
        let most = &mut self.used[constraint as usize];
        // A constraint that is not a number is never kept.
        *most = if used.is_nan() { f64::INFINITY } else { most.max(used) };
    }

    /// The limit that is used most, and how much of it.
    #[must_use]
    pub fn most(&self) -> (Constraint, f64) {
        let all = Constraint::ALL.map(|constraint| (constraint, self.used(constraint)));
        all.into_iter().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((Constraint::Speed, 0.0))
    }

    /// By how much limits are exceeded in all; 0 if none is.
    #[must_use]
    pub fn excess(&self, most_used: f64) -> f64 {
        self.used.iter().map(|used| (used / most_used - 1.0).max(0.0)).sum()
    }
}

/// A box that is left by this much counts as one limit's worth, m.
const BOX_M: f64 = 0.1;

/// Measures what a motion demands of the robot.
#[must_use]
pub fn of_motion(cell: &Cell, motion: &Motion, period_s: f64) -> Constraints {
    let mut constraints = Constraints::default();
    let poses = motion.sampled(period_s);
    moving(cell, &poses, period_s, &mut constraints);
    in_the_box(cell, &poses, &mut constraints);
    constraints
}

impl Constraints {
    /// With what the sensor sees: where the seam is in the camera at the guess, and what wrong cells lose.
    #[must_use]
    pub fn with_view(mut self, cell: &Cell, points: impl Iterator<Item = Vector3<f64>>, loss: &Loss) -> Self {
        let room = points.map(|point| cell.view.room(&point)).fold(f64::INFINITY, f64::min);
        self.raise(Constraint::View, 1.0 - room);
        let lost = if loss.beyond_end > 0.5 { Constraint::SeamEnds } else { Constraint::View };
        self.raise(lost, loss.used());
        self
    }
}

fn moving(cell: &Cell, poses: &[Pose], period_s: f64, constraints: &mut Constraints) {
    let limits = &cell.limits;
    let [mut last_speed, mut last_acceleration] = [Vector3::zeros(); 2];
    let [mut last_turn, mut last_turn_acceleration] = [Vector3::zeros(); 2];
    // It begins and ends at rest.
    let rest = poses.last().map(|last| [last, last]);
    let pairs = poses.windows(2).map(|pair| [&pair[0], &pair[1]]).chain(rest);
    for [from, to] in pairs {
        let speed = (to.translation.vector - from.translation.vector) / period_s;
        let acceleration = (speed - last_speed) / period_s;
        let jerk = (acceleration - last_acceleration) / period_s;
        constraints.raise(Constraint::Speed, speed.norm() / limits.speed_m_s);
        constraints.raise(Constraint::Acceleration, acceleration.norm() / limits.acceleration_m_s2);
        constraints.raise(Constraint::Jerk, jerk.norm() / limits.jerk_m_s3);
        (last_speed, last_acceleration) = (speed, acceleration);
        let turn = so3::log(&(to.rotation * from.rotation.inverse())) / period_s;
        let turn_acceleration = (turn - last_turn) / period_s;
        let turn_jerk = (turn_acceleration - last_turn_acceleration) / period_s;
        constraints.raise(Constraint::TurnRate, turn.norm() / limits.turn_rad_s);
        constraints
            .raise(Constraint::TurnAcceleration, turn_acceleration.norm() / limits.turn_acceleration_rad_s2);
        constraints.raise(Constraint::TurnJerk, turn_jerk.norm() / limits.turn_jerk_rad_s3);
        (last_turn, last_turn_acceleration) = (turn, turn_acceleration);
    }
}

fn in_the_box(cell: &Cell, poses: &[Pose], constraints: &mut Constraints) {
    let Some([low, high]) = &cell.limits.workspace_m else { return };
    for pose in poses {
        let at = pose.translation.vector;
        let outside = (0..3).map(|k| (low[k] - at[k]).max(at[k] - high[k])).fold(f64::NEG_INFINITY, f64::max);
        constraints.raise(Constraint::Workspace, (1.0 + outside / BOX_M).max(0.0));
    }
}
