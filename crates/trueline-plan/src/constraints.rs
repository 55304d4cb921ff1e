//! Fraction of every limit that a motion uses: 1 is all of it.

use crate::cell::Cell;
use crate::motion::{Motion, PATH_PERIOD_S};
use crate::mounted_arm::{JointPath, MountedArm};
use crate::robustness_to_guess::Loss;
use nalgebra::Vector3;
use trueline_geometry::{Pose, so3};

/// Something that a motion must keep to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Constraint {
    /// Speed of the tool's origin.
    Speed,
    /// Speed of the fastest point that the tool carries.
    TipSpeed,
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
    /// The same, with the losses beyond an end of the seam.
    SeamEnds,
    /// The reach of the arm.
    Reach,
    /// Ranges of its joints.
    JointRange,
    /// Speeds of its joints.
    JointSpeed,
    /// Accelerations of its joints.
    JointAcceleration,
    /// The distance of its wrist from the singularity.
    Wrist,
    /// The distance of the robot's load from the plates.
    Clearance,
    /// Speed of the external axes.
    AxisSpeed,
    /// Their acceleration.
    AxisAcceleration,
}

impl Constraint {
    /// All of them.
    pub const ALL: [Self; 18] = [
        Self::Speed,
        Self::TipSpeed,
        Self::Acceleration,
        Self::Jerk,
        Self::TurnRate,
        Self::TurnAcceleration,
        Self::TurnJerk,
        Self::Workspace,
        Self::View,
        Self::SeamEnds,
        Self::Reach,
        Self::JointRange,
        Self::JointSpeed,
        Self::JointAcceleration,
        Self::Wrist,
        Self::Clearance,
        Self::AxisSpeed,
        Self::AxisAcceleration,
    ];

    /// The name for a person.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Speed => "speed",
            Self::TipSpeed => "tip speed",
            Self::Acceleration => "acceleration",
            Self::Jerk => "jerk",
            Self::TurnRate => "angular speed",
            Self::TurnAcceleration => "angular acceleration",
            Self::TurnJerk => "angular jerk",
            Self::Workspace => "workspace",
            Self::View => "field of view",
            Self::SeamEnds => "frames past the seam's ends",
            Self::Reach => "reach",
            Self::JointRange => "joint range",
            Self::JointSpeed => "joint speed",
            Self::JointAcceleration => "joint acceleration",
            Self::Wrist => "margin to the wrist singularity",
            Self::Clearance => "clearance to the plates",
            Self::AxisSpeed => "external axis speed",
            Self::AxisAcceleration => "external axis acceleration",
        }
    }

    /// The name in files.
    #[must_use]
    pub fn key(self) -> &'static str {
        match self {
            Self::Speed => "speed",
            Self::TipSpeed => "speed_of_what_the_tool_carries",
            Self::Acceleration => "acceleration",
            Self::Jerk => "jerk",
            Self::TurnRate => "angular_speed",
            Self::TurnAcceleration => "angular_acceleration",
            Self::TurnJerk => "angular_jerk",
            Self::Workspace => "workspace",
            Self::View => "field_of_view",
            Self::SeamEnds => "length_of_the_seam",
            Self::Reach => "reach_of_the_arm",
            Self::JointRange => "range_of_the_joints",
            Self::JointSpeed => "speed_of_the_joints",
            Self::JointAcceleration => "acceleration_of_the_joints",
            Self::Wrist => "way_to_the_wrist's_singularity",
            Self::Clearance => "room_above_the_plates",
            Self::AxisSpeed => "speed_of_the_external_axes",
            Self::AxisAcceleration => "acceleration_of_the_external_axes",
        }
    }

    /// Whether a cell has this limit.
    #[must_use]
    pub fn applies_in(self, cell: &Cell) -> bool {
        let joints = || cell.arm.iter().flat_map(|mounted| &mounted.arm.joints);
        match self {
            Self::Workspace => cell.limits.workspace_m.is_some(),
            Self::Reach | Self::JointRange | Self::JointSpeed | Self::Wrist => cell.arm.is_some(),
            Self::JointAcceleration => joints().any(|joint| joint.acceleration_rad_s2.is_some()),
            Self::Clearance => !cell.surroundings.is_empty(),
            Self::AxisSpeed | Self::AxisAcceleration => !cell.axes.is_empty(),
            _ => true,
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

    /// Factor by which the motion is too fast: slowed down by it, the motion keeps all limits of speed, acceleration and
    /// jerk.
    #[must_use]
    pub(crate) fn too_fast(&self) -> f64 {
        use Constraint::{
            Acceleration, AxisAcceleration, AxisSpeed, Jerk, Speed, TipSpeed, TurnAcceleration, TurnJerk,
            TurnRate,
        };
        let most = |list: &[Constraint]| list.iter().map(|one| self.used(*one)).fold(0.0, f64::max);
        let speed = most(&[Speed, TipSpeed, TurnRate, AxisSpeed]);
        let acceleration = most(&[Acceleration, TurnAcceleration, AxisAcceleration]);
        speed.max(acceleration.sqrt()).max(most(&[Jerk, TurnJerk]).cbrt())
    }

    /// By how much limits are exceeded in all; 0 if none is.
    #[must_use]
    pub fn excess(&self, most_used: f64) -> f64 {
        self.used.iter().map(|used| (used / most_used - 1.0).max(0.0)).sum()
    }
}

/// A box that is left, or a clearance that is missed, by this much counts as one limit's worth, m.
const BOX_M: f64 = 0.1;

/// Measures the demands of a motion on the robot.
#[must_use]
pub(crate) fn of_motion(cell: &Cell, motion: &Motion, period_s: f64) -> Constraints {
    let mut constraints = Constraints::default();
    let poses = motion.sampled(period_s);
    moving(cell, &poses, period_s, &mut constraints);
    in_the_box(cell, &poses, &mut constraints);
    axes_moving(cell, motion, period_s, &mut constraints);
    constraints
}

impl Constraints {
    /// Adds the sensor's view: the place of the seam in the camera at the guess, and the losses of wrong cells.
    #[must_use]
    pub(crate) fn with_view(
        mut self,
        cell: &Cell,
        points: impl Iterator<Item = Vector3<f64>>,
        loss: &Loss,
    ) -> Self {
        let room = points.map(|point| cell.view.room(&point)).fold(f64::INFINITY, f64::min);
        self.raise(Constraint::View, 1.0 - room);
        let lost = if loss.beyond_end > 0.5 { Constraint::SeamEnds } else { Constraint::View };
        self.raise(lost, loss.used());
        self
    }
}

/// For a path that is not reached to its end, each missing tenth counts as one limit's worth.
const MISSING: f64 = 0.1;

impl Constraints {
    /// Adds the arm's motion for poses of the tool (it reaches the first ones), and the distance of the robot's load from
    /// the plates.
    #[must_use]
    pub(crate) fn with_arm(mut self, cell: &Cell, poses: &[Pose], joints: Option<&JointPath>) -> Self {
        if let Some((mounted, joints)) = cell.arm.as_ref().zip(joints) {
            self.raise_joints(mounted, joints);
            let missing = 1.0 - joints.angles.len() as f64 / poses.len() as f64;
            self.raise(Constraint::Reach, if missing > 0.0 { 1.0 + missing / MISSING } else { 0.0 });
        }
        if !cell.surroundings.is_empty() {
            for (k, pose) in poses.iter().enumerate() {
                let arm = cell.arm.as_ref().zip(joints.and_then(|joints| joints.angles.get(k)));
                let room_m = cell.surroundings.distance_m(pose, arm) - cell.surroundings.clearance_m;
                self.raise(Constraint::Clearance, (1.0 - room_m / BOX_M).max(0.0));
            }
        }
        self
    }

    fn raise_joints(&mut self, mounted: &MountedArm, path: &JointPath) {
        for angles in &path.angles {
            let (range, wrist) = mounted.used(angles);
            self.raise(Constraint::JointRange, range);
            self.raise(Constraint::Wrist, wrist);
        }
        let [speeds, accelerations] = path.fastest();
        for ((joint, speed), acceleration) in mounted.arm.joints.iter().zip(speeds).zip(accelerations) {
            self.raise(Constraint::JointSpeed, speed / joint.speed_rad_s);
            if let Some(most) = joint.acceleration_rad_s2 {
                self.raise(Constraint::JointAcceleration, acceleration / most);
            }
        }
    }
}

/// A rate, its change and the change of that, from one step to the next; before the first step everything rests.
#[derive(Default)]
struct Derivatives {
    rate: Vector3<f64>,
    acceleration: Vector3<f64>,
}

impl Derivatives {
    /// Lengths of rate, acceleration and jerk when a step is done.
    fn after(&mut self, step: Vector3<f64>, period_s: f64) -> [f64; 3] {
        let rate = step / period_s;
        let acceleration = (rate - self.rate) / period_s;
        let jerk = (acceleration - self.acceleration) / period_s;
        *self = Self { rate, acceleration };
        [rate, acceleration, jerk].map(|vector| vector.norm())
    }
}

fn moving(cell: &Cell, poses: &[Pose], period_s: f64, constraints: &mut Constraints) {
    let limits = &cell.limits;
    let (mut shift, mut turn) = (Derivatives::default(), Derivatives::default());
    // It begins and ends at rest.
    let rest = poses.last().map(|last| [last, last]);
    let pairs = poses.windows(2).map(|pair| [&pair[0], &pair[1]]).chain(rest);
    for [from, to] in pairs {
        let shifted = to.translation.vector - from.translation.vector;
        let [speed, acceleration, jerk] = shift.after(shifted, period_s);
        constraints.raise(Constraint::Speed, speed / limits.speed_m_s);
        constraints.raise(Constraint::Acceleration, acceleration / limits.acceleration_m_s2);
        constraints.raise(Constraint::Jerk, jerk / limits.jerk_m_s3);
        let turned = so3::log(&(to.rotation * from.rotation.inverse()));
        let [rate, turn_acceleration, turn_jerk] = turn.after(turned, period_s);
        constraints.raise(Constraint::TurnRate, rate / limits.turn_rad_s);
        constraints.raise(Constraint::TurnAcceleration, turn_acceleration / limits.turn_acceleration_rad_s2);
        constraints.raise(Constraint::TurnJerk, turn_jerk / limits.turn_jerk_rad_s3);
        // The gate bounds it over the time between two poses of the path, from the ends of that time by h²/8 of its second
        // derivative. An end differs from the mean of the steps about it by at most h²/6, their means from the middles by
        // h²/24.
        let between = PATH_PERIOD_S * PATH_PERIOD_S / 3.0 * (jerk + turn_jerk * limits.reach_m);
        let fastest = fastest_m_s(&shift.rate, &turn.rate, limits.reach_m) + between;
        constraints.raise(Constraint::TipSpeed, fastest / limits.tip_speed_m_s);
    }
}

/// Speed of the fastest point of a ball about the tool's origin, for the velocity of the origin and the angular velocity ω: ω × p fills
/// a disc square to ω, so √(v∥² + (v⊥ + |ω|·reach)²).
fn fastest_m_s(velocity: &Vector3<f64>, turn: &Vector3<f64>, reach_m: f64) -> f64 {
    let rate = turn.norm();
    if rate == 0.0 {
        return velocity.norm();
    }
    let along = velocity.dot(turn) / rate;
    let square = (velocity.norm_squared() - along * along).max(0.0).sqrt();
    let sideways = square + rate * reach_m;
    (along * along + sideways * sideways).sqrt()
}

fn axes_moving(cell: &Cell, motion: &Motion, period_s: f64, constraints: &mut Constraints) {
    let records = motion.axis_records(cell, period_s, period_s);
    for (axis, record) in cell.axes.iter().zip(&records) {
        let rates = record.values.windows(2).map(|pair| (pair[1].value - pair[0].value) / period_s);
        let rates: Vec<f64> = rates.collect();
        let fastest = rates.iter().fold(0.0_f64, |most, rate| most.max(rate.abs()));
        let changes = rates.windows(2).map(|pair| (pair[1] - pair[0]).abs() / period_s);
        constraints.raise(Constraint::AxisSpeed, fastest / axis.limits.speed);
        let most = changes.fold(0.0, f64::max) / axis.limits.acceleration;
        constraints.raise(Constraint::AxisAcceleration, most);
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
