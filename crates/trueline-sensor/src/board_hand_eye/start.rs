//! Start of the joint estimate without prior knowledge: the time offset from the rotation angles of camera and robot, the
//! hand-eye transform from closed forms over few sightings. Wrong sightings hardly matter to either.
//!
//! Angles do not depend on how the camera is mounted. The best offsets are all tried: a motion that repeats itself has several.

use super::closed_form::{ClosedForm, MotionPair, pairs, with_scale};
use super::pose_sighting::Sighting;
use super::robot_path::RobotPath;
use super::unknowns::Unknowns;
use nalgebra::{Matrix3, Vector3};
use trueline_geometry::{Pose, se3, so3};

/// Offsets tried to either side of zero: 5 ms apart for a reach of a second. In that time the angle turned in [`PAIR_S`]
/// changes by some percent.
const STEPS: i32 = 200;
/// Turns are compared over this time, s, or to the next picture after it: long enough that the noise of a pose is small beside them.
const PAIR_S: f64 = 0.3;
/// Pairs that are compared, at most.
const MOST_PAIRS: usize = 400;
/// An offset counts if this part of all pairs lies within the robot's recording there.
const LEAST_PART: f64 = 0.5;
/// Of the turns of right sightings at least this part is alike in camera and robot: three in ten sightings wrong leave half of the pairs.
const ALIKE_PART: f64 = 0.3;
/// Turns that differ by this many times more than those count as different.
const ALIKE_TIMES: f64 = 3.0;
/// Turns that differ by less are the same, rad.
const LEAST_TURN_RAD: f64 = 1e-6;
/// Offsets nearer to each other than this lead to the same answer, s.
const APART_S: f64 = 0.1;

/// Sightings in the closed form.
const FEW: usize = 60;
/// Sets of sightings that are drawn, of each size: with three of ten wrong a set of three is right once in three, of six once in eight.
const DRAWS: usize = 150;
/// Sizes of these sets: two motions are the fewest, and more of them average noise.
const SIZES: [usize; 2] = [3, 6];
/// Sightings of a set that are tried as the one with the target's place.
const ANCHORS: usize = 3;
/// The score of a start is the residual below which this fraction of the sightings lies: less than half, because half of them may be wrong.
const EXPLAINED_PART: f64 = 0.4;
/// A robot turns about one axis if its turns about any other are this much smaller.
const ONE_AXIS: f64 = 0.02;
/// A robot that turns by less between two sightings, root mean square, does not turn, rad.
const NO_TURN_RAD: f64 = 0.02;
/// Part of all pairs with rotations below [`NO_TURN_RAD`] if the robot does not rotate.
const MOST_PAIRS_PART: f64 = 0.9;

/// Measure of the robot's motion: its rotation angle, which no mounting changes, or its shift if it does not rotate.
#[derive(Clone, Copy)]
enum Cue {
    Turns,
    Shifts,
}

impl Cue {
    /// The cue of a robot with these pairs of sightings.
    fn of(pairs: &[Change], robot: &RobotPath<'_>) -> Self {
        let turn =
            |(from, to, _): &Change| Some(robot.attitude(*from, 0.0)?.angle_to(&robot.attitude(*to, 0.0)?));
        match quantile(pairs.iter().filter_map(turn).collect(), MOST_PAIRS_PART) {
            Some(largest_rad) if largest_rad < NO_TURN_RAD => Self::Shifts,
            _ => Self::Turns,
        }
    }

    /// Distance between two poses, rad or m.
    fn between(self, a: &Pose, b: &Pose) -> f64 {
        match self {
            Self::Turns => a.rotation.angle_to(&b.rotation),
            Self::Shifts => (a.translation.vector - b.translation.vector).norm(),
        }
    }
}

/// The time offsets within ± `reach_s` at which the angles that the camera turns by are most like the robot's, the best first. A robot
/// that does not turn is compared by its shifts.
pub(crate) fn offsets_s<S: Sighting>(
    sightings: &[S],
    robot: &RobotPath<'_>,
    reach_s: f64,
    most: usize,
) -> Vec<f64> {
    let stamps_s = robot.stamps_s();
    let cue = Cue::of(&changes(sightings, stamps_s, Cue::Turns), robot);
    let changes = changes(sightings, stamps_s, cue);
    let step_s = reach_s / f64::from(STEPS);
    let differences: Vec<(f64, Option<Vec<f64>>)> = (-STEPS..=STEPS)
        .map(|k| f64::from(k) * step_s)
        .map(|offset_s| (offset_s, differences(&changes, robot, offset_s, cue)))
        .collect();
    let levels = differences.iter().filter_map(|(_, all)| quantile(all.clone()?, ALIKE_PART));
    let alike = LEAST_TURN_RAD + ALIKE_TIMES * levels.fold(f64::INFINITY, f64::min);
    let score =
        |all: &Vec<f64>| all.iter().map(|d| d * d / (d * d + alike * alike)).sum::<f64>() / all.len() as f64;
    let scores: Vec<f64> =
        differences.iter().map(|(_, all)| all.as_ref().map_or(f64::INFINITY, score)).collect();
    let is_lowest = |k: usize| {
        let beside = [k.checked_sub(1), Some(k + 1)].into_iter().flatten().filter_map(|k| scores.get(k));
        scores[k].is_finite() && beside.copied().all(|other| scores[k] <= other)
    };
    let mut lowest: Vec<usize> = (0..scores.len()).filter(|k| is_lowest(*k)).collect();
    lowest.sort_by(|a, b| scores[*a].total_cmp(&scores[*b]));
    let mut found: Vec<f64> = Vec::new();
    for offset_s in lowest.into_iter().map(|k| differences[k].0) {
        if found.len() < most && found.iter().all(|other| (other - offset_s).abs() > APART_S) {
            found.push(offset_s);
        }
    }
    found
}

/// Two sightings and how far they are apart, rad or m.
type Change = (usize, usize, f64);

fn changes<S: Sighting>(sightings: &[S], stamps_s: &[f64], cue: Cue) -> Vec<Change> {
    let stride = sightings.len().div_ceil(MOST_PAIRS).max(1);
    let change = |k: usize| {
        let later = k + stamps_s.get(k..)?.partition_point(|t| *t < stamps_s[k] + PAIR_S);
        let [a, b] = [sightings.get(k)?, sightings.get(later)?].map(Sighting::camera_from_target);
        Some((k, later, cue.between(a, b)))
    };
    (0..sightings.len()).step_by(stride).filter_map(change).collect()
}

/// Differences between the robot's changes and the observed ones at an offset; `None` if too few of them are
/// recorded.
fn differences(changes: &[Change], robot: &RobotPath<'_>, offset_s: f64, cue: Cue) -> Option<Vec<f64>> {
    let difference = |(from, to, seen): &Change| {
        let (a, b) = (robot.at(*from, offset_s)?, robot.at(*to, offset_s)?);
        Some((cue.between(&a.base_from_tool, &b.base_from_tool) - seen).abs())
    };
    let all: Vec<f64> = changes.iter().filter_map(difference).collect();
    (!all.is_empty() && all.len() as f64 >= LEAST_PART * changes.len() as f64).then_some(all)
}

/// The value that this part of all is below.
pub(crate) fn quantile(mut values: Vec<f64>, part: f64) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let k = (part * values.len() as f64) as usize;
    values.get(k.min(values.len().saturating_sub(1))).copied()
}

/// Some sightings, spread evenly, with the robot's pose at each.
pub(crate) struct Few {
    tools: Vec<Pose>,
    seen: Vec<Pose>,
    /// Distance at which a turn of the target counts as a shift, m: the usual one of the target.
    lever_m: f64,
    time_offset_s: f64,
}

impl Few {
    /// The sightings with a known robot pose at a time offset.
    pub(crate) fn of<S: Sighting>(sightings: &[S], robot: &RobotPath<'_>, time_offset_s: f64) -> Self {
        let pair = |(k, seen): (usize, &S)| {
            Some((robot.at(k, time_offset_s)?.base_from_tool, *seen.camera_from_target()))
        };
        let known: Vec<(Pose, Pose)> = sightings.iter().enumerate().filter_map(pair).collect();
        let stride = known.len().div_ceil(FEW).max(1);
        let (tools, seen): (Vec<Pose>, Vec<Pose>) = known.into_iter().step_by(stride).unzip();
        let distances = seen.iter().map(|seen| seen.translation.vector.norm()).collect();
        Self { lever_m: quantile(distances, 0.5).unwrap_or(0.0), tools, seen, time_offset_s }
    }

    /// The start that a closed form gives over all of them or over a few, whichever explains most; `None` where the motion fixes no
    /// hand-eye transform.
    pub(crate) fn by_closed_form(&self) -> Option<Unknowns> {
        let tried = self.sets().filter_map(|set| {
            let tool_from_camera = ClosedForm::Park.solve(&self.motions(&set))?;
            self.best_anchor(&set, tool_from_camera)
        });
        tried.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, start)| start)
    }

    /// The factor of the sightings' lengths that explains most in the same way; `None` where the motion fixes none.
    pub(crate) fn scale(&self) -> Option<f64> {
        let tried = self.sets().filter_map(|set| {
            let (tool_from_camera, factor) = with_scale(&self.motions(&set))?;
            let (off, _) = self.scaled(factor).best_anchor(&set, tool_from_camera)?;
            Some((off, factor))
        });
        tried.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, factor)| factor)
    }

    /// All sightings, and sets of few that are drawn.
    fn sets(&self) -> impl Iterator<Item = Vec<usize>> {
        let count = self.seen.len();
        let mut draw = Draw(1);
        let drawn = (0..DRAWS * SIZES.len()).map(move |k| draw.set(SIZES[k % SIZES.len()], count));
        std::iter::once((0..count).collect()).chain(drawn)
    }

    /// Motions between the sightings of a set.
    fn motions(&self, set: &[usize]) -> Vec<MotionPair> {
        let (tools, seen): (Vec<Pose>, Vec<Pose>) =
            set.iter().map(|k| (self.tools[*k], self.seen[*k])).unzip();
        pairs(&tools, &seen)
    }

    /// The same with all lengths multiplied by a factor.
    fn scaled(&self, factor: f64) -> Self {
        let scaled = |pose: &Pose| se3::from_parts(pose.rotation, pose.translation.vector * factor);
        Self {
            tools: self.tools.clone(),
            seen: self.seen.iter().map(scaled).collect(),
            lever_m: self.lever_m * factor,
            time_offset_s: self.time_offset_s,
        }
    }

    /// The start with a hand-eye transform that is given; the target is where most sightings agree that it is.
    pub(crate) fn with_hand_eye(&self, tool_from_camera: Pose) -> Option<Unknowns> {
        let all: Vec<usize> = (0..self.seen.len()).collect();
        let [first, middle, last] = [0, all.len() / 2, all.len().saturating_sub(1)];
        let spread = [first, middle, last, all.len() / 4, 3 * all.len() / 4];
        let starts = spread.iter().filter_map(|k| self.anchored(*all.get(*k)?, tool_from_camera));
        starts.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, start)| start)
    }

    /// Starts all around: one near every possible attitude of the camera.
    pub(crate) fn anywhere(&self) -> Vec<Unknowns> {
        let turned = |rotation| self.with_hand_eye(se3::from_parts(rotation, Vector3::zeros()));
        so3::cube_rotations().into_iter().filter_map(turned).collect()
    }

    /// Whether the robot rotates about one axis at most, or not at all, so that a closed form follows noise.
    pub(crate) fn turn_about_one_axis(&self) -> bool {
        let motions: Vec<MotionPair> = pairs(&self.tools, &self.seen);
        let turn = |pair: &MotionPair| so3::log(&pair.tool.rotation);
        let sum: Matrix3<f64> = motions.iter().map(|pair| turn(pair) * turn(pair).transpose()).sum();
        let mut values: Vec<f64> = sum.symmetric_eigenvalues().iter().copied().collect();
        values.sort_by(f64::total_cmp);
        let is_still = values[2] <= NO_TURN_RAD * NO_TURN_RAD * motions.len() as f64;
        is_still || values[1] <= ONE_AXIS * ONE_AXIS * values[2]
    }

    fn best_anchor(&self, set: &[usize], tool_from_camera: Pose) -> Option<(f64, Unknowns)> {
        let starts = set.iter().take(ANCHORS).filter_map(|k| self.anchored(*k, tool_from_camera));
        starts.min_by(|a, b| a.0.total_cmp(&b.0))
    }

    /// The start with the target at the place of sighting `k`, and the distance of most others, m².
    fn anchored(&self, k: usize, tool_from_camera: Pose) -> Option<(f64, Unknowns)> {
        let base_from_target = self.tools[k] * tool_from_camera * self.seen[k];
        let camera_from_tool = tool_from_camera.inverse();
        let off = |(tool, seen): (&Pose, &Pose)| {
            let predicted = camera_from_tool * tool.inverse() * base_from_target;
            let (turn, shift) = se3::difference_decoupled(seen, &predicted);
            (turn * self.lever_m).norm_squared() + shift.norm_squared()
        };
        let all = self.tools.iter().zip(&self.seen).map(off).collect();
        let start = Unknowns { time_offset_s: self.time_offset_s, tool_from_camera, base_from_target };
        Some((quantile(all, EXPLAINED_PART)?, start))
    }
}

/// Draws that are the same in every run: a linear congruence \[Knuth1997, 3.3.4\].
struct Draw(u64);

impl Draw {
    fn below(&mut self, count: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 33) % count.max(1) as u64) as usize
    }

    /// A set of different numbers below `count`; all of them if there are no more.
    fn set(&mut self, size: usize, count: usize) -> Vec<usize> {
        let mut set = Vec::with_capacity(size);
        while set.len() < size.min(count) {
            let next = self.below(count);
            if !set.contains(&next) {
                set.push(next);
            }
        }
        set
    }
}
