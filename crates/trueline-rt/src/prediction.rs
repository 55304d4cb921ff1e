//! A pose beyond the last one: by the stream's own local fit, with the robot's possible motion meanwhile in its
//! uncertainty.

use crate::envelope_clock::Trust;
use crate::error::PlaceError;
use crate::located::Located;
use crate::pose_stream::PoseStream;
use crate::settings::Settings;
use nalgebra::SVector;
use trueline_geometry::local_polynomial::{coefficients, slope_at, value_at, weights_into};
use trueline_geometry::{se3, so3};

/// Fewest samples of a fit that is continued.
const FEWEST: usize = 5;
/// Most of them.
const MOST: usize = 64;

/// The pose at a time after the last one, s from the origin of the stream.
pub(crate) fn after(stream: &PoseStream, settings: &Settings, time_s: f64) -> Result<Located, PlaceError> {
    let times_s = &stream.times_s;
    let last = times_s.len() - 1;
    let by_s = time_s - times_s[last];
    let limit_s = settings.longest_prediction_s;
    if by_s > limit_s {
        return Err(PlaceError::PosesEnded { by_s, limit_s });
    }
    let first = first_of_fit(stream, settings)?;
    let window_s = times_s[last] - times_s[first];
    let at = by_s / window_s;
    let from = &stream.poses[last];
    let inverse = from.rotation.inverse();
    let motion = |k: usize| {
        let shift = stream.poses[k].translation.vector - from.translation.vector;
        let turn = so3::log(&(inverse * stream.poses[k].rotation));
        SVector::<f64, 6>::from([shift.x, shift.y, shift.z, turn.x, turn.y, turn.z])
    };
    let samples = (first..=last).map(|k| (times_s[k] - times_s[last], motion(k)));
    let fit = coefficients::<3, 6>(samples, window_s).ok_or(PlaceError::DoubtfulPoses)?;
    let value = |time: f64| (value_at::<3>(time).transpose() * fit).transpose();
    let (moved, rate) = (value(at), (slope_at::<3>(at).transpose() * fit).transpose() / window_s);
    let (shift, turn) = (moved.fixed_rows::<3>(0).into_owned(), moved.fixed_rows::<3>(3).into_owned());
    let (velocity, body_rate) = (rate.fixed_rows::<3>(0).into_owned(), rate.fixed_rows::<3>(3).into_owned());
    if velocity.norm() > settings.fastest_m_s || body_rate.norm() > settings.fastest_rad_s {
        return Err(PlaceError::DoubtfulPoses);
    }
    // A stream that its own fit does not describe is as noisy as the fit is off.
    let mut squares = [0.0; 2];
    for k in first..=last {
        let off = motion(k) - value((times_s[k] - times_s[last]) / window_s);
        squares[0] += off.fixed_rows::<3>(0).norm_squared();
        squares[1] += off.fixed_rows::<3>(3).norm_squared();
    }
    let free = 3.0 * (last - first + 1 - 3) as f64;
    let noise = stream.noise();
    let noise = [noise[0].max((squares[0] / free).sqrt()), noise[1].max((squares[1] / free).sqrt())];
    let by_noise = gain(&times_s[first..], window_s, at).ok_or(PlaceError::DoubtfulPoses)?;
    // The robot may have left the motion of the window since its middle.
    let since_s = by_s + 0.5 * window_s;
    let by_motion = 0.5 * since_s * since_s;
    let base_from_tool = se3::from_parts(from.rotation * so3::exp(&turn), from.translation.vector + shift);
    Ok(Located {
        base_from_tool,
        velocity,
        angular_velocity: base_from_tool.rotation * body_rate,
        sigma_m: (noise[0] * by_noise).hypot(settings.acceleration_m_s2 * by_motion),
        sigma_rad: (noise[1] * by_noise).hypot(settings.angular_acceleration_rad_s2 * by_motion),
        sigma_s: stream.samples[last].sigma_s,
        age_s: -by_s,
    })
}

/// Effect on the fit at a time of noise 1 in the samples, in units of the window.
fn gain(times_s: &[f64], window_s: f64, at: f64) -> Option<f64> {
    let (mut elapsed_s, mut weights) = ([0.0; MOST], [0.0; MOST]);
    let last_s = *times_s.last()?;
    for (elapsed, sample_s) in elapsed_s.iter_mut().zip(times_s) {
        *elapsed = sample_s - last_s;
    }
    let count = times_s.len().min(MOST);
    weights_into::<3>(&elapsed_s[..count], window_s, &value_at(at), &mut weights)?;
    Some(weights[..count].iter().map(|weight| weight * weight).sum::<f64>().sqrt())
}

/// The first sample of the fit: half the usual window back from the last one, and [`FEWEST`] at least; all joined and certain.
fn first_of_fit(stream: &PoseStream, settings: &Settings) -> Result<usize, PlaceError> {
    let times_s = &stream.times_s;
    let last = times_s.len() - 1;
    let mut first = last;
    while first > 0 && last - first + 1 < MOST {
        let is_far = times_s[last] - times_s[first - 1] > settings.half_window_s * (1.0 + 1e-9);
        if is_far && last - first + 1 >= FEWEST {
            break;
        }
        let step_s = times_s[first] - times_s[first - 1];
        if step_s > stream.gap_limit_s() {
            return Err(PlaceError::InGap { gap_s: step_s });
        }
        if stream.samples[first - 1].trust == Trust::QueuedBefore {
            return Err(PlaceError::DoubtfulPoses);
        }
        first -= 1;
    }
    let are_certain = stream.samples[last].trust != Trust::QueuedBefore && last - first + 1 >= FEWEST;
    if are_certain { Ok(first) } else { Err(PlaceError::DoubtfulPoses) }
}
