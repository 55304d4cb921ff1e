//! Recorded poses → the robot's path over time, with its noise.

use crate::config::{Config, ResidualKind};
use crate::error::Error;
use crate::input::axis_chain::AxisChain;
use crate::input::repeated_poses::{self, Updates};
use crate::input::stops;
use crate::order_statistics::median;
use nalgebra::{Point3, Vector3};
use std::sync::Arc;
use trueline_dataset::{Recording, RobotSample};
use trueline_geometry::trajectory::{GAP_PERIODS, TrajectoryError, median_period_s};
use trueline_geometry::{Pose, Trajectory, curve, smooth};

/// The robot's motion with its noise.
#[derive(Clone, Debug)]
pub struct RobotMotion {
    /// Poses over time since the start of the recording.
    pub trajectory: Trajectory,
    /// Median time between the samples, s.
    pub period_s: f64,
    /// Noise of a recorded position, per axis, as measured on the stream, m.
    pub recorded_noise_m: f64,
    /// Remaining noise of the trajectory, m.
    pub noise_m: f64,
    /// Whether the trajectory is a local fit to the recorded poses.
    pub smoothed: bool,
    /// Half the window of that fit, s.
    pub half_window_s: f64,
    /// Samples that only repeat the previous pose while the robot moves. They are removed.
    pub repeated: usize,
    /// Standard deviation of the delay of the remaining samples, s.
    pub late_sigma_s: f64,
    /// The external axes, whose motion the path contains.
    pub(crate) axes: Option<Arc<AxisChain>>,
}

/// Robot noise below this is negligible, and poses are used as recorded: a twentieth of the feature's own contribution.
const SMOOTH_ABOVE_M: f64 = 1e-6;
/// Half a window as a fraction of the frame interval. The remaining noise after a local quadratic is then not shared by two images (its correlation
/// crosses zero at 1.25 times half a window).
const UNSHARED: f64 = 0.8;
/// Longest straight piece of a robot's path, s. At 2 m/s² it bends by 2 · T²/8 = 6 µm.
const STRAIGHT_S: f64 = 0.005;
/// Largest bend of a straight piece, m. Straight pieces have corners at the same places of the path in every frame. These small errors are not
/// noise, and they bias a scan with little other information on the time offset.
const LEAST_BEND_M: f64 = 0.5e-6;
/// Shorter pieces are unnecessary: at 10 m/s², which no arm reaches with a sensor, they bend by 0.3 µm.
const SHORTEST_S: f64 = 0.0005;
/// Accelerations are second differences over this time, s. Noise of 0.03 mm then looks like 0.08 m/s², for which 5 ms are straight. They keep 87 %
/// of a 5 Hz swing.
const ACCELERATION_S: f64 = 0.04;
/// Half of the samples are two periods apart, and three on each side bend the path between two of them, with margin.
const REACH_PERIODS: f64 = 16.0;
/// Distance of the sensor's field from the tool's origin, m. Half a metre at most.
const LEVER_M: f64 = 0.25;
/// Longest time between poses, s. Above it the motion of a robot that swings the sensor once in two seconds is unknown. It also limits the size of
/// the path, which has pieces of [`STRAIGHT_S`] for any time between stamps.
const LONGEST_PERIOD_S: f64 = 0.5;
/// A robot that stays within this shift and [`LEAST_TURN_RAD`] is standing.
const LEAST_SHIFT_M: f64 = 1e-4;
/// See [`LEAST_SHIFT_M`].
const LEAST_TURN_RAD: f64 = 2e-4;

impl RobotMotion {
    /// The motion over `times_s`, one for each distinct stamp.
    ///
    /// # Errors
    /// A robot stream that is no trajectory, or does not move.
    pub fn of(recording: &Recording, times_s: &[f64], config: &Config) -> Result<Self, Error> {
        if recording.at_stops {
            return Self::at_stops(recording, times_s);
        }
        let axes = AxisChain::of(recording)?.map(Arc::new);
        let (times, poses, updates) = news(recording, times_s, axes.as_deref());
        check_motion(&poses)?;
        let period_s = median_period_s(&times).map_err(Error::Trajectory)?;
        if period_s > LONGEST_PERIOD_S {
            return Err(Error::RobotTooSlow { period_s, most_s: LONGEST_PERIOD_S });
        }
        let gap_limit_s = GAP_PERIODS * period_s;
        let recorded_noise_m = smooth::position_noise(&times, &poses, period_s, gap_limit_s);
        // The paper's residual uses the paper's motion: straight between the recorded samples.
        let as_recorded = config.residual == ResidualKind::PointToLine;
        // If the usual window contains enough samples, no wider one is needed.
        let half_window_s = if smooth::noise_left(period_s, smooth::HALF_WINDOW_S) < 1.0 {
            smooth::HALF_WINDOW_S
        } else {
            let most_s = frame_period_s(recording) * UNSHARED;
            smooth::half_window_s(&times, &poses, gap_limit_s, recorded_noise_m, most_s)
        };
        let noise_left = smooth::noise_left(period_s, half_window_s);
        let smoothed = !as_recorded && recorded_noise_m > SMOOTH_ABOVE_M && noise_left < 1.0;
        let window_s = smoothed.then_some(half_window_s);
        let straight_s =
            if as_recorded { f64::INFINITY } else { straight_s(&times, &poses, recorded_noise_m) };
        let trajectory = path(times, poses, gap_limit_s, window_s, straight_s);
        let trajectory = trajectory.map_err(Error::Trajectory)?;
        Ok(Self {
            trajectory,
            period_s,
            recorded_noise_m,
            noise_m: recorded_noise_m * if smoothed { noise_left } else { 1.0 },
            smoothed,
            half_window_s,
            repeated: updates.repeated,
            late_sigma_s: updates.late_sigma_s,
            axes,
        })
    }

    /// A robot that stands at each of its samples: without velocity, and without noise between samples.
    fn at_stops(recording: &Recording, times_s: &[f64]) -> Result<Self, Error> {
        let axes = AxisChain::of(recording)?.map(Arc::new);
        let pose = |(sample, time_s): (&RobotSample, &f64)| {
            let without_axes = recording.lines_from_carrier(sample);
            match &axes {
                None => Ok(without_axes),
                Some(axes) => axes.lines_from_carrier(&without_axes, *time_s).ok_or(Error::AxesNotThere {
                    why: "at a stop where an axis has no value; log it over the whole scan",
                }),
            }
        };
        let poses: Vec<Pose> = recording.robot.iter().zip(times_s).map(pose).collect::<Result<_, _>>()?;
        check_motion(&poses)?;
        Ok(Self {
            period_s: median_period_s(times_s).map_err(Error::Trajectory)?,
            trajectory: stops::path(times_s, &poses).map_err(Error::Trajectory)?,
            recorded_noise_m: 0.0,
            noise_m: 0.0,
            smoothed: false,
            half_window_s: 0.0,
            repeated: 0,
            late_sigma_s: 0.0,
            axes,
        })
    }

    /// Remaining noise of the robot's attitudes in its path, rad per axis. The remaining fraction is that of the positions, and the noise is
    /// measured on the same samples. `times_s` as for [`RobotMotion::of`].
    #[must_use]
    pub(crate) fn rotation_noise_rad(&self, recording: &Recording, times_s: &[f64]) -> f64 {
        if recording.at_stops {
            return 0.0;
        }
        let (times, poses, _) = news(recording, times_s, self.axes.as_deref());
        let recorded = smooth::rotation_noise(&times, &poses, self.period_s, GAP_PERIODS * self.period_s);
        if self.recorded_noise_m > 0.0 { recorded * self.noise_m / self.recorded_noise_m } else { recorded }
    }

    /// The same motion near these times (s, rising) by every other sample, and by those between, with independent noise. `None` for a stream that is
    /// too short, and for stops, which have no stream noise.
    #[must_use]
    pub fn halves(&self, recording: &Recording, times_s: &[f64], about_s: &[f64]) -> Option<[Trajectory; 2]> {
        if recording.at_stops {
            return None;
        }
        let (times, poses, _) = news(recording, times_s, self.axes.as_deref());
        let straight_s = straight_s(&times, &poses, self.recorded_noise_m);
        let every_other = |first: usize| {
            let samples = times.iter().copied().zip(poses.iter().copied()).skip(first).step_by(2);
            self.near(samples, about_s, 2.0 * GAP_PERIODS * self.period_s, straight_s)
        };
        Some([every_other(0)?, every_other(1)?])
    }

    /// The path near some times (s, rising) with the samples taken at `times_s`, with gaps elsewhere. `None` with too few samples.
    #[must_use]
    pub(crate) fn about(
        &self,
        recording: &Recording,
        times_s: &[f64],
        about_s: &[f64],
    ) -> Option<Trajectory> {
        let (times, poses, _) = news(recording, times_s, self.axes.as_deref());
        let straight_s = straight_s(&times, &poses, self.recorded_noise_m);
        self.near(times.into_iter().zip(poses), about_s, GAP_PERIODS * self.period_s, straight_s)
    }

    /// The path near these times, through the samples that affect it.
    fn near(
        &self,
        samples: impl Iterator<Item = (f64, Pose)>,
        about_s: &[f64],
        gap_limit_s: f64,
        straight_s: f64,
    ) -> Option<Trajectory> {
        let reach_s = self.half_window_s + REACH_PERIODS * self.period_s;
        let mut about = about_s.iter().copied().peekable();
        let mut is_near = |time_s: f64| {
            while about.next_if(|about_s| *about_s < time_s - reach_s).is_some() {}
            about.peek().is_some_and(|about_s| *about_s <= time_s + reach_s)
        };
        let (times, poses): (Vec<f64>, Vec<Pose>) = samples.filter(|(time_s, _)| is_near(*time_s)).unzip();
        path(times, poses, gap_limit_s, self.smoothed.then_some(self.half_window_s), straight_s).ok()
    }
}

/// The samples with new poses, and their times. Samples without a value of an axis are left out.
fn news(recording: &Recording, times_s: &[f64], axes: Option<&AxisChain>) -> (Vec<f64>, Vec<Pose>, Updates) {
    // If several samples have one stamp, the last is used.
    let last_of_each = |pair: &&[RobotSample]| pair[0].stamp_ns != pair[1].stamp_ns;
    let before_last = recording.robot.windows(2).filter(last_of_each).map(|pair| &pair[0]);
    let last_of_each = before_last.chain(recording.robot.last());
    let without_axes = last_of_each.map(|sample| recording.lines_from_carrier(sample));
    let (kept, mut poses): (Vec<f64>, Vec<Pose>) = match axes {
        None => (Vec::new(), without_axes.collect()),
        Some(axes) => times_s
            .iter()
            .zip(without_axes)
            .filter_map(|(time_s, pose)| Some((*time_s, axes.lines_from_carrier(&pose, *time_s)?)))
            .unzip(),
    };
    let times_s = if axes.is_some() { &kept } else { times_s };
    let updates = repeated_poses::updates(times_s, &poses);
    let times = updates.kept.iter().map(|k| times_s[*k] - updates.late_s).collect();
    for (to, from) in updates.kept.iter().enumerate() {
        poses[to] = poses[*from];
    }
    poses.truncate(updates.kept.len());
    let (times, poses) = without_queued(times, poses);
    (times, poses, updates)
}

/// A pose that is followed by another within this fraction of a period waited in a queue. The speed between the two is wrong.
const QUEUED: f64 = 0.1;
/// Largest fraction of such samples. With more of them the period is unknown.
const MOST_QUEUED: f64 = 0.2;

/// Removes poses stamped together with a later one, which is the correct one at that time.
fn without_queued(times: Vec<f64>, poses: Vec<Pose>) -> (Vec<f64>, Vec<Pose>) {
    let steps = || times.windows(2).map(|pair| pair[1] - pair[0]);
    let least_s = QUEUED * median(steps()).unwrap_or(0.0);
    let queued = steps().filter(|step_s| *step_s < least_s).count();
    if queued == 0 || queued as f64 > MOST_QUEUED * times.len() as f64 {
        return (times, poses);
    }
    let is_last = |k: &usize| times.get(k + 1).is_none_or(|next_s| next_s - times[*k] >= least_s);
    (0..times.len()).filter(is_last).map(|k| (times[k], poses[k])).unzip()
}

/// Median frame interval, s.
fn frame_period_s(recording: &Recording) -> f64 {
    let steps = recording.features.windows(2).map(|pair| (pair[1].stamp_ns - pair[0].stamp_ns) as f64 * 1e-9);
    median(steps.filter(|step_s| *step_s > 0.0)).unwrap_or(0.0)
}

/// The path through samples. Their noise is smoothed over half a window (s). The path is curved where the samples are further apart than a straight
/// piece (s).
fn path(
    times: Vec<f64>,
    mut poses: Vec<Pose>,
    gap_limit_s: f64,
    half_window_s: Option<f64>,
    straight_s: f64,
) -> Result<Trajectory, TrajectoryError> {
    if let Some(half_s) = half_window_s {
        poses = smooth::local_quadratic(&times, &poses, gap_limit_s, half_s);
    }
    if times.windows(2).any(|pair| pair[1] - pair[0] > straight_s) {
        let (times, poses) = curve::densified(&times, &poses, gap_limit_s, straight_s);
        return Trajectory::new(times, &poses);
    }
    Trajectory::new(times, &poses)
}

/// Duration of a straight piece of the path, s: a sine of its acceleration bends by √2 a T²/8. Noise-free samples are used as they are.
fn straight_s(times: &[f64], poses: &[Pose], noise_m: f64) -> f64 {
    if noise_m <= SMOOTH_ABOVE_M {
        return STRAIGHT_S;
    }
    let acceleration = acceleration_m_s2(times, poses);
    (8.0 * LEAST_BEND_M / (std::f64::consts::SQRT_2 * acceleration)).sqrt().clamp(SHORTEST_S, STRAIGHT_S)
}

/// RMS acceleration of a point at [`LEVER_M`] from the tool's origin, m/s².
fn acceleration_m_s2(times: &[f64], poses: &[Pose]) -> f64 {
    let lever = Point3::from(Vector3::repeat(LEVER_M / 3.0_f64.sqrt()));
    let (mut sum, mut count) = (0.0, 0);
    let mut first = 0;
    while let Some(middle) = later(times, first) {
        let Some(last) = later(times, middle) else { break };
        let [before, now, after] = [first, middle, last].map(|k| poses[k] * lever);
        let (step, next) = (times[middle] - times[first], times[last] - times[middle]);
        // The motion within a gap is unknown.
        if step.max(next) < 2.0 * ACCELERATION_S {
            let change = (after - now) / next - (now - before) / step;
            sum += (change * (2.0 / (step + next))).norm_squared();
            count += 1;
        }
        first = middle;
    }
    (sum / f64::from(count.max(1))).sqrt()
}

/// The first sample that is [`ACCELERATION_S`] or more after another.
fn later(times: &[f64], from: usize) -> Option<usize> {
    let after = times[from..].iter().position(|time| *time >= times[from] + ACCELERATION_S)?;
    Some(from + after)
}

fn check_motion(poses: &[Pose]) -> Result<(), Error> {
    let Some(first) = poses.first() else { return Ok(()) };
    let (mut shift_m, mut turn_rad) = (0.0_f64, 0.0_f64);
    for pose in poses {
        shift_m = shift_m.max((pose.translation.vector - first.translation.vector).norm());
        turn_rad = turn_rad.max(first.rotation.angle_to(&pose.rotation));
        if shift_m > LEAST_SHIFT_M || turn_rad > LEAST_TURN_RAD {
            return Ok(());
        }
    }
    Err(Error::RobotStandsStill { shift_mm: shift_m * 1e3, turn_deg: turn_rad.to_degrees() })
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::RobotMotion;
    use crate::config::Config;
    use trueline_sim::{Preset, simulate};

    #[test]
    fn halves_about_some_times_are_those_of_the_whole_path() {
        let recording = simulate(&Preset::Good.scenario(), 1).unwrap();
        let first_ns = recording.robot[0].stamp_ns;
        let times_s: Vec<f64> =
            recording.robot.iter().map(|sample| (sample.stamp_ns - first_ns) as f64 * 1e-9).collect();
        let motion = RobotMotion::of(&recording, &times_s, &Config::default()).unwrap();
        assert!(motion.smoothed);
        let about_s = [0.7, 0.71, 5.0, 12.3];
        let some = motion.halves(&recording, &times_s, &about_s).unwrap();
        let all = motion.halves(&recording, &times_s, &times_s).unwrap();
        for (some, all) in some.iter().zip(&all) {
            for time_s in about_s {
                assert_eq!(some.pose_at(time_s).unwrap(), all.pose_at(time_s).unwrap());
            }
            assert!(some.times().len() * 10 < all.times().len());
            assert!(some.pose_at(3.0).is_none() && all.pose_at(3.0).is_some());
        }
        assert_ne!(some[0].pose_at(5.0), some[1].pose_at(5.0));
        let whole = motion.about(&recording, &times_s, &about_s).unwrap();
        for time_s in about_s {
            assert_eq!(whole.pose_at(time_s).unwrap(), motion.trajectory.pose_at(time_s).unwrap());
        }
        assert!(whole.pose_at(3.0).is_none() && whole.times().len() * 10 < times_s.len());
    }
}
