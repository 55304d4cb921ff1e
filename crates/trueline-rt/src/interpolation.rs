//! The pose of the robot at a time between its samples: by the interpolation of the estimate.
//!
//! A local quadratic removes the noise of the samples, if there is any. A curve through up to three of them
//! on either side gives the pose between. Close samples without noise are joined straight. So does
//! `calibrate`.

use crate::envelope_clock::Trust;
use crate::error::PlaceError;
use crate::located::Located;
use crate::pose_stream::{FEWEST_POSES, PoseStream};
use crate::prediction;
use crate::settings::Settings;
use trueline_geometry::curve::{self, MOST_NODES};
use trueline_geometry::smooth::noise_left;
use trueline_geometry::{Pose, so3};

/// Below this noise, poses are used as recorded, m.
const SMOOTH_ABOVE_M: f64 = 1e-6;
/// For so long a robot's path is straight at most, s.
const STRAIGHT_S: f64 = 0.005;
/// A step of more periods than this bridges lost samples.
const LOST: f64 = 1.5;
/// A sample further from the local fit than this many times the noise is an outlier, which is in the fit as well.
const OUTLYING: f64 = 6.0;
/// A step over lost samples was made by a clock if its length contradicts the motion around it by this many standard
/// deviations.
const CONTRADICTION: f64 = 4.0;

/// Pose of the robot at a time, s from the origin of the stream.
pub(crate) fn at(stream: &PoseStream, settings: &Settings, time_s: f64) -> Result<Located, PlaceError> {
    if !stream.is_settled() {
        return Err(PlaceError::Unsettled { poses: stream.times_s.len(), needed: FEWEST_POSES });
    }
    let times_s = &stream.times_s;
    let (first_s, last_s) = (times_s[0], times_s[times_s.len() - 1]);
    if time_s < first_s {
        return Err(PlaceError::BeforePoses { by_s: first_s - time_s });
    }
    if time_s > last_s {
        return prediction::after(stream, settings, time_s);
    }
    // At the very end the last segment.
    let after = times_s.partition_point(|sample_s| *sample_s <= time_s).min(times_s.len() - 1);
    between(stream, settings, after - 1, time_s)
}

/// The same in the segment that begins at a sample.
fn between(stream: &PoseStream, settings: &Settings, j: usize, time_s: f64) -> Result<Located, PlaceError> {
    let times_s = &stream.times_s;
    let step_s = times_s[j + 1] - times_s[j];
    let gap_limit_s = stream.gap_limit_s();
    if step_s > gap_limit_s {
        return Err(PlaceError::InGap { gap_s: step_s });
    }
    let nodes = curve::nodes(times_s, j, gap_limit_s);
    if stream.samples[nodes.clone()].iter().any(|sample| sample.trust == Trust::QueuedBefore)
        || stream.samples[j..=j + 1].iter().any(|sample| sample.trust != Trust::Sure)
    {
        return Err(PlaceError::DoubtfulPoses);
    }
    let noise = stream.noise();
    let is_smoothed =
        noise[0] > SMOOTH_ABOVE_M && noise_left(stream.period_s(), settings.half_window_s) < 1.0;
    let nodes = if !is_smoothed && step_s <= STRAIGHT_S { j..j + 2 } else { nodes };
    let mut poses = [Pose::identity(); MOST_NODES];
    let (mut left, mut outlying_m) = ([1.0; MOST_NODES], 0.0_f64);
    for ((pose, left), k) in poses.iter_mut().zip(&mut left).zip(nodes.clone()) {
        if is_smoothed {
            let smoothed = stream.smoothed(k);
            (*pose, *left) = (smoothed.pose, smoothed.variance_left);
            let off = stream.poses[k].translation.vector - smoothed.pose.translation.vector;
            outlying_m = outlying_m.max(off.norm() - OUTLYING * noise[0]);
        } else {
            *pose = stream.poses[k];
        }
    }
    let anchor = j - nodes.start;
    let base_from_tool = curve::pose_through(&times_s[nodes.clone()], &poses[..nodes.len()], anchor, time_s);
    let (from, to) = (&poses[anchor], &poses[anchor + 1]);
    let velocity = (to.translation.vector - from.translation.vector) / step_s;
    let body_rate = so3::log(&(from.rotation.inverse() * to.rotation)) / step_s;
    if velocity.norm() > settings.fastest_m_s || body_rate.norm() > settings.fastest_rad_s {
        return Err(PlaceError::DoubtfulPoses);
    }
    let part = left[anchor].max(left[anchor + 1]).sqrt();
    let bridged = bridged(stream, settings, j)?;
    Ok(Located {
        base_from_tool,
        velocity,
        angular_velocity: base_from_tool.rotation * body_rate,
        sigma_m: (noise[0] * part).hypot(bridged[0]).hypot(outlying_m),
        sigma_rad: (noise[1] * part).hypot(bridged[1]),
        sigma_s: stream.samples[j].sigma_s.max(stream.samples[j + 1].sigma_s),
        age_s: times_s[times_s.len() - 1] - time_s,
    })
}

/// Uncertainty of the motion where samples were lost, m and rad: an acceleration a between bends the path by
/// a T²/8.
///
/// If the path before and after contradicts the elapsed time, the clock jumped.
fn bridged(stream: &PoseStream, settings: &Settings, j: usize) -> Result<[f64; 2], PlaceError> {
    let times_s = &stream.times_s;
    let (period_s, step_s) = (stream.period_s(), times_s[j + 1] - times_s[j]);
    if step_s <= LOST * period_s {
        return Ok([0.0; 2]);
    }
    let square_s2 = step_s * step_s - period_s * period_s;
    let by = [settings.acceleration_m_s2, settings.angular_acceleration_rad_s2].map(|a| a * square_s2 / 8.0);
    let noise_m = stream.noise()[0];
    let over = |k: usize| {
        let moved = stream.poses[k + 1].translation.vector - stream.poses[k].translation.vector;
        (moved, times_s[k + 1] - times_s[k])
    };
    let (moved, _) = over(j);
    for beside in [j.checked_sub(1), Some(j + 1)].into_iter().flatten().filter(|k| k + 1 < times_s.len()) {
        let (there, there_s) = over(beside);
        if there_s > LOST * period_s || there_s <= 0.0 {
            continue;
        }
        let times = step_s / there_s;
        // An acceleration a between the middles of two steps, and the noise of four poses.
        let apart_m = settings.acceleration_m_s2 * step_s * 0.5 * (step_s + there_s);
        let tolerance_m = CONTRADICTION * apart_m.hypot(noise_m * (2.0 * (1.0 + times * times)).sqrt());
        if (moved - there * times).norm() > tolerance_m {
            return Err(PlaceError::DoubtfulPoses);
        }
    }
    Ok(by)
}
