//! Settings of a simulation, all in SI units.

use nalgebra::{UnitVector3, Vector3};
use trueline_geometry::{Line, Plane, Polyline, Pose};
use trueline_model::Camera;

/// A whole simulated scan.
#[derive(Clone, Debug)]
pub struct Scenario {
    /// Places of the cell's parts.
    pub cell: Cell,
    /// How the sensor moves over the first line.
    pub scan: Scan,
    /// Sampling times.
    pub timing: Timing,
    /// Disturbances.
    pub disturbance: Disturbance,
}

/// Sensor, mounting and lines: the truth that calibration looks for.
#[derive(Clone, Debug)]
pub struct Cell {
    /// The sensor.
    pub sensor: SensorModel,
    /// Hand-eye transform.
    pub tool_from_camera: Pose,
    /// Lines in base; the scan follows the first.
    pub lines: Vec<Line>,
    /// Curve in base that the seam follows instead of the first line; `None` for straight seams.
    pub curve: Option<Polyline>,
    /// Direction in base from which the sensor looks at the line, square to it.
    pub approach: UnitVector3<f64>,
}

/// Kind of readings of the sensor.
#[derive(Clone, Debug)]
pub enum SensorModel {
    /// Pixels of a camera with a laser plane.
    CameraLaser {
        /// The camera.
        camera: Camera,
        /// Sheet in the camera frame.
        laser_plane_in_camera: Plane,
    },
    /// (x, z) of a profiler, seen within half a width and between two ranges, m.
    Profiler {
        /// Half the width of the field of view, m.
        half_width_m: f64,
        /// Nearest and furthest range, m.
        range_m: [f64; 2],
    },
    /// Points in the camera frame, of a camera with a laser plane.
    Points {
        /// The camera that limits the view.
        camera: Camera,
        /// Sheet in the camera frame.
        laser_plane_in_camera: Plane,
    },
}

/// An S-shaped scan: progress along the line, sines on everything else.
#[derive(Clone, Debug)]
pub struct Scan {
    /// Length of line that is passed over, m.
    pub length_m: f64,
    /// Place of the line in the sheet, along the stripe: amplitude in m and frequency.
    pub lateral: Sine,
    /// The same along the range: change of stand-off.
    pub range: Sine,
    /// Attitude that the sines swing about, rad: work angle (about the line), travel angle (about the
    /// stripe) and spin (about the range direction). Zero holds the sheet square to the line.
    pub attitude_rad: [f64; 3],
    /// Work angle, travel angle and spin over time: amplitudes in rad.
    pub tilts: [Sine; 3],
    /// In which frame the sines of place are laid out.
    pub tracked_in: TrackedIn,
    /// How the scan runs along the line.
    pub progress: Progress,
    /// How often it runs over the line, there and back.
    pub passes: u32,
    /// Further spin of each pass after the first, rad: a second pass with the sensor turned about its view.
    pub spin_by_pass_rad: f64,
}

/// In which frame a weave is laid out. At constant attitude both are the same.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TrackedIn {
    /// The seam follows the sines in the sensor's sheet, at any tilt.
    #[default]
    Sensor,
    /// The middle of the field of view moves in base as the sines say, and the tilts turn about it.
    Base,
}

/// How a scan runs along the line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Progress {
    /// At constant speed.
    #[default]
    Even,
    /// Starting and ending each pass at rest.
    Eased,
}

/// A sine over time, amplitude · sin(2π·frequency·t + phase).
#[derive(Clone, Copy, Debug, Default)]
pub struct Sine {
    /// Amplitude in the unit of the moved quantity.
    pub amplitude: f64,
    /// Frequency, Hz.
    pub frequency_hz: f64,
    /// Phase, rad.
    pub phase_rad: f64,
}

impl Sine {
    /// Value at a time, s.
    #[must_use]
    pub fn at(&self, time_s: f64) -> f64 {
        self.amplitude * (std::f64::consts::TAU * self.frequency_hz * time_s + self.phase_rad).sin()
    }
}

/// Sampling times.
#[derive(Clone, Debug)]
pub struct Timing {
    /// Duration of the recording, s.
    pub duration_s: f64,
    /// Time between robot samples, s.
    pub robot_period_s: f64,
    /// Time between images, s.
    pub frame_period_s: f64,
    /// Time offset: an image exposed at t is stamped t + offset.
    pub time_offset_s: f64,
    /// Reading of both clocks at the start, ns.
    pub start_ns: i64,
    /// How the robot moves between its samples.
    pub between: Between,
}

/// How the robot moves between its samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Between {
    /// Along the sines: linear interpolation is then not exact.
    Smooth,
    /// Straight and at constant rate, so that a noise-free scan can be recovered exactly.
    Straight,
}

/// Disturbances; all zero is a perfect recording.
#[derive(Clone, Debug, Default)]
pub struct Disturbance {
    /// Standard deviation of a feature, px (camera) along u and v.
    pub feature_noise_px: f64,
    /// Standard deviation of a feature in the sheet, m (profiler, points).
    pub feature_noise_m: f64,
    /// Standard deviation of each recorded robot position, per axis, m.
    pub robot_position_noise_m: f64,
    /// Standard deviation of each recorded robot attitude, per axis, rad.
    pub robot_rotation_noise_rad: f64,
    /// Standard deviation of robot stamps, s.
    pub robot_jitter_s: f64,
    /// Standard deviation of image stamps, s.
    pub frame_jitter_s: f64,
    /// Drift of the camera clock against the robot's, parts per million.
    pub clock_drift_ppm: f64,
    /// Fraction of outliers, anywhere in the field of view.
    pub outlier_fraction: f64,
    /// Part of the frames that is lost.
    pub drop_fraction: f64,
}

impl Scenario {
    /// Direction of the first line.
    #[must_use]
    pub(crate) fn seam_direction(&self) -> Vector3<f64> {
        self.cell.lines.first().map_or_else(Vector3::x, Line::direction)
    }
}
