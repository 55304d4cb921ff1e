//! A scenario and a seed in, a recording with its truth out.

use crate::capture::{SheetAxes, measure, point_on_sheet};
use crate::motion::Motion;
use crate::noise::Noise;
use crate::scenario::{Scenario, SensorModel};
use crate::shutter::{Exposed, Receiver, Shutter};
use std::collections::BTreeMap;
use trueline_dataset::{Feature, Guess, Recording, RobotSample, Sensor, SensorSetup, Truth};
use trueline_geometry::Pose;

/// Simulates a scan. The same scenario and seed give the same recording, bit for bit.
///
/// Returns `None` for a scenario without a line.
#[must_use]
pub fn simulate(scenario: &Scenario, seed: u64) -> Option<Recording> {
    let motion = Motion::new(scenario)?;
    Some(simulate_along(scenario, &|time_s| motion.base_from_tool(time_s), seed))
}

/// The same where the robot moves as it is told instead of as [`Scenario::scan`] says: `base_from_tool` gives its
/// true pose at a time since the start, s.
#[must_use]
pub fn simulate_along(scenario: &Scenario, base_from_tool: &dyn Fn(f64) -> Pose, seed: u64) -> Recording {
    let parameters = Guess {
        time_offset_s: scenario.timing.time_offset_s,
        tool_from_camera: scenario.cell.tool_from_camera,
    };
    Recording {
        sensor: sensor(&scenario.cell.sensor),
        setup: SensorSetup::default(),
        robot: robot_samples(scenario, base_from_tool, seed),
        features: features(scenario, base_from_tool, seed),
        initial: None,
        truth: Some(Truth { parameters, lines: scenario.cell.lines.clone() }),
        inputs: BTreeMap::new(),
    }
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

fn robot_samples(scenario: &Scenario, base_from_tool: &dyn Fn(f64) -> Pose, seed: u64) -> Vec<RobotSample> {
    let (timing, disturbance) = (&scenario.timing, &scenario.disturbance);
    let mut noise = Noise::new(seed, 1);
    let mut receiver = Receiver::new(timing.start_ns);
    let count = (timing.duration_s / timing.robot_period_s).floor() as u64 + 1;
    (0..count)
        .map(|k| {
            let time_s = k as f64 * timing.robot_period_s;
            let base_from_tool = noise.pose(&base_from_tool(time_s), disturbance);
            let stamp_ns = receiver.stamp(time_s + noise.normal(disturbance.robot_jitter_s));
            RobotSample { stamp_ns, device_ns: None, base_from_tool }
        })
        .collect()
}

fn features(scenario: &Scenario, base_from_tool: &dyn Fn(f64) -> Pose, seed: u64) -> Vec<Feature> {
    let disturbance = &scenario.disturbance;
    let sheet = SheetAxes::of(&scenario.cell.sensor);
    let (mut noise, mut chance) = (Noise::new(seed, 2), Noise::new(seed, 3));
    let mut shutter = Shutter::new(scenario);
    let mut features = Vec::new();
    for _ in 0..shutter.count() {
        let Exposed { frame, exposed_s, stamp_ns } = shutter.expose(&mut noise);
        if chance.happens(disturbance.drop_fraction) {
            continue;
        }
        let base_from_camera = base_from_tool(exposed_s) * scenario.cell.tool_from_camera;
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
