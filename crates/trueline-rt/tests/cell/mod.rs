//! A cell in virtual time: a robot that scans a sloping plate forth and back, with a profiler whose stamps are late.
#![allow(dead_code, reason = "each test uses a part of it")]

use nalgebra::{Point3, Vector3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use trueline_geometry::{Pose, se3, so3};
use trueline_rt::{Carrier, PlacerCalibration, SensorModel};

/// How late frames are stamped, s.
pub(crate) const TIME_OFFSET_S: f64 = 0.017;
/// Time between poses, s.
pub(crate) const POSE_PERIOD_S: f64 = 0.004;
/// Time between frames, s.
pub(crate) const FRAME_PERIOD_S: f64 = 0.02;
/// Noise of a pose along each axis, m.
pub(crate) const POSE_NOISE_M: f64 = 20e-6;
/// Noise of an attitude about each axis, rad.
pub(crate) const ATTITUDE_NOISE_RAD: f64 = 20e-6;
/// Noise of a range, m.
pub(crate) const RANGE_NOISE_M: f64 = 15e-6;
/// Length of the scan, m.
const LENGTH_M: f64 = 0.06;
/// Acceleration at the turn, m/s².
const ACCELERATION_M_S2: f64 = 1.0;
/// The plate rises along the scan.
const SLOPE: f64 = 0.5;

/// The robot's path.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Path {
    pub(crate) speed_m_s: f64,
}

impl Path {
    fn turn_s(&self) -> f64 {
        2.0 * self.speed_m_s / ACCELERATION_M_S2
    }

    /// Half the scan at its speed, then a turn, and back.
    pub(crate) fn period_s(&self) -> f64 {
        2.0 * (LENGTH_M / self.speed_m_s + self.turn_s())
    }

    /// Place along the scan, m.
    fn along_m(&self, time_s: f64) -> f64 {
        let half_s = 0.5 * self.period_s();
        let in_half_s = time_s.rem_euclid(half_s);
        let lap = ((time_s - in_half_s) / half_s).round();
        let straight_s = LENGTH_M / self.speed_m_s;
        let forth = if in_half_s < straight_s {
            self.speed_m_s * in_half_s
        } else {
            let braked_s = in_half_s - straight_s;
            LENGTH_M + self.speed_m_s * braked_s - 0.5 * ACCELERATION_M_S2 * braked_s * braked_s
        };
        if (lap as i64).rem_euclid(2) == 0 { forth } else { LENGTH_M - forth }
    }

    /// True pose at a time, s.
    pub(crate) fn pose(&self, time_s: f64) -> Pose {
        let swing = 0.15 * (2.0 * std::f64::consts::PI * 0.3 * time_s).sin();
        let along_m = self.along_m(time_s);
        // Looks down; keeps its distance from the plate.
        let rotation =
            so3::exp(&Vector3::new(std::f64::consts::PI, 0.0, 0.0)) * so3::exp(&(Vector3::y() * swing));
        se3::from_parts(rotation, Vector3::new(0.8 + along_m, 0.1, 0.3 + SLOPE * along_m))
    }
}

/// The plate: its normal, and its distance from the base.
pub(crate) fn plate() -> (Vector3<f64>, f64) {
    let normal = Vector3::new(-SLOPE, 0.0, 1.0).normalize();
    (normal, normal.dot(&Vector3::new(0.8, 0.0, 0.0)))
}

pub(crate) fn tool_from_camera() -> Pose {
    se3::from_parts(so3::exp(&Vector3::new(0.05, 0.2, 0.4)), Vector3::new(0.05, -0.03, 0.1))
}

/// The calibration that was used, with a time offset.
pub(crate) fn calibration(time_offset_s: f64) -> PlacerCalibration {
    PlacerCalibration {
        sensor: SensorModel::Profiler,
        shape: None,
        tool_from_camera: tool_from_camera(),
        time_offset_s,
        covariance: PlacerCalibration::covariance_of(1e-9, 1e-9, 1e-9),
        reading_sigma_m: RANGE_NOISE_M,
        carrier: Carrier::Tool,
        axes: Vec::new(),
    }
}

/// Points where rays of the profiler meet the plate: readings without noise, and the points in base.
pub(crate) fn seen(base_from_tool: &Pose, columns: usize) -> (Vec<[f64; 2]>, Vec<Vector3<f64>>) {
    let base_from_camera = base_from_tool * tool_from_camera();
    let (normal, offset) = plate();
    let origin = base_from_camera.translation.vector;
    let column = |k: usize| {
        let x = 0.02 * (k as f64 / (columns - 1).max(1) as f64 - 0.5);
        let foot = base_from_camera * Point3::new(x, 0.0, 0.0);
        let ray = base_from_camera.rotation * Vector3::z();
        let range = (offset - normal.dot(&foot.coords)) / normal.dot(&ray);
        assert!(range > 0.0 && origin.norm() < 2.0);
        ([x, range], foot.coords + ray * range)
    };
    (0..columns).map(column).unzip()
}

/// The arriving data, in their order.
#[derive(Clone, Debug)]
pub(crate) enum Event {
    Pose { stamp_ns: i64, pose: Pose },
    Frame { stamp_ns: i64, readings: Vec<[f64; 2]>, truth: Vec<Vector3<f64>>, exposed_s: f64 },
}

pub(crate) struct Noise(ChaCha8Rng);

impl Noise {
    pub(crate) fn new(seed: u64) -> Self {
        Self(ChaCha8Rng::seed_from_u64(seed))
    }

    pub(crate) fn normal(&mut self) -> f64 {
        self.0.sample(StandardNormal)
    }

    pub(crate) fn vector(&mut self) -> Vector3<f64> {
        Vector3::from_fn(|_, _| self.normal())
    }

    pub(crate) fn uniform(&mut self) -> f64 {
        self.0.random()
    }
}

pub(crate) fn ns(time_s: f64) -> i64 {
    1_700_000_000_000_000_000 + (time_s * 1e9).round() as i64
}

/// A scan: poses with noise, frames that were exposed at [`FRAME_PERIOD_S`] and arrive, stamped, [`TIME_OFFSET_S`] later; poses arrive
/// 3 ms after they were true.
pub(crate) fn events(path: Path, duration_s: f64, columns: usize, seed: u64) -> Vec<Event> {
    const POSE_DELAY_S: f64 = 0.003;
    let mut noise = Noise::new(seed);
    let mut list: Vec<(f64, Event)> = Vec::new();
    for k in 0..(duration_s / POSE_PERIOD_S) as usize {
        let time_s = k as f64 * POSE_PERIOD_S;
        let pose = se3::retract_decoupled(
            &path.pose(time_s),
            &(noise.vector() * ATTITUDE_NOISE_RAD),
            &(noise.vector() * POSE_NOISE_M),
        );
        list.push((time_s + POSE_DELAY_S, Event::Pose { stamp_ns: ns(time_s), pose }));
    }
    for k in 25..(duration_s / FRAME_PERIOD_S) as usize {
        let exposed_s = k as f64 * FRAME_PERIOD_S + 0.001_7;
        let (mut readings, truth) = seen(&path.pose(exposed_s), columns);
        readings.iter_mut().for_each(|[_, z]| *z += noise.normal() * RANGE_NOISE_M);
        let stamp_s = exposed_s + TIME_OFFSET_S;
        list.push((stamp_s, Event::Frame { stamp_ns: ns(stamp_s), readings, truth, exposed_s }));
    }
    list.sort_by(|a, b| a.0.total_cmp(&b.0));
    list.into_iter().map(|(_, event)| event).collect()
}
