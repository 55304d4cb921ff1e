//! A scenario and a seed in, a recording with its truth out.

use crate::capture::{SheetAxes, measure, measured_of_curve, point_on_sheet, point_on_sheet_beside};
use crate::faults::{Fault, FeatureErrors, RobotErrors, SeamForms, line_beside};
use crate::motion::Motion;
use crate::noise::Noise;
use crate::scenario::{Scenario, SensorModel};
use crate::shutter::{Exposed, Receiver, Shutter};
use nalgebra::Vector3;
use trueline_dataset::sensor_setup::Mounted;
use trueline_dataset::{Feature, Guess, Measured, Recording, RobotSample, Sensor, SensorSetup, Truth};
use trueline_geometry::{Line, Pose, se3, so3};

/// Simulates a scan. The same scenario and seed give the same recording, bit for bit.
///
/// Returns `None` for a scenario without a line.
#[must_use]
pub fn simulate(scenario: &Scenario, seed: u64) -> Option<Recording> {
    let motion = Motion::new(scenario)?;
    Some(simulate_along(scenario, &|time_s| motion.base_from_tool(time_s), seed))
}

/// The same with a prescribed motion of the robot instead of [`Scenario::scan`]: `base_from_tool` gives its true pose
/// at a time since the start, s.
#[must_use]
pub fn simulate_along(scenario: &Scenario, base_from_tool: &dyn Fn(f64) -> Pose, seed: u64) -> Recording {
    // Only a robot that cannot reach its path fails; without faults this does not occur.
    record(scenario, base_from_tool, &[], seed).unwrap_or_else(|| unreachable!("a path without faults"))
}

/// The same scan with the sensor on a wall: the robot carries the part past it, and the sensor's pose in the tool becomes
/// that in base.
#[must_use]
pub fn on_the_wall(mut recording: Recording) -> Recording {
    for sample in &mut recording.robot {
        sample.base_from_tool = sample.base_from_tool.inverse();
    }
    recording.setup.mounted = Mounted::Fixed;
    recording
}

/// Simulates a scan by several sensors on one tool. The first is that of the scenario, and the robot moves for it. Each
/// of the others is up to 40 mm and 15° off the one before, with a time offset of its own. All report the same poses.
///
/// Returns `None` for a scenario without a line.
#[must_use]
pub fn simulate_sensors(scenario: &Scenario, count: u32, seed: u64) -> Option<Vec<Recording>> {
    let motion = Motion::new(scenario)?;
    let mut noise = Noise::new(seed, 41);
    let mut own = scenario.clone();
    let first = simulate(scenario, seed)?;
    let mut recordings = vec![first];
    for k in 1..count {
        let mut any = |most: f64| Vector3::from_fn(|_, _| noise.uniform(-most, most));
        let beside = se3::from_parts(so3::exp(&any(0.15)), any(0.02));
        own.cell.tool_from_camera *= beside;
        own.timing.time_offset_s = scenario.timing.time_offset_s + noise.uniform(-0.05, 0.05);
        let next =
            simulate_along(&own, &|time_s| motion.base_from_tool(time_s), seed.wrapping_add(u64::from(k)));
        recordings.push(Recording { robot: recordings[0].robot.clone(), ..next });
    }
    Some(recordings)
}

/// Simulates a scan with faults; the same scenario, faults and seed give the same recording, bit for bit.
///
/// Returns `None` for a scenario without a line, or an [arm](crate::arm) that cannot reach the path.
#[must_use]
pub fn simulate_with_faults(scenario: &Scenario, faults: &[Fault], seed: u64) -> Option<Recording> {
    let motion = Motion::new(scenario)?;
    let mut recording = record(scenario, &|time_s| motion.base_from_tool(time_s), faults, seed)?;
    for fault in faults {
        match fault {
            Fault::Sensor(error) => error.apply(&mut recording, &scenario.cell.sensor)?,
            Fault::Stream(error) => error.apply(&mut recording, scenario, seed),
            Fault::Event(event) => event.apply(&mut recording, scenario, seed)?,
            // These acted while the scan was cast.
            Fault::Seam(_) | Fault::Robot(_) | Fault::Feature(_) => {}
        }
    }
    Some(recording)
}

/// The recording of a scan along a path, with those faults that act while it is made.
fn record(
    scenario: &Scenario,
    base_from_tool: &dyn Fn(f64) -> Pose,
    faults: &[Fault],
    seed: u64,
) -> Option<Recording> {
    let parameters = Guess {
        time_offset_s: scenario.timing.time_offset_s,
        tool_from_camera: scenario.cell.tool_from_camera,
    };
    let robot = RobotErrors::new(scenario, base_from_tool, faults, seed)?;
    let samples = robot_samples(scenario, &|time_s| robot.reported(time_s), seed);
    let features = features(scenario, &|time_s| robot.actual(time_s), faults, seed);
    // A curve is no line: the truth of its form is in its own file.
    let lines = if scenario.cell.curve.is_some() { Vec::new() } else { scenario.cell.lines.clone() };
    let truth = Some(Truth { parameters, lines });
    let sensor = sensor(&scenario.cell.sensor);
    Some(Recording { truth, ..Recording::new(sensor, setup(), samples, features) })
}

/// The recording of a sensor that goes one way while the robot reports another, without faults.
pub(crate) fn record_reported(
    scenario: &Scenario,
    lines_from_tool: &dyn Fn(f64) -> Pose,
    reported: &dyn Fn(f64) -> Pose,
    seed: u64,
) -> Recording {
    let parameters = Guess {
        time_offset_s: scenario.timing.time_offset_s,
        tool_from_camera: scenario.cell.tool_from_camera,
    };
    let samples = robot_samples(scenario, reported, seed);
    let features = features(scenario, lines_from_tool, &[], seed);
    let truth = Some(Truth { parameters, lines: scenario.cell.lines.clone() });
    Recording { truth, ..Recording::new(sensor(&scenario.cell.sensor), setup(), samples, features) }
}

/// Prior knowledge of a simulated cell: its edge is sharp, and its seam has no form except a possible bow.
fn setup() -> SensorSetup {
    SensorSetup { edge_radius_m: Some(0.0), waviness_m: Some(0.0), ..SensorSetup::default() }
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

fn features(
    scenario: &Scenario,
    base_from_tool: &dyn Fn(f64) -> Pose,
    faults: &[Fault],
    seed: u64,
) -> Vec<Feature> {
    let disturbance = &scenario.disturbance;
    let sheet = SheetAxes::of(&scenario.cell.sensor);
    let (mut noise, mut chance) = (Noise::new(seed, 2), Noise::new(seed, 3));
    let mut shutter = Shutter::new(scenario);
    let mut errors = FeatureErrors::new(scenario, faults, seed);
    let view = View { scenario, sheet: &sheet, forms: SeamForms::of(scenario, faults, seed), base_from_tool };
    let mut features = Vec::new();
    for _ in 0..shutter.count() {
        let Exposed { frame, exposed_s, stamp_ns } = shutter.expose(&mut noise);
        errors.next_frame();
        if chance.happens(disturbance.drop_fraction) {
            continue;
        }
        for (line, truth) in scenario.cell.lines.iter().enumerate() {
            let Some(seen) = view.seen(truth, exposed_s, &mut errors) else { continue };
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
                correlation: 0.0,
            });
        }
    }
    features
}

/// The sensor's view of the seams.
struct View<'a> {
    scenario: &'a Scenario,
    sheet: &'a SheetAxes,
    forms: SeamForms,
    base_from_tool: &'a dyn Fn(f64) -> Pose,
}

impl View<'_> {
    /// The feature of a line without noise, in an image with its middle row exposed at a time, s.
    fn seen(&self, line: &Line, exposed_s: f64, errors: &mut FeatureErrors) -> Option<Measured> {
        let beside_m = errors.beside_m(exposed_s);
        let line = if beside_m == 0.0 { *line } else { line_beside(self.scenario, line, beside_m) };
        let shift = self.forms.in_base(errors.shift_m());
        let mut row_delay_s = 0.0;
        let (mut seen, mut base_from_camera) = self.seen_at(&line, exposed_s, &shift)?;
        // A row is exposed when its turn comes, and which row it is depends on when.
        for _ in 0..ROLLING_ROUNDS {
            let delay_s = errors.row_delay_s(&seen, &self.scenario.cell.sensor);
            if delay_s == row_delay_s {
                break;
            }
            row_delay_s = delay_s;
            (seen, base_from_camera) = self.seen_at(&line, exposed_s + delay_s, &shift)?;
        }
        Some(errors.biased(seen, &self.scenario.cell.sensor, self.sheet, &base_from_camera))
    }

    fn seen_at(&self, line: &Line, time_s: f64, shift: &Vector3<f64>) -> Option<(Measured, Pose)> {
        let base_from_camera = (self.base_from_tool)(time_s) * self.scenario.cell.tool_from_camera;
        let sensor = &self.scenario.cell.sensor;
        if let Some(curve) = &self.scenario.cell.curve {
            return Some((
                measured_of_curve(sensor, self.sheet, &base_from_camera, curve)?,
                base_from_camera,
            ));
        }
        let point = if self.forms.is_straight() && *shift == Vector3::zeros() {
            point_on_sheet(self.sheet, &base_from_camera, line)?
        } else {
            let beside = |along_m: f64| self.forms.displacement(along_m) + shift;
            point_on_sheet_beside(self.sheet, &base_from_camera, line, &beside)?
        };
        Some((measure(sensor, &point)?, base_from_camera))
    }
}

/// Each round gains the seam's speed over the rows' speed: a factor of fifty and more.
const ROLLING_ROUNDS: usize = 4;
