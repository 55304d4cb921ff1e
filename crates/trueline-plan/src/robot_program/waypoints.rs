//! As few waypoints as a robot's own program needs: none closer in time than a controller accepts, and each with a move.

use trueline_dataset::RobotSample;
use trueline_geometry::Pose;

/// A path at a share of its own pace, which takes the longer.
#[must_use]
pub fn at_pace(mut path: Vec<RobotSample>, pace: f64) -> Vec<RobotSample> {
    let first_ns = path.first().map_or(0, |p| p.stamp_ns);
    for pose in &mut path {
        pose.stamp_ns = first_ns + ((pose.stamp_ns - first_ns) as f64 / pace).round() as i64;
    }
    path
}

/// A pose and when the tool is to be there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Waypoint {
    /// Time since the first one, s.
    pub time_s: f64,
    /// Pose of the tool.
    pub pose: Pose,
}

/// A path as waypoints, and how far straight moves between them leave it.
#[derive(Clone, Debug, PartialEq)]
pub struct Waypoints {
    /// At least two, the first at time zero.
    pub list: Vec<Waypoint>,
    /// Furthest that a point of the path is from the straight move at the same time, m.
    pub chord_m: f64,
    /// The same of the attitude, rad.
    pub chord_rad: f64,
    /// Whether an arm was followed along the path: reach, joints and wrist.
    pub reach_is_checked: bool,
    /// External axes that move in step with the robot.
    pub axes: Vec<PathAxis>,
}

/// An external axis along a path.
#[derive(Clone, Debug, PartialEq)]
pub struct PathAxis {
    /// Its name.
    pub name: String,
    /// `deg` or `mm`.
    pub unit: &'static str,
    /// Its value at each waypoint, in that unit.
    pub values: Vec<f64>,
}

/// Straight moves may leave the path by this much where the time allows it, m.
const CHORD_M: f64 = 1e-4;
/// The same for the attitude, rad.
const CHORD_RAD: f64 = 1e-3;
/// Longest move, s: a robot's planner looks some moves ahead.
const LONGEST_S: f64 = 0.25;
/// Shortest move, s: controllers need some time for each.
pub const SHORTEST_S: f64 = 0.1;
/// Shorter moves are left out: a controller may stop at them, or refuse a time for them; m.
const LEAST_M: f64 = 1e-4;
/// The same as a turn, rad.
const LEAST_RAD: f64 = 1e-3;
/// Rounding of sums of periods, s.
const ROUNDING_S: f64 = 1e-9;

impl Waypoints {
    /// Waypoints of a path; `None` if it has no two poses at rising times, is shorter than a quarter of a second, or
    /// does not move.
    #[must_use]
    pub fn of(path: &[RobotSample]) -> Option<Self> {
        let first = path.first()?;
        let all: Vec<Waypoint> = path
            .iter()
            .map(|p| Waypoint { time_s: (p.stamp_ns - first.stamp_ns) as f64 * 1e-9, pose: p.base_from_tool })
            .collect();
        if all.windows(2).any(|pair| pair[1].time_s <= pair[0].time_s) {
            return None;
        }
        let mut kept = vec![0];
        let mut from = 0;
        while let Some(to) = next_after(&all, from) {
            kept.push(to);
            from = to;
        }
        end_at_the_end(&all, &mut kept);
        if kept.len() < 2 || !moves(&all[0], &all[kept[1]]) {
            return None;
        }
        let (mut chord_m, mut chord_rad) = (0.0_f64, 0.0_f64);
        for pair in kept.windows(2) {
            let (off_m, off_rad) = chord(&all[pair[0]..=pair[1]]);
            (chord_m, chord_rad) = (chord_m.max(off_m), chord_rad.max(off_rad));
        }
        let list = kept.into_iter().map(|k| all[k]).collect();
        Some(Self { list, chord_m, chord_rad, reach_is_checked: false, axes: Vec::new() })
    }

    /// The same, with or without a check of its reach.
    #[must_use]
    pub fn with_reach(self, is_checked: bool) -> Self {
        Self { reach_is_checked: is_checked, ..self }
    }

    /// The same with external axes, each with a value at every waypoint.
    #[must_use]
    pub fn with_axes(self, axes: Vec<PathAxis>) -> Self {
        Self { axes, ..self }
    }

    /// Values of the external axes at a waypoint.
    pub(crate) fn axis_values(&self, waypoint: usize) -> impl Iterator<Item = f64> + '_ {
        self.axes.iter().map(move |axis| axis.values.get(waypoint).copied().unwrap_or(0.0))
    }

    /// Duration, s.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        self.list.last().map_or(0.0, |last| last.time_s)
    }

    /// Each move: where to, and how long it takes, s.
    pub fn moves(&self) -> impl Iterator<Item = (&Pose, f64)> {
        self.list.windows(2).map(|pair| (&pair[1].pose, pair[1].time_s - pair[0].time_s))
    }

    /// How far the moves leave the path, for a program's head.
    #[must_use]
    pub(crate) fn chords_in_words(&self) -> String {
        format!(
            "straight moves deviate from the planned path by at most {:.2} mm and {:.3} deg",
            self.chord_m * 1e3,
            self.chord_rad.to_degrees()
        )
    }
}

/// The waypoint after one: the last within reach of a straight move near the path, which moves and is not too soon.
fn next_after(all: &[Waypoint], from: usize) -> Option<usize> {
    let takes_s = |to: usize| all[to].time_s - all[from].time_s;
    let least = (from + 1..all.len())
        .find(|to| takes_s(*to) >= SHORTEST_S - ROUNDING_S && moves(&all[from], &all[*to]))?;
    let further = (least + 1..all.len()).take_while(|to| {
        let (off_m, off_rad) = chord(&all[from..=*to]);
        takes_s(*to) <= LONGEST_S && off_m <= CHORD_M && off_rad <= CHORD_RAD
    });
    further.last().or(Some(least))
}

/// The rest after the last waypoint belongs to the move that leads there.
fn end_at_the_end(all: &[Waypoint], kept: &mut Vec<usize>) {
    let last = all.len().saturating_sub(1);
    if kept.len() > 1 {
        kept.pop();
    }
    kept.push(last);
    let Some([from, to]) = kept.last_chunk::<2>().copied() else { return };
    // Two moves instead of a long one, where both are moves.
    let middle = (from + 1..to).find(|k| all[*k].time_s - all[from].time_s >= SHORTEST_S - ROUNDING_S);
    if let Some(middle) = middle {
        let rest_s = all[to].time_s - all[middle].time_s;
        if rest_s >= SHORTEST_S - ROUNDING_S
            && moves(&all[from], &all[middle])
            && moves(&all[middle], &all[to])
        {
            kept.insert(kept.len() - 1, middle);
        }
    }
}

fn moves(from: &Waypoint, to: &Waypoint) -> bool {
    (to.pose.translation.vector - from.pose.translation.vector).norm() >= LEAST_M
        || from.pose.rotation.angle_to(&to.pose.rotation) >= LEAST_RAD
}

/// How far poses are from a straight move from the first to the last.
fn chord(poses: &[Waypoint]) -> (f64, f64) {
    let (Some(first), Some(last)) = (poses.first(), poses.last()) else { return (0.0, 0.0) };
    poses.iter().fold((0.0, 0.0), |(most_m, most_rad): (f64, f64), between| {
        let share = (between.time_s - first.time_s) / (last.time_s - first.time_s);
        let straight = first.pose.lerp_slerp(&last.pose, share);
        let off_m = (straight.translation.vector - between.pose.translation.vector).norm();
        (most_m.max(off_m), most_rad.max(straight.rotation.angle_to(&between.pose.rotation)))
    })
}
