//! A recording: the only input of a calibration.

use crate::axes::{self, AxisRecord};
use crate::sensor_setup::{Mounted, SensorSetup};
use nalgebra::Matrix2;
use std::collections::BTreeMap;
use trueline_geometry::{Line, Plane, Pose};
use trueline_model::Camera;

/// A recorded scan. Stamps are as recorded, in whole nanoseconds; nothing here is corrected.
#[derive(Clone, Debug)]
pub struct Recording {
    /// The sensor.
    pub sensor: Sensor,
    /// Uncertainty of the sensor, its mounting, and the robot's accuracy.
    pub setup: SensorSetup,
    /// Robot poses by rising stamp.
    pub robot: Vec<RobotSample>,
    /// Seam features by rising stamp.
    pub features: Vec<Feature>,
    /// The stripes on the plates of the joint by rising stamp; empty if only seam points are known. Plates 2k and 2k + 1
    /// meet in line k.
    pub stripes: Vec<PlateStripe>,
    /// A first guess, if the recording came with one.
    pub initial: Option<Guess>,
    /// The truth, if the recording is simulated.
    pub truth: Option<Truth>,
    /// SHA-256 of every file that was read, by name.
    pub inputs: BTreeMap<String, String>,
    /// Of several recordings that were joined, the first stamp of each but the first, ns: nothing was recorded just before it.
    pub joined_from_ns: Vec<i64>,
    /// Whether the robot stood at each reading. Then `robot` has one pose for each stamp of a reading, and stamps only pair
    /// them.
    pub at_stops: bool,
    /// External axes, which carry the part, the robot or the sensor; by their place in the chain.
    pub axes: Vec<AxisRecord>,
    /// Subtracted from the recorded image stamps, ns, because their clock was ahead of the robot's by this. Reported time
    /// offsets include it.
    pub images_ahead_ns: i64,
}

/// Files of a recording that are not measurements: two scans may share these.
const NOT_MEASURED: [&str; 3] = ["sensor.toml", "initial.toml", "truth.toml"];

impl Recording {
    /// The measurements with a sensor, and nothing else.
    #[must_use]
    pub fn new(sensor: Sensor, setup: SensorSetup, robot: Vec<RobotSample>, features: Vec<Feature>) -> Self {
        Self {
            sensor,
            setup,
            robot,
            features,
            stripes: Vec::new(),
            initial: None,
            truth: None,
            inputs: BTreeMap::new(),
            joined_from_ns: Vec::new(),
            at_stops: false,
            axes: Vec::new(),
            images_ahead_ns: 0,
        }
    }

    /// SHA-256 of the measured files of every joined recording.
    pub fn measured_inputs(&self) -> impl Iterator<Item = &String> {
        let is_measured = |name: &str| !NOT_MEASURED.contains(&name.rsplit('/').next().unwrap_or(name));
        self.inputs.iter().filter(move |(name, _)| is_measured(name)).map(|(_, hash)| hash)
    }

    /// Whether the uncertainty in the sensor's file was estimated from this scan.
    #[must_use]
    pub fn is_in_its_sensors_uncertainty(&self) -> bool {
        let stated = self.setup.uncertainty.as_ref();
        stated.is_some_and(|stated| self.measured_inputs().any(|hash| stated.found_from.contains(hash)))
    }

    /// Which of its external axes move while something is read.
    #[must_use]
    pub fn axes_that_move(&self) -> Vec<bool> {
        self.axes.iter().zip(self.axis_ranges()).map(|(axis, range)| axis.moves_by(range)).collect()
    }

    /// How far each of its external axes moves while something is read, rad or m.
    #[must_use]
    pub fn axis_ranges(&self) -> Vec<f64> {
        let stamps = || self.features.iter().map(|feature| feature.stamp_ns);
        let read_ns = stamps().min().zip(stamps().max());
        axes::ranges(&self.axes, read_ns.map(|(first, last)| [first, last]))
    }

    /// Pose of the sensor's carrier in the frame of the lines, without external axes: `base_from_tool`. If the sensor stands
    /// beside the robot and the robot moves the part, `tool_from_base`. Then `tool_from_camera` is `base_from_camera`, and
    /// lines are in the tool.
    #[must_use]
    pub fn lines_from_carrier(&self, sample: &RobotSample) -> Pose {
        match self.setup.mounted {
            Mounted::Tool => sample.base_from_tool,
            Mounted::Fixed => sample.base_from_tool.inverse(),
        }
    }
}

/// The sensor and its own calibration.
#[derive(Clone, Debug, PartialEq)]
pub enum Sensor {
    /// A camera and a laser plane: features are pixels.
    CameraLaser {
        /// The camera.
        camera: Camera,
        /// The sheet in the camera frame.
        laser_plane_in_camera: Plane,
    },
    /// A laser profiler: features are (x, z) in its sheet.
    Profiler,
    /// Points in the camera frame; the sheet is fitted to them if it is not given.
    Points {
        /// The sheet in the camera frame, if known.
        laser_plane_in_camera: Option<Plane>,
    },
}

impl Sensor {
    /// The name in `sensor.toml`.
    #[must_use]
    pub fn kind(&self) -> &'static str {
        match self {
            Self::CameraLaser { .. } => "camera_laser",
            Self::Profiler => "profiler",
            Self::Points { .. } => "points",
        }
    }
}

/// One pose of the robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RobotSample {
    /// Stamp on arrival, ns.
    pub stamp_ns: i64,
    /// Stamp of the controller's own clock, ns, where recorded.
    pub device_ns: Option<i64>,
    /// `base_from_tool`.
    pub base_from_tool: Pose,
}

/// Lines are numbered up to this.
pub const LAST_LINE: u32 = 1023;

/// One seam point seen by the sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Feature {
    /// Stamp on arrival, ns; several features of one image share it.
    pub stamp_ns: i64,
    /// Index of its line, from 0.
    pub line: u32,
    /// Frame counter, where recorded.
    pub frame: Option<u64>,
    /// Stamp of the camera's own clock, ns, where recorded.
    pub device_ns: Option<i64>,
    /// The measurement.
    pub measured: Measured,
    /// Standard deviations, in the unit of the measurement (px, or m), if recorded.
    pub sigma: Option<[f64; 2]>,
    /// Correlation of the errors with these standard deviations, −1 to 1; zero if it was not recorded.
    pub correlation: f64,
}

impl Feature {
    /// Covariance of the two coordinates, in the square of their unit; `otherwise` are the standard deviations of a feature
    /// without its own.
    #[must_use]
    pub fn covariance(&self, otherwise: [f64; 2]) -> Matrix2<f64> {
        let [a, b] = self.sigma.unwrap_or(otherwise);
        let both = if self.sigma.is_some() { self.correlation * a * b } else { 0.0 };
        Matrix2::new(a * a, both, both, b * b)
    }
}

/// The correlation in a covariance; zero if one of the two does not vary. Rounding leaves it within ± [`MOST_CORRELATION`].
#[must_use]
pub fn correlation_of(covariance: &Matrix2<f64>) -> f64 {
    let scale = (covariance.m11 * covariance.m22).sqrt();
    if scale > 0.0 { (covariance.m12 / scale).clamp(-MOST_CORRELATION, MOST_CORRELATION) } else { 0.0 }
}

/// Beyond this correlation one coordinate determines the other, and the covariance gives no weights.
pub const MOST_CORRELATION: f64 = 0.9999;

/// A measured seam point; which form depends on the sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Measured {
    /// Distorted pixel (u, v).
    Pixel([f64; 2]),
    /// Point in the camera frame (x, y, z), m.
    Point([f64; 3]),
    /// Point in a profiler's sheet (x along the stripe, z range), m.
    Profile([f64; 2]),
}

/// The stripe on one plate in one picture, or profile. Its line is given by two points with independent errors
/// perpendicular to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlateStripe {
    /// Stamp on arrival, ns: that of the picture's seam point.
    pub stamp_ns: i64,
    /// Frame counter, where recorded.
    pub frame: Option<u64>,
    /// Number of the plate: 0 or 1 of a file; see [`Recording::stripes`].
    pub plate: u32,
    /// Two points of the stripe.
    pub points: [Measured; 2],
    /// Standard deviation of each point square to the stripe, px or m.
    pub sigma: f64,
}

/// A first guess of the unknowns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Guess {
    /// Time offset, s: the image stamped t was exposed at t − offset.
    pub time_offset_s: f64,
    /// Hand-eye transform.
    pub tool_from_camera: Pose,
}

/// Truth of a simulation.
#[derive(Clone, Debug, PartialEq)]
pub struct Truth {
    /// Time offset and hand-eye transform.
    pub parameters: Guess,
    /// The lines in base.
    pub lines: Vec<Line>,
}
