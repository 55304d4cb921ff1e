//! Sightings of a target that a camera on the robot, or beside it, reports the pose of: cast forward, with truth.
//!
//! The camera's view of the target swings over time; where the robot has to be for that follows from the chain. It shares
//! nothing with the estimator.

use crate::noise::Noise;
use nalgebra::{UnitQuaternion, Vector3};
use std::f64::consts::TAU;
use std::path::Path;
use trueline_dataset::pose_folder::{self, PoseTruth};
use trueline_dataset::sensor_setup::{Mounted, SensorSetup};
use trueline_dataset::{Error, Guess, RobotSample, Sighting};
use trueline_geometry::{Pose, se3};

/// Stamp of the first pose, ns.
const START_NS: i64 = 1_000_000_000;
/// The robot is recorded so long before the first exposure and after the last, s.
const BEFORE_S: f64 = 0.3;
/// Bounds of the frequencies of a swing, Hz.
const HERTZ: [f64; 2] = [0.12, 0.45];
/// How far a camera is from its tool, m.
const MOUNT_M: f64 = 0.15;
/// Distance of the target from the robot's base, or of a camera beside the robot, m.
const REACH_M: f64 = 1.0;

/// How the target moves before the camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PoseMotion {
    /// Turns about all axes and shifts along all.
    Full,
    /// Turns about one axis of the camera, its z.
    OneAxis,
    /// Shifts without any turn.
    Shifts,
    /// Turns about one axis and shifts along one, both at an even rate.
    Even,
}

/// How far the target is from the camera, and how far it moves before it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewSize {
    /// Usual distance, m.
    pub distance_m: f64,
    /// How far the target swings along each axis of the camera, m.
    pub swing_m: [f64; 3],
    /// How far it turns about each, rad.
    pub swing_rad: [f64; 3],
    /// Speed of even motion along each axis, m/s.
    pub even_m_s: [f64; 3],
    /// Turning rate of even motion about the camera's z axis, rad/s.
    pub even_rad_s: f64,
    /// A wrong sighting is off by up to this turn, rad, and shift, m.
    pub wrong: [f64; 2],
}

impl ViewSize {
    /// Of a marker of 100 mm before a camera.
    pub const MARKER: Self = Self {
        distance_m: 0.45,
        swing_m: [0.06, 0.05, 0.08],
        swing_rad: [0.35, 0.35, 0.45],
        even_m_s: [0.01, 0.0, 0.0],
        even_rad_s: 0.08,
        wrong: [1.5, 0.3],
    };
}

/// Standard deviations of a sighting, per axis: across the view and along it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SightingNoise {
    /// Of the translation across the view and along it, m.
    pub shift_m: [f64; 2],
    /// Of the rotation about axes across the view and along it, rad.
    pub turn_rad: [f64; 2],
}

impl SightingNoise {
    /// Of a marker of 100 mm: depth and tilt are seen worse.
    pub const MARKER: Self = Self { shift_m: [0.15e-3, 0.45e-3], turn_rad: [2.5e-3, 1e-3] };
    /// None.
    pub const NONE: Self = Self { shift_m: [0.0; 2], turn_rad: [0.0; 2] };
    /// The same for every axis, as a `sigma_mm` and `sigma_deg` state it.
    #[must_use]
    pub fn even(shift_m: f64, turn_rad: f64) -> Self {
        Self { shift_m: [shift_m; 2], turn_rad: [turn_rad; 2] }
    }
}

/// A recording of sightings.
#[derive(Clone, Debug, PartialEq)]
pub struct SightingScan {
    /// Seed of hand-eye transform, target, motion and noise.
    pub seed: u64,
    /// Delay of a sighting's stamp after its exposure, s.
    pub time_offset_s: f64,
    /// Number of sightings.
    pub count: u32,
    /// Time between them, s.
    pub period_s: f64,
    /// Time between the robot's poses, s.
    pub robot_period_s: f64,
    /// Carrier of the camera.
    pub mounted: Mounted,
    /// Whether the robot stands at each sighting, and poses and sightings are paired by number.
    pub at_stops: bool,
    /// How the target moves in view.
    pub motion: PoseMotion,
    /// How far it is away, and moves.
    pub view: ViewSize,
    /// Noise of a sighting.
    pub noise: SightingNoise,
    /// Whether the noise is stated in the recording: it then has to be even.
    pub states_noise: bool,
    /// Noise of the robot's recorded position (m) and attitude (rad), per axis.
    pub robot_noise: [f64; 2],
    /// Jitter of the stamps of sightings, s.
    pub jitter_s: f64,
    /// Part of the sightings that are wrong.
    pub outliers: f64,
}

/// The simulated sightings.
#[derive(Clone, Debug)]
pub struct Sighted {
    /// The robot's poses as recorded.
    pub robot: Vec<RobotSample>,
    /// The sightings as reported.
    pub sightings: Vec<Sighting>,
    /// Indices of the wrong ones.
    pub wrong: Vec<bool>,
    /// The truth.
    pub truth: PoseTruth,
    /// Content of `sensor.toml`.
    pub setup: SensorSetup,
    /// Whether there is one pose for each sighting.
    pub at_stops: bool,
}

impl SightingScan {
    /// A marker at 15 Hz for 20 s, 17.73 ms late, before a robot that reports its pose every 4 ms.
    #[must_use]
    pub fn usual(seed: u64) -> Self {
        Self {
            seed,
            time_offset_s: 0.01773,
            count: 300,
            period_s: 1.0 / 15.0,
            robot_period_s: 0.004,
            mounted: Mounted::Tool,
            at_stops: false,
            motion: PoseMotion::Full,
            view: ViewSize::MARKER,
            noise: SightingNoise::MARKER,
            states_noise: false,
            robot_noise: [0.02e-3, 2e-5],
            jitter_s: 0.0,
            outliers: 0.0,
        }
    }

    /// The same at stops: 24 of them, without a time offset.
    #[must_use]
    pub fn at_stops(seed: u64) -> Self {
        Self { at_stops: true, count: 24, period_s: 1.7, time_offset_s: 0.0, ..Self::usual(seed) }
    }

    /// Casts it.
    #[must_use]
    pub fn cast(&self) -> Sighted {
        let mut draw = Noise::new(self.seed, 1);
        let carrier_from_camera = match self.mounted {
            Mounted::Tool => random_pose(&mut draw, MOUNT_M),
            Mounted::Fixed => random_pose(&mut draw, REACH_M),
        };
        let target_from = match self.mounted {
            Mounted::Tool => random_pose(&mut draw, REACH_M),
            Mounted::Fixed => random_pose(&mut draw, MOUNT_M),
        };
        let chain = Chain {
            carrier_from_camera,
            target_from,
            mounted: self.mounted,
            view: View::drawn(self.motion, self.view, &mut draw),
        };
        let exposures_s: Vec<f64> =
            (0..self.count).map(|k| BEFORE_S + self.period_s * f64::from(k)).collect();
        let (sightings, wrong) = self.sightings(&chain, &exposures_s);
        let parameters = Guess { time_offset_s: self.time_offset_s, tool_from_camera: carrier_from_camera };
        Sighted {
            robot: self.robot(&chain, &exposures_s),
            sightings,
            wrong,
            truth: PoseTruth { parameters, base_from_target: target_from },
            setup: SensorSetup { mounted: self.mounted, ..SensorSetup::default() },
            at_stops: self.at_stops,
        }
    }

    fn sightings(&self, chain: &Chain, exposures_s: &[f64]) -> (Vec<Sighting>, Vec<bool>) {
        let (mut noise, mut gross) = (Noise::new(self.seed, 2), Noise::new(self.seed, 3));
        let mut jitter = Noise::new(self.seed, 4);
        let mut wrong = Vec::new();
        let of_axes = |[across, along]: [f64; 2], noise: &mut Noise| {
            Vector3::new(noise.normal(across), noise.normal(across), noise.normal(along))
        };
        let sighting = |(k, exposed_s): (usize, &f64)| {
            let true_view = chain.view.camera_from_target(*exposed_s);
            let turn = of_axes(self.noise.turn_rad, &mut noise);
            let shift = of_axes(self.noise.shift_m, &mut noise);
            let mut seen =
                se3::from_parts(turned_by(&turn) * true_view.rotation, true_view.translation.vector + shift);
            wrong.push(gross.happens(self.outliers));
            let off = |gross: &mut Noise, most: f64| Vector3::from_fn(|_, _| gross.uniform(-most, most));
            let [most_rad, most_m] = self.view.wrong;
            let (turn, shift) = (off(&mut gross, most_rad), off(&mut gross, most_m));
            if wrong[k] {
                seen = se3::from_parts(turned_by(&turn) * seen.rotation, seen.translation.vector + shift);
            }
            let late_s = self.time_offset_s + jitter.normal(self.jitter_s);
            let stated = [self.noise.turn_rad[0], self.noise.shift_m[0]];
            Sighting {
                stamp_ns: START_NS + ((exposed_s + late_s) * 1e9).round() as i64,
                camera_from_target: seen,
                sigma: self.states_noise.then_some(stated),
            }
        };
        (exposures_s.iter().enumerate().map(sighting).collect(), wrong)
    }

    fn robot(&self, chain: &Chain, exposures_s: &[f64]) -> Vec<RobotSample> {
        let mut noise = Noise::new(self.seed, 5);
        let last_s = exposures_s.last().copied().unwrap_or_default() + BEFORE_S;
        let times_s: Vec<f64> = if self.at_stops {
            exposures_s.to_vec()
        } else {
            (0..=(last_s / self.robot_period_s) as u64).map(|k| self.robot_period_s * k as f64).collect()
        };
        let [position_m, attitude_rad] = self.robot_noise;
        let mut axes = |sigma: f64| Vector3::from_fn(|_, _| noise.normal(sigma));
        let sample = |time_s: &f64| {
            let true_one = chain.base_from_tool(*time_s);
            let wrong = se3::from_parts(turned_by(&axes(attitude_rad)), axes(position_m));
            RobotSample {
                stamp_ns: START_NS + (time_s * 1e9).round() as i64,
                device_ns: None,
                base_from_tool: true_one * wrong,
            }
        };
        times_s.iter().map(sample).collect()
    }
}

impl Sighted {
    /// Writes the dataset into a folder that exists.
    ///
    /// # Errors
    /// Files that cannot be written.
    pub fn write(&self, folder: &Path) -> Result<(), Error> {
        let robot = (&self.robot[..], self.at_stops);
        pose_folder::write(folder, &self.setup, robot, &self.sightings, &self.truth)
    }
}

/// Chain from the camera to the robot.
struct Chain {
    /// `tool_from_camera`, or `base_from_camera`.
    carrier_from_camera: Pose,
    /// `base_from_target`, or `tool_from_target`.
    target_from: Pose,
    mounted: Mounted,
    view: View,
}

impl Chain {
    fn base_from_tool(&self, time_s: f64) -> Pose {
        let camera_from_target = self.view.camera_from_target(time_s);
        match self.mounted {
            Mounted::Tool => {
                self.target_from * camera_from_target.inverse() * self.carrier_from_camera.inverse()
            }
            Mounted::Fixed => self.carrier_from_camera * camera_from_target * self.target_from.inverse(),
        }
    }
}

/// One swing about or along one axis: two sines of frequencies and phases of its own.
#[derive(Clone, Copy)]
struct Swing([[f64; 2]; 2]);

impl Swing {
    fn drawn(draw: &mut Noise) -> Self {
        let [low, high] = HERTZ;
        Self([(); 2].map(|()| [draw.uniform(low, high), draw.uniform(0.0, TAU)]))
    }

    fn at(&self, time_s: f64) -> f64 {
        self.0.iter().map(|[hertz, phase]| 0.6 * (TAU * hertz * time_s + phase).sin()).sum()
    }
}

/// The target before the camera over time.
struct View {
    motion: PoseMotion,
    size: ViewSize,
    turns: [Swing; 3],
    shifts: [Swing; 3],
}

impl View {
    fn drawn(motion: PoseMotion, size: ViewSize, draw: &mut Noise) -> Self {
        Self {
            motion,
            size,
            turns: [(); 3].map(|()| Swing::drawn(draw)),
            shifts: [(); 3].map(|()| Swing::drawn(draw)),
        }
    }

    fn camera_from_target(&self, time_s: f64) -> Pose {
        let swung =
            |swings: &[Swing; 3], sizes: [f64; 3]| Vector3::from_fn(|k, _| sizes[k] * swings[k].at(time_s));
        let ViewSize { distance_m, swing_m, swing_rad, even_m_s, even_rad_s, .. } = self.size;
        let middle = Vector3::z() * distance_m;
        let about_z = |angle: f64| Vector3::z() * angle;
        let shifts = || swung(&self.shifts, swing_m);
        let (turn, shift) = match self.motion {
            PoseMotion::Full => (swung(&self.turns, swing_rad), shifts()),
            PoseMotion::OneAxis => (about_z(swing_rad[2] * self.turns[2].at(time_s)), shifts()),
            PoseMotion::Shifts => (Vector3::zeros(), shifts()),
            PoseMotion::Even => (about_z(even_rad_s * time_s), Vector3::from(even_m_s) * time_s),
        };
        se3::from_parts(turned_by(&turn), middle + shift)
    }
}

/// The rotation of a rotation vector.
fn turned_by(vector: &Vector3<f64>) -> UnitQuaternion<f64> {
    UnitQuaternion::from_scaled_axis(*vector)
}

/// Any attitude, and a place about so far away, m.
fn random_pose(draw: &mut Noise, distance_m: f64) -> Pose {
    let mut direction = || Vector3::from_fn(|_, _| draw.normal(1.0)).normalize();
    let (axis, place) = (direction(), direction());
    let angle = draw.uniform(0.0, TAU / 2.0);
    se3::from_parts(turned_by(&(axis * angle)), place * distance_m)
}
