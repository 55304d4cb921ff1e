//! Scans of any size: one simulated scan, repeated in time. Shared by benchmarks and by the study `scaling`.
#![allow(dead_code, clippy::unwrap_used, reason = "programs use a part each; a failure panics")]

use trueline_geometry::Trajectory;
use trueline_method::input::noise_levels::NoiseLevels;
use trueline_method::input::observations::{self, Observation, Observations};
use trueline_method::input::timestamps::Sampling;
use trueline_method::{Config, Parameters};
use trueline_sim::{Preset, simulate};

/// Noise for these scans.
pub(crate) const NOISE: NoiseLevels = NoiseLevels { robot_sigma_m: 1.5e-5, stamp_sigma_s: 0.0, factor: 1.0 };

/// Observations of about this number of features, and the truth. The robot is sampled at 250 Hz, the camera at 33 Hz.
pub(crate) fn of_features(count: usize) -> (Observations, Parameters) {
    let recording = simulate(&Preset::Quick.scenario(), 1).unwrap();
    let sampling = Sampling::of(&recording, observations::origin_ns(&recording));
    let mut observed = observations::observe(&recording, &sampling, &Config::default()).unwrap();
    let truth = recording.truth.unwrap();
    let at = Parameters::straight(&truth.parameters, truth.lines);
    let times = observed.robot.trajectory.times().to_vec();
    let poses: Vec<_> = times.iter().map(|t| observed.robot.trajectory.pose_at(*t).unwrap()).collect();
    // A pause of a second, so that no segment connects successive scans.
    let lasts_s = times[times.len() - 1] - times[0] + 1.0;
    let base = observed.list.clone();
    let scans = count.div_ceil(base.len());
    let mut list: Vec<Observation> = Vec::with_capacity(count);
    let (mut all_times, mut all_poses) = (Vec::new(), Vec::new());
    for scan in 0..scans {
        let later = scan as f64 * lasts_s;
        all_times.extend(times.iter().map(|t| t + later));
        all_poses.extend_from_slice(&poses);
        let left = count - list.len();
        list.extend(base.iter().take(left).map(|o| Observation { stamp_s: o.stamp_s + later, ..*o }));
    }
    observed.robot.trajectory = Trajectory::new(all_times, &all_poses).unwrap();
    observed.list = list;
    (observed, at)
}
