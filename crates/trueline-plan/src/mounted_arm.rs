//! The arm that carries the tool, and the configuration in which it stands over the seam.

use crate::seam::Seam;
use crate::sensor_pose::{SensorPose, Station};
use nalgebra::Vector3;
use trueline_geometry::Pose;
use trueline_geometry::arm::{Angles, Arm, inverse};

/// An arm, its place and its load.
#[derive(Clone, Debug, PartialEq)]
pub struct MountedArm {
    /// Its name for a person.
    pub name: String,
    /// Its joints.
    pub arm: Arm,
    /// Its place.
    pub base_from_arm: Pose,
    /// The tool of the planned poses.
    pub flange_from_tool: Pose,
    /// Angles in the middle of the scan, rad; `None` takes the configuration with most room.
    pub near: Option<Angles>,
    /// Least distance of the wrist from its singularity, rad.
    pub least_wrist_rad: f64,
}

/// Joint angles along a path.
#[derive(Clone, Debug, PartialEq)]
pub struct JointPath {
    /// Time between two of them, s.
    pub period_s: f64,
    /// Angles, rad.
    pub angles: Vec<Angles>,
}

/// A configuration over the middle of the seam, nothing tilted: paths are followed from here.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stance {
    base_from_tool: Pose,
    /// Angles, rad.
    pub angles: Angles,
}

/// Why an arm has no stance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoStance {
    /// It cannot bring the sensor over the middle of the seam.
    Middle,
    /// It can, but not along the seam within the joints' ranges, or past the wrist's singularity.
    Ends,
}

/// Steps from the stance to where a path begins, and along the seam.
const STEPS: usize = 12;

impl MountedArm {
    fn arm_from_flange(&self, base_from_tool: &Pose) -> Pose {
        self.base_from_arm.inverse() * base_from_tool * self.flange_from_tool.inverse()
    }

    /// Joint angles for a pose of the tool, near others; `None` out of reach.
    #[must_use]
    pub fn angles_for(&self, base_from_tool: &Pose, near: &Angles) -> Option<Angles> {
        inverse::angles_for(&self.arm, &self.arm_from_flange(base_from_tool), near)
    }

    /// Use of a configuration's limits: 1 is at the end of a joint's range, or at the least distance from the wrist's
    /// singularity.
    #[must_use]
    pub fn used(&self, angles: &Angles) -> (f64, f64) {
        let range = self.arm.used_of_range(angles).into_iter().fold(0.0, f64::max);
        // 1 at the least distance, 0 if the axes are perpendicular: a search can follow it also beyond the
        // singularity.
        let wrist = self.arm.state(angles).wrist_rad();
        let square = std::f64::consts::FRAC_PI_2;
        (range, (square - wrist) / (square - self.least_wrist_rad))
    }

    /// The configuration for a seam: the one nearest to the stated one, or the one with most room along the whole seam.
    ///
    /// # Errors
    /// A seam out of the arm's reach.
    pub(crate) fn stance(
        &self,
        seam: &Seam,
        sensor: &SensorPose,
        stand_off_m: f64,
    ) -> Result<Stance, NoStance> {
        let over = |seam_point: Vector3<f64>| {
            sensor.base_from_tool(&Station { seam_point, stripe_m: 0.0, stand_off_m, tilt_rad: [0.0; 3] })
        };
        let middle = over(0.5 * (seam.from_m + seam.to_m));
        let found = inverse::configurations(&self.arm, &self.arm_from_flange(&middle));
        if found.is_empty() {
            return Err(NoStance::Middle);
        }
        let used = |angles: &Angles| {
            let stance = Stance { base_from_tool: middle, angles: *angles };
            let along = [over(seam.from_m), over(seam.to_m)].map(|end| self.follow_straight(&stance, &end));
            let [from, to] = along;
            let all = from?.into_iter().chain(to?);
            let most = all
                .map(|angles| self.used(&angles))
                .fold(0.0, |most, (range, wrist)| range.max(wrist).max(most));
            (most <= 1.0).then_some(most)
        };
        let off = |angles: &Angles| {
            let near = self.near.unwrap_or(*angles);
            (0..near.len()).map(|k| (angles[k] - near[k]).abs()).fold(0.0, f64::max)
        };
        let best = found
            .into_iter()
            .filter_map(|angles| Some((off(&angles), used(&angles)?, angles)))
            .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
        best.map(|(_, _, angles)| Stance { base_from_tool: middle, angles }).ok_or(NoStance::Ends)
    }

    /// Angles on the straight way from a stance to a pose, the pose's own last; `None` if it is lost.
    fn follow_straight(&self, stance: &Stance, to: &Pose) -> Option<Vec<Angles>> {
        let mut angles = stance.angles;
        (1..=STEPS)
            .map(|k| {
                let pose = stance.base_from_tool.lerp_slerp(to, k as f64 / STEPS as f64);
                angles = self.angles_for(&pose, &angles)?;
                Some(angles)
            })
            .collect()
    }

    /// Joint angles along poses, each from the one before, the first from the stance: the configuration is kept. Returns the
    /// reached part of the path if the rest is out of reach.
    #[must_use]
    pub fn follow(&self, stance: &Stance, poses: &[Pose], period_s: f64) -> JointPath {
        let mut path = JointPath { period_s, angles: Vec::with_capacity(poses.len()) };
        let start = poses.first().and_then(|first| self.follow_straight(stance, first)?.pop());
        let Some(mut last) = start else { return path };
        let mut change = [0.0; 6];
        for pose in poses {
            // As the last step went on.
            let near = std::array::from_fn(|k| last[k] + change[k]);
            let Some(angles) = self.angles_for(pose, &near) else { return path };
            change = std::array::from_fn(|k| angles[k] - last[k]);
            if path.angles.is_empty() {
                change = [0.0; 6];
            }
            // A change of configuration ends the path.
            if change.iter().any(|by| by.abs() > JUMP_RAD.max(FASTEST_RAD_S * period_s)) {
                return path;
            }
            path.angles.push(angles);
            last = angles;
        }
        path
    }
}

/// A joint that turns by more from one pose to the next has changed its configuration, rad. For distant poses the limit is a
/// rate that no joint reaches, rad/s.
const JUMP_RAD: f64 = 0.1;
/// See [`JUMP_RAD`].
const FASTEST_RAD_S: f64 = 12.0;

impl JointPath {
    /// Largest speed of each joint, rad/s, and acceleration, rad/s²: differences, at rest before and after.
    #[must_use]
    pub fn fastest(&self) -> [[f64; 6]; 2] {
        let mut most = [[0.0_f64; 6]; 2];
        for k in 0..6 {
            let mut last = 0.0;
            let steps = self.angles.windows(2).map(|pair| (pair[1][k] - pair[0][k]) / self.period_s);
            for speed in steps.chain([0.0]) {
                most[0][k] = most[0][k].max(speed.abs());
                most[1][k] = most[1][k].max(((speed - last) / self.period_s).abs());
                last = speed;
            }
        }
        most
    }

    /// The table of a joint path: time and angles in degrees.
    #[must_use]
    pub fn csv(&self) -> String {
        use std::fmt::Write;
        let mut text = String::from("time_s,j1_deg,j2_deg,j3_deg,j4_deg,j5_deg,j6_deg\n");
        for (k, angles) in self.angles.iter().enumerate() {
            let _ = write!(text, "{:.4}", k as f64 * self.period_s);
            for angle in angles {
                let _ = write!(text, ",{:.6}", angle.to_degrees());
            }
            text.push('\n');
        }
        text
    }
}
