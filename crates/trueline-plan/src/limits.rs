//! Limits of the robot, the torch and the user.

use nalgebra::Vector3;

/// Limits of the motion; positions, speeds and their derivatives are those of the tool frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Limits {
    /// Corners of the box in base for the tool's origin, m; `None` is no box.
    pub workspace_m: Option<[Vector3<f64>; 2]>,
    /// Nearest and furthest distance of the seam along the camera's axis (a profiler's range), m.
    pub stand_off_m: [f64; 2],
    /// Most that the work angle (about the seam), the travel angle (about the stripe) and the spin (about the range
    /// direction) may differ from the nominal attitude, rad.
    pub tilt_rad: [f64; 3],
    /// Speed, m/s.
    pub speed_m_s: f64,
    /// Acceleration, m/s².
    pub acceleration_m_s2: f64,
    /// Jerk, m/s³.
    pub jerk_m_s3: f64,
    /// Angular speed, rad/s.
    pub turn_rad_s: f64,
    /// Angular acceleration, rad/s².
    pub turn_acceleration_rad_s2: f64,
    /// Angular jerk, rad/s³.
    pub turn_jerk_rad_s3: f64,
    /// Speed of the fastest point of the tool's load, m/s: of a ball about the tool's origin, as in the gate that guides a
    /// robot.
    pub tip_speed_m_s: f64,
    /// Whether a second pass may be made with the sensor spun by half a turn about its view, as far as cables and joints are concerned.
    pub spun_pass: bool,
    /// Distance from the tool's origin to the farthest point of its load (sensor, torch), m.
    pub reach_m: f64,
}

impl Default for Limits {
    /// The speed at which robots may move with people near (250 mm/s, ISO 10218-1, 5.6.2), and a gentle ride; a sensor or a torch on
    /// a bracket of half a metre.
    fn default() -> Self {
        Self {
            workspace_m: None,
            stand_off_m: [0.100, 0.250],
            tilt_rad: [25.0_f64.to_radians(); 3],
            speed_m_s: 0.250,
            acceleration_m_s2: 1.0,
            jerk_m_s3: 10.0,
            turn_rad_s: 45.0_f64.to_radians(),
            turn_acceleration_rad_s2: 180.0_f64.to_radians(),
            turn_jerk_rad_s3: 1800.0_f64.to_radians(),
            tip_speed_m_s: 0.250,
            spun_pass: false,
            reach_m: 0.5,
        }
    }
}
