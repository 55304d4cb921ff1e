//! Properties of a simulated controller. Figures without a source are our assumptions; those with one come from ABB's
//! application manual 3HAC073318 or from users' measurements.

use crate::egm::Generation;
use std::net::IpAddr;
use trueline_geometry::{Pose, Trajectory};

/// State of RAPID.
#[derive(Clone, Debug)]
pub enum Task {
    /// EGM position stream while a program of the robot's own moves along a path, from its first time; the PC only listens.
    Stream {
        /// The path.
        path: Trajectory,
        /// Rest before and after it, s.
        rest_s: f64,
    },
    /// EGM pose guidance: the PC's references move the robot.
    Guidance {
        /// First pose of the robot.
        start: Pose,
    },
}

/// Behaviour at the end of a guidance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StopMode {
    /// `EGM_STOP_HOLD`: the robot stays.
    Hold,
    /// `EGM_STOP_RAMP_DOWN`: the robot goes back to where the guidance began.
    RampDown,
}

/// The loop that follows references.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Following {
    /// Default Proportional Position Gain times `\PosCorrGain`, 1/s.
    pub gain_per_s: f64,
    /// Default Low Pass Filter Bandwidth, Hz.
    pub low_pass_hz: f64,
    /// From reference to motion, s.
    pub dead_time_s: f64,
    /// `\RampInTime`, s.
    pub ramp_in_s: f64,
    /// Speed that the tool may have, m/s; in place of `\MaxSpeedDeviation`, which is a joint's.
    pub speed_m_s: f64,
    /// Acceleration, m/s².
    pub acceleration_m_s2: f64,
    /// Angular speed, rad/s.
    pub turn_rad_s: f64,
    /// Angular acceleration, rad/s².
    pub turn_acceleration_rad_s2: f64,
    /// How far the robot may go from the start of the guidance, m; in place of `\MaxPosDeviation`.
    pub range_m: f64,
    /// How far it turns from there, rad.
    pub range_rad: f64,
}

/// Condition for the end of a guidance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Convergence {
    /// Nearer than this to the reference, m,
    pub distance_m: f64,
    /// and rad,
    pub angle_rad: f64,
    /// for so long (`\CondTime`), s.
    pub for_s: f64,
}

/// Reports of the robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Feedback {
    /// Standard deviation of a position, m.
    pub noise_m: f64,
    /// Standard deviation of an attitude, rad.
    pub noise_rad: f64,
    /// Age of a pose beyond its stated time, s.
    pub age_s: f64,
    /// Delay of the robot behind `planned`, s.
    pub servo_lag_s: f64,
}

/// The controller's clock.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ControllerClock {
    /// Its reading at the start, s.
    pub epoch_s: f64,
    /// Rate error, positive if fast, parts per million.
    pub drift_ppm: f64,
    /// When it is set, s after the start, and by how much, s.
    pub step_s: Option<(f64, f64)>,
}

impl ControllerClock {
    /// Its reading at a time after the start, ns.
    #[must_use]
    pub fn at_ns(&self, time_ns: i64) -> i64 {
        let fast_ns = (time_ns as f64 * self.drift_ppm * 1e-6).round() as i64;
        let stepped_s =
            self.step_s.filter(|(at_s, _)| time_ns as f64 * 1e-9 >= *at_s).map_or(0.0, |(_, by_s)| by_s);
        ((self.epoch_s + stepped_s) * 1e9).round() as i64 + time_ns + fast_ns
    }
}

/// Something that happens to the controller.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// Emergency stop: motors off.
    EmergencyStop,
    /// Motors on again; RAPID continues.
    MotorsOn,
    /// RAPID is stopped.
    RapidStop,
    /// RAPID is started again.
    RapidStart,
    /// The controller, or its program, begins anew: sequence numbers from 0, another port.
    Restart,
    /// The robot bumps into something.
    Collision,
}

/// A simulated controller.
#[derive(Clone, Debug)]
pub struct ControllerSettings {
    /// Which fields it fills, and how.
    pub generation: Generation,
    /// State of RAPID.
    pub task: Task,
    /// Time between its cycles, s: 4.032 ms, a virtual controller's 4 ms.
    pub period_s: f64,
    /// Cycles between messages (`\SampleRate` over 4 ms).
    pub every_cycles: u32,
    /// How it follows.
    pub following: Following,
    /// `\CommTimeout`, s.
    pub timeout_s: f64,
    /// RAPID waits for the PC's first answer before it begins a guidance.
    pub waits_for_pc: bool,
    /// When guidance ends.
    pub convergence: Convergence,
    /// Its behaviour then.
    pub stop_mode: StopMode,
    /// Its reports.
    pub feedback: Feedback,
    /// Its clock.
    pub clock: ControllerClock,
    /// Events by time after the start, s.
    pub events: Vec<(f64, Event)>,
    /// The only address with accepted answers; `None` accepts all, as the network delivers them.
    pub peer: Option<IpAddr>,
    /// Seed of the noise.
    pub seed: u64,
}

impl ControllerSettings {
    /// A present controller with its defaults, except the speed deviation: its default of 1°/s moves nothing.
    #[must_use]
    pub fn new(task: Task) -> Self {
        Self {
            generation: Generation::From7,
            task,
            period_s: 0.004_032,
            every_cycles: 1,
            following: Following {
                gain_per_s: 5.0,
                low_pass_hz: 20.0,
                dead_time_s: 0.015,
                ramp_in_s: 0.5,
                speed_m_s: 0.5,
                acceleration_m_s2: 10.0,
                turn_rad_s: 2.0,
                turn_acceleration_rad_s2: 40.0,
                range_m: 2.0,
                range_rad: 2.0,
            },
            timeout_s: 0.2,
            waits_for_pc: false,
            convergence: Convergence { distance_m: 0.001, angle_rad: 0.5_f64.to_radians(), for_s: 1.0 },
            stop_mode: StopMode::Hold,
            feedback: Feedback { noise_m: 1e-5, noise_rad: 2e-5, age_s: 0.0, servo_lag_s: 0.008 },
            clock: ControllerClock { epoch_s: 86_400.0, drift_ppm: 20.0, step_s: None },
            events: Vec::new(),
            peer: None,
            seed: 1,
        }
    }
}
