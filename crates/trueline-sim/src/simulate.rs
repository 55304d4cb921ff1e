//! A scenario and a seed in, a recording with its truth out.

use crate::capture::{SheetAxes, measure, point_on_sheet};
use crate::motion::Motion;
use crate::noise::Noise;
use crate::scenario::{Scenario, SensorModel};
use std::collections::BTreeMap;
use trueline_dataset::{Feature, Guess, Recording, RobotSample, Sensor, Truth};

/// Simulates a scan. The same scenario and seed give the same recording, bit for bit.
///
/// Returns `None` for a scenario without a line.
#[must_use]
pub fn simulate(scenario: &Scenario, seed: u64) -> Option<Recording> {
    let motion = Motion::new(scenario)?;
    let parameters = Guess {
        time_offset_s: scenario.timing.time_offset_s,
        tool_from_camera: scenario.cell.tool_from_camera,
    };
    Some(Recording {
        sensor: sensor(&scenario.cell.sensor),
        robot: robot_samples(scenario, &motion, seed),
        features: features(scenario, &motion, seed),
        initial: None,
        truth: Some(Truth { parameters, lines: scenario.cell.lines.clone() }),
        inputs: BTreeMap::new(),
    })
}

fn sensor(model: &SensorModel) -> Sensor {
    match model {
        SensorModel::CameraLaser { camera, laser_plane_in_camera } => {
            Sensor::CameraLaser { camera: *camera, laser_plane_in_camera: *laser_plane_in_camera }
        }
        SensorModel::Profiler { .. } => Sensor::Profiler,
        SensorModel::Points { laser_plane_in_camera, .. } => {
            Sensor::Points { laser_plane_in_camera: Some(*laser_plane_in_camera) }
        }
    }
}

/// Writes stamps as a receiver does: whole nanoseconds, never before the one that came earlier.
struct Receiver {
    start_ns: i64,
    last_ns: i64,
}

impl Receiver {
    fn new(start_ns: i64) -> Self {
        Self { start_ns, last_ns: i64::MIN }
    }

    fn stamp(&mut self, time_s: f64) -> i64 {
        self.last_ns = self.last_ns.max(self.start_ns + (time_s * 1e9).round() as i64);
        self.last_ns
    }
}

fn robot_samples(scenario: &Scenario, motion: &Motion<'_>, seed: u64) -> Vec<RobotSample> {
    let (timing, disturbance) = (&scenario.timing, &scenario.disturbance);
    let mut noise = Noise::new(seed, 1);
    let mut receiver = Receiver::new(timing.start_ns);
    let count = (timing.duration_s / timing.robot_period_s).floor() as u64 + 1;
    (0..count)
        .map(|k| {
            let time_s = k as f64 * timing.robot_period_s;
            let base_from_tool = noise.pose(&motion.base_from_tool(time_s), disturbance);
            let stamp_ns = receiver.stamp(time_s + noise.normal(disturbance.robot_jitter_s));
            RobotSample { stamp_ns, device_ns: None, base_from_tool }
        })
        .collect()
}

fn features(scenario: &Scenario, motion: &Motion<'_>, seed: u64) -> Vec<Feature> {
    let (timing, disturbance) = (&scenario.timing, &scenario.disturbance);
    let sheet = SheetAxes::of(&scenario.cell.sensor);
    let (mut noise, mut chance) = (Noise::new(seed, 2), Noise::new(seed, 3));
    let mut receiver = Receiver::new(timing.start_ns);
    let mut features = Vec::new();
    // The first image is exposed half a period into the recording.
    let count = (timing.duration_s / timing.frame_period_s - 0.5).floor() as u64;
    for frame in 0..count {
        // Exposures fall on whole nanoseconds of the stamp, so that writing them loses nothing.
        let exposed_s = (frame as f64 + 0.5) * timing.frame_period_s;
        let stamp_s = exposed_s * (1.0 + disturbance.clock_drift_ppm * 1e-6) + timing.time_offset_s;
        let rounding_s = (stamp_s * 1e9).round() * 1e-9 - stamp_s;
        let stamp_ns = receiver.stamp(stamp_s + noise.normal(disturbance.frame_jitter_s));
        if chance.happens(disturbance.drop_fraction) {
            continue;
        }
        let base_from_camera = motion.base_from_tool(exposed_s + rounding_s) * scenario.cell.tool_from_camera;
        for (line, truth) in scenario.cell.lines.iter().enumerate() {
            let seen = point_on_sheet(&sheet, &base_from_camera, truth)
                .and_then(|point| measure(&scenario.cell.sensor, &point));
            let Some(seen) = seen else { continue };
            let measured = if chance.happens(disturbance.outlier_fraction) {
                chance.outlier(&scenario.cell.sensor, &sheet)
            } else {
                noise.feature(&seen, &sheet, disturbance)
            };
            features.push(Feature {
                stamp_ns,
                line: line as u32,
                frame: Some(frame),
                device_ns: None,
                measured,
                sigma: None,
            });
        }
    }
    features
}
