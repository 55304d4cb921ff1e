//! A robot that is not at its reported pose.

use super::fault::{Fault, RobotError};
use crate::arm::Arm;
use crate::motion::Motion;
use crate::noise::Noise;
use crate::scenario::Scenario;
use nalgebra::{UnitQuaternion, Vector3};
use std::f64::consts::TAU;
use trueline_geometry::{Pose, se3, so3};

/// The robot's reported and true motion.
pub(crate) struct RobotErrors<'a> {
    path: &'a dyn Fn(f64) -> Pose,
    errors: Vec<Prepared>,
}

/// An error with its random part drawn.
enum Prepared {
    Position(Field),
    Attitude(Field),
    Arm(Box<Arm>),
    Flex(f64),
    Backlash(Play),
    CommandLag(f64),
    AttitudeLag(f64),
}

impl<'a> RobotErrors<'a> {
    /// The errors along a path; `None` if an arm cannot reach it.
    pub(crate) fn new(
        scenario: &Scenario,
        path: &'a dyn Fn(f64) -> Pose,
        faults: &[Fault],
        seed: u64,
    ) -> Option<Self> {
        let mut errors = Vec::new();
        for (index, fault) in faults.iter().enumerate() {
            let Fault::Robot(error) = *fault else { continue };
            let noise = Noise::for_fault(seed, index);
            errors.push(match error {
                RobotError::PositionField { rms_m, wavelength_m } => {
                    Prepared::Position(Field::new(noise, rms_m, wavelength_m))
                }
                RobotError::AttitudeField { rms_rad, wavelength_m } => {
                    Prepared::Attitude(Field::new(noise, rms_rad, wavelength_m))
                }
                RobotError::Arm { rms_m } => Prepared::Arm(Box::new(arm(scenario, path, noise, rms_m)?)),
                RobotError::Flex { m_per_m_s2 } => Prepared::Flex(m_per_m_s2),
                RobotError::Backlash { width_m } => {
                    Prepared::Backlash(Play::new(path, width_m, scenario.timing.duration_s))
                }
                RobotError::CommandLag { time_constant_s } => Prepared::CommandLag(time_constant_s),
                RobotError::AttitudeLag { lag_s } => Prepared::AttitudeLag(lag_s),
            });
        }
        Some(Self { path, errors })
    }

    /// The stream's report at a time since the start, s, without noise.
    pub(crate) fn reported(&self, time_s: f64) -> Pose {
        let mut pose = (self.path)(time_s);
        for error in &self.errors {
            if let Prepared::AttitudeLag(lag_s) = error {
                pose.rotation = (self.path)(time_s - lag_s).rotation;
            }
        }
        pose
    }

    /// Pose of the tool at a time since the start, s.
    pub(crate) fn actual(&self, time_s: f64) -> Pose {
        let mut pose = (self.path)(time_s);
        for error in &self.errors {
            let place = pose.translation.vector;
            match error {
                Prepared::Position(field) => pose.translation.vector += field.at(&place),
                Prepared::Attitude(field) => {
                    pose.rotation = UnitQuaternion::new(field.at(&place)) * pose.rotation;
                }
                // Out of reach only between the places that `arm` has checked; the arm is rigid there.
                Prepared::Arm(arm) => pose = arm.true_from_nominal(&pose).unwrap_or(pose),
                Prepared::Flex(compliance) => {
                    pose.translation.vector -= acceleration(self.path, time_s) * *compliance;
                }
                Prepared::Backlash(play) => pose.translation.vector += play.at(time_s),
                Prepared::CommandLag(time_constant_s) => pose = lagging(self.path, time_s, *time_constant_s),
                Prepared::AttitudeLag(_) => {}
            }
        }
        pose
    }
}

/// How many poses of the path must be in reach.
const REACH_CHECKS: u32 = 200;

/// The arm that carries the sensor in the recording made by [`simulate_with_faults`](crate::simulate_with_faults);
/// `None` if no fault draws one, or it cannot reach the path.
#[must_use]
pub fn drawn_arm(scenario: &Scenario, faults: &[Fault], seed: u64) -> Option<Arm> {
    let motion = Motion::new(scenario)?;
    let path = |time_s: f64| motion.base_from_tool(time_s);
    faults.iter().enumerate().find_map(|(index, fault)| match *fault {
        Fault::Robot(RobotError::Arm { rms_m }) => arm(scenario, &path, Noise::for_fault(seed, index), rms_m),
        _ => None,
    })
}

fn arm(scenario: &Scenario, path: &dyn Fn(f64) -> Pose, noise: Noise, rms_m: f64) -> Option<Arm> {
    let duration_s = scenario.timing.duration_s;
    let arm = Arm::before(&path(0.5 * duration_s), noise, rms_m)?;
    let reaches = |k: u32| {
        let time_s = duration_s * f64::from(k) / f64::from(REACH_CHECKS);
        arm.true_from_nominal(&path(time_s)).is_some()
    };
    (0..=REACH_CHECKS).all(reaches).then_some(arm)
}

/// Time step of differences, s.
const DIFFERENCE_S: f64 = 0.01;

fn acceleration(path: &dyn Fn(f64) -> Pose, time_s: f64) -> Vector3<f64> {
    let at = |time_s: f64| path(time_s).translation.vector;
    (at(time_s + DIFFERENCE_S) - at(time_s) * 2.0 + at(time_s - DIFFERENCE_S)) / (DIFFERENCE_S * DIFFERENCE_S)
}

/// Nodes and weights of the five-point Gauss–Laguerre rule \[Abramowitz1964, table 25.9\].
const LAGUERRE: [(f64, f64); 5] = [
    (0.263_560_319_718, 0.521_755_610_583),
    (1.413_403_059_107, 0.398_666_811_083),
    (3.596_425_771_041, 0.075_942_449_682),
    (7.085_810_005_859, 0.003_611_758_680),
    (12.640_800_844_276, 0.000_023_369_972),
];

/// A first-order lag: the mean of the past, weighted with exp(−age / time constant).
fn lagging(path: &dyn Fn(f64) -> Pose, time_s: f64, time_constant_s: f64) -> Pose {
    let about = path(time_s - time_constant_s);
    let (mut turn, mut shift) = (Vector3::zeros(), Vector3::zeros());
    for (age, weight) in LAGUERRE {
        let (t, s) = se3::difference_decoupled(&path(time_s - age * time_constant_s), &about);
        turn += t * weight;
        shift += s * weight;
    }
    se3::from_parts(so3::exp(&turn) * about.rotation, about.translation.vector + shift)
}

/// Waves that make up a field; their sum is close to a Gaussian process.
const WAVES: usize = 24;

/// A smooth random vector field of space: plane waves of one length in all directions.
struct Field {
    /// Wave vector (rad/m), phase (rad) and amplitude.
    waves: Vec<(Vector3<f64>, f64, Vector3<f64>)>,
}

impl Field {
    fn new(mut noise: Noise, rms: f64, wavelength_m: f64) -> Self {
        // Each axis has a third of the mean square, and a wave's own mean square is half its amplitude's.
        let sigma = rms * (2.0 / (3.0 * WAVES as f64)).sqrt();
        let waves = (0..WAVES)
            .map(|_| {
                let direction = Vector3::from_fn(|_, _| noise.normal(1.0)).normalize();
                let phase = noise.uniform(0.0, TAU);
                (direction * (TAU / wavelength_m), phase, Vector3::from_fn(|_, _| noise.normal(sigma)))
            })
            .collect();
        Self { waves }
    }

    fn at(&self, place: &Vector3<f64>) -> Vector3<f64> {
        self.waves.iter().map(|(wave, phase, amplitude)| amplitude * (wave.dot(place) + phase).sin()).sum()
    }
}

/// Time step of the play's table, s.
const PLAY_STEP_S: f64 = 0.001;
/// The play is settled this long before the recording, s.
const PLAY_LEAD_S: f64 = 5.0;

/// Play in each axis: how far the tool is from the reported position, over time.
struct Play {
    offsets_m: Vec<Vector3<f64>>,
}

impl Play {
    fn new(path: &dyn Fn(f64) -> Pose, width_m: f64, duration_s: f64) -> Self {
        let half = 0.5 * width_m;
        let count = ((duration_s + 2.0 * PLAY_LEAD_S) / PLAY_STEP_S) as usize;
        let mut tool = path(-PLAY_LEAD_S).translation.vector;
        let offsets_m = (0..count)
            .map(|k| {
                let reported = path(k as f64 * PLAY_STEP_S - PLAY_LEAD_S).translation.vector;
                tool = Vector3::from_fn(|axis, _| {
                    tool[axis].clamp(reported[axis] - half, reported[axis] + half)
                });
                tool - reported
            })
            .collect();
        Self { offsets_m }
    }

    fn at(&self, time_s: f64) -> Vector3<f64> {
        let position = ((time_s + PLAY_LEAD_S) / PLAY_STEP_S).clamp(0.0, (self.offsets_m.len() - 2) as f64);
        let index = position.floor() as usize;
        self.offsets_m[index].lerp(&self.offsets_m[index + 1], position - index as f64)
    }
}
