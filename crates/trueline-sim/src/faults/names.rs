//! The names of faults, their sizes in a user's units, and how both are read: `plane-offset=0.25`, `wobble=0.1,5`.

use super::fault::{Event, Fault, FeatureError, RobotError, SeamForm, SensorError, StreamError};

/// A kind of fault by name.
#[derive(Clone, Copy, Debug)]
pub struct FaultName {
    /// The name on the command line.
    pub name: &'static str,
    /// Units of its sizes, separated by commas; empty for a fault without a size.
    pub units: &'static str,
    /// Default sizes, in these units.
    pub defaults: &'static [f64],
    /// Its description.
    pub description: &'static str,
    make: fn(&[f64]) -> Fault,
}

impl FaultName {
    /// The smallest and the largest of its sizes, in the units of [`FaultName::units`]. Lengths of change are at least a
    /// hundredth; sizes that are no departure to either side are at least zero.
    fn sizes(&self, index: usize) -> (f64, f64) {
        match self.name {
            _ if index > 0 => (LEAST_LENGTH, LARGEST_SIZE),
            name if NOT_NEGATIVE.contains(&name) => (0.0, LARGEST_SIZE),
            _ => (-LARGEST_SIZE, LARGEST_SIZE),
        }
    }

    /// The fault of some size, in the units of [`FaultName::units`]; `None` for another number of sizes.
    #[must_use]
    pub fn of(&self, sizes: &[f64]) -> Option<Fault> {
        (sizes.len() == self.defaults.len()).then(|| (self.make)(sizes))
    }
}

/// Least second size: a length over which the first changes, or a share.
const LEAST_LENGTH: f64 = 0.01;
/// Largest size in any unit.
const LARGEST_SIZE: f64 = 1e6;
/// Faults with a magnitude as first size.
const NOT_NEGATIVE: [&str; 13] = [
    "wobble",
    "robot-field",
    "robot-attitude",
    "robot-arm",
    "backlash",
    "rolling-shutter",
    "correlated-noise",
    "image-grain",
    "robot-grain",
    "doubled-frames",
    "uncounted-losses",
    "late-arrival",
    "attitude-lag",
];

/// Text that names no fault.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FaultError {
    /// No fault has this name.
    #[error("`{0}` is not a fault")]
    Name(String),
    /// A size is not a finite number.
    #[error("`{0}` is not a number")]
    Number(String),
    /// A size that no cell has, or that nothing can be simulated with.
    #[error("`{name}`: expected a size from {least} to {largest}, found {found}")]
    Size {
        /// The fault.
        name: &'static str,
        /// The smallest size.
        least: f64,
        /// The largest size.
        largest: f64,
        /// The given value.
        found: f64,
    },
    /// More or fewer sizes than the fault has.
    #[error("`{name}` has {expected} size(s), found {found}")]
    Sizes {
        /// The fault.
        name: &'static str,
        /// Its number.
        expected: usize,
        /// How many were given.
        found: usize,
    },
}

impl std::str::FromStr for Fault {
    type Err = FaultError;

    /// Reads `name` or `name=size` or `name=size,size`; sizes that are left out have their defaults.
    fn from_str(text: &str) -> Result<Self, FaultError> {
        let (name, sizes) = text.split_once('=').map_or((text, None), |(name, sizes)| (name, Some(sizes)));
        let kind = FAULT_NAMES.iter().find(|kind| kind.name == name);
        let kind = kind.ok_or_else(|| FaultError::Name(name.to_owned()))?;
        let number = |text: &str| {
            let value = text.trim().parse::<f64>().ok().filter(|value| value.is_finite());
            value.ok_or_else(|| FaultError::Number(text.to_owned()))
        };
        let mut given = match sizes {
            Some(sizes) => sizes.split(',').map(number).collect::<Result<Vec<_>, _>>()?,
            None => Vec::new(),
        };
        for (index, &found) in given.iter().enumerate() {
            let (least, largest) = kind.sizes(index);
            if !(least..=largest).contains(&found) {
                return Err(FaultError::Size { name: kind.name, least, largest, found });
            }
        }
        let found = given.len();
        given.extend(kind.defaults.iter().skip(found));
        kind.of(&given).ok_or(FaultError::Sizes { name: kind.name, expected: kind.defaults.len(), found })
    }
}

const MM: f64 = 1e-3;
const MS: f64 = 1e-3;
const PERCENT: f64 = 1e-2;
const DEG: f64 = std::f64::consts::PI / 180.0;

/// Every fault.
pub const FAULT_NAMES: [FaultName; 43] = [
    FaultName {
        name: "plane-offset",
        units: "mm",
        defaults: &[0.25],
        description: "the stated laser plane is shifted along its normal",
        make: |v| Fault::Sensor(SensorError::PlaneOffset { offset_m: v[0] * MM }),
    },
    FaultName {
        name: "plane-tilt-stripe",
        units: "deg",
        defaults: &[0.1],
        description: "the stated laser plane is turned about the stripe",
        make: |v| Fault::Sensor(SensorError::PlaneTiltAboutStripe { angle_rad: v[0] * DEG }),
    },
    FaultName {
        name: "plane-tilt-range",
        units: "deg",
        defaults: &[0.1],
        description: "the stated laser plane is turned about the range direction",
        make: |v| Fault::Sensor(SensorError::PlaneTiltAboutRange { angle_rad: v[0] * DEG }),
    },
    FaultName {
        name: "focal",
        units: "%",
        defaults: &[0.5],
        description: "the stated focal lengths are too large",
        make: |v| Fault::Sensor(SensorError::Focal { share: v[0] * PERCENT }),
    },
    FaultName {
        name: "principal-point-u",
        units: "px",
        defaults: &[20.0],
        description: "the stated principal point is too far right",
        make: |v| Fault::Sensor(SensorError::PrincipalPointU { shift_px: v[0] }),
    },
    FaultName {
        name: "principal-point-v",
        units: "px",
        defaults: &[20.0],
        description: "the stated principal point is too far down",
        make: |v| Fault::Sensor(SensorError::PrincipalPointV { shift_px: v[0] }),
    },
    FaultName {
        name: "distortion",
        units: "k1",
        defaults: &[-0.08],
        description: "this much of k1 is left out of the stated distortion",
        make: |v| Fault::Sensor(SensorError::Distortion { k1: v[0] }),
    },
    FaultName {
        name: "profile-width",
        units: "%",
        defaults: &[0.5],
        description: "a profiler reports widths too large",
        make: |v| Fault::Sensor(SensorError::ProfileWidth { share: v[0] * PERCENT }),
    },
    FaultName {
        name: "profile-depth",
        units: "%",
        defaults: &[0.5],
        description: "a profiler reports depths too large",
        make: |v| Fault::Sensor(SensorError::ProfileDepth { share: v[0] * PERCENT }),
    },
    FaultName {
        name: "profile-shear",
        units: "deg",
        defaults: &[0.3],
        description: "a profiler's range axis leans towards its width axis",
        make: |v| Fault::Sensor(SensorError::ProfileShear { angle_rad: v[0] * DEG }),
    },
    FaultName {
        name: "bow-across",
        units: "mm",
        defaults: &[0.2],
        description: "the seam is an arc sideways: sagitta over the scan",
        make: |v| Fault::Seam(SeamForm::BowAcross { sagitta_m: v[0] * MM }),
    },
    FaultName {
        name: "bow-height",
        units: "mm",
        defaults: &[0.2],
        description: "the seam is an arc in height: sagitta over the scan",
        make: |v| Fault::Seam(SeamForm::BowHeight { sagitta_m: v[0] * MM }),
    },
    FaultName {
        name: "wobble",
        units: "mm,mm",
        defaults: &[0.1, 5.0],
        description: "the seam wanders: standard deviation, correlation length",
        make: |v| Fault::Seam(SeamForm::Wobble { sigma_m: v[0] * MM, correlation_length_m: v[1] * MM }),
    },
    FaultName {
        name: "robot-field",
        units: "mm,mm",
        defaults: &[0.1, 500.0],
        description: "the robot's position error depends on the place: RMS, wavelength",
        make: |v| Fault::Robot(RobotError::PositionField { rms_m: v[0] * MM, wavelength_m: v[1] * MM }),
    },
    FaultName {
        name: "robot-attitude",
        units: "deg,mm",
        defaults: &[0.05, 500.0],
        description: "the robot's attitude error depends on the place: RMS, wavelength",
        make: |v| Fault::Robot(RobotError::AttitudeField { rms_rad: v[0] * DEG, wavelength_m: v[1] * MM }),
    },
    FaultName {
        name: "robot-arm",
        units: "mm",
        defaults: &[0.3],
        description: "a six-axis arm with this RMS error over its workspace",
        make: |v| Fault::Robot(RobotError::Arm { rms_m: v[0] * MM }),
    },
    FaultName {
        name: "flex",
        units: "mm per m/s2",
        defaults: &[0.05],
        description: "the tool gives way when it is accelerated",
        make: |v| Fault::Robot(RobotError::Flex { m_per_m_s2: v[0] * MM }),
    },
    FaultName {
        name: "backlash",
        units: "mm",
        defaults: &[0.02],
        description: "play in each axis of the position",
        make: |v| Fault::Robot(RobotError::Backlash { width_m: v[0] * MM }),
    },
    FaultName {
        name: "command-lag",
        units: "ms",
        defaults: &[20.0],
        description: "the stream reports the command; the tool follows as a first-order lag",
        make: |v| Fault::Robot(RobotError::CommandLag { time_constant_s: v[0] * MS }),
    },
    FaultName {
        name: "attitude-lag",
        units: "ms",
        defaults: &[2.0],
        description: "the reported attitude is older than the position",
        make: |v| Fault::Robot(RobotError::AttitudeLag { lag_s: v[0] * MS }),
    },
    FaultName {
        name: "bias-work-angle",
        units: "px per 10 deg",
        defaults: &[0.2],
        description: "detector bias that follows the tilt about the seam",
        make: |v| Fault::Feature(FeatureError::BiasByWorkAngle { px_per_rad: v[0] / (10.0 * DEG) }),
    },
    FaultName {
        name: "bias-travel-angle",
        units: "px per 10 deg",
        defaults: &[0.2],
        description: "detector bias that follows the tilt about the stripe",
        make: |v| Fault::Feature(FeatureError::BiasByTravelAngle { px_per_rad: v[0] / (10.0 * DEG) }),
    },
    FaultName {
        name: "bias-spin",
        units: "px per 10 deg",
        defaults: &[0.2],
        description: "detector bias that follows the spin about the view",
        make: |v| Fault::Feature(FeatureError::BiasBySpin { px_per_rad: v[0] / (10.0 * DEG) }),
    },
    FaultName {
        name: "bias-side",
        units: "px",
        defaults: &[0.5],
        description: "detector bias by the side of the image",
        make: |v| Fault::Feature(FeatureError::BiasBySide { bias_px: v[0] }),
    },
    FaultName {
        name: "rolling-shutter",
        units: "ms",
        defaults: &[10.0],
        description: "rows are exposed one after the other: first to last row",
        make: |v| Fault::Feature(FeatureError::RollingShutter { readout_s: v[0] * MS }),
    },
    FaultName {
        name: "parallel-line",
        units: "mm,%",
        defaults: &[3.0, 40.0],
        description: "some features are of a parallel line: distance, share",
        make: |v| Fault::Feature(FeatureError::ParallelLine { beside_m: v[0] * MM, share: v[1] * PERCENT }),
    },
    FaultName {
        name: "parallel-line-at-end",
        units: "mm,%",
        defaults: &[3.0, 40.0],
        description: "the last features are of a parallel line: distance, share",
        make: |v| {
            Fault::Feature(FeatureError::ParallelLineAtEnd { beside_m: v[0] * MM, share: v[1] * PERCENT })
        },
    },
    FaultName {
        name: "correlated-noise",
        units: "mm",
        defaults: &[0.2],
        description: "noise of the seam point that lasts from frame to frame",
        make: |v| Fault::Feature(FeatureError::CorrelatedNoise { sigma_m: v[0] * MM }),
    },
    FaultName {
        name: "image-grain",
        units: "ms",
        defaults: &[1.0],
        description: "image stamps are cut to whole multiples",
        make: |v| Fault::Stream(StreamError::ImageGrain { grain_s: v[0] * MS }),
    },
    FaultName {
        name: "robot-grain",
        units: "ms",
        defaults: &[1.0],
        description: "robot stamps are cut to whole multiples",
        make: |v| Fault::Stream(StreamError::RobotGrain { grain_s: v[0] * MS }),
    },
    FaultName {
        name: "offset-drift",
        units: "ms",
        defaults: &[1.0],
        description: "the time offset grows evenly over the scan",
        make: |v| Fault::Stream(StreamError::OffsetDrift { change_s: v[0] * MS }),
    },
    FaultName {
        name: "offset-swing",
        units: "ms",
        defaults: &[1.0],
        description: "the time offset swings once over the scan: amplitude",
        make: |v| Fault::Stream(StreamError::OffsetSwing { amplitude_s: v[0] * MS }),
    },
    FaultName {
        name: "offset-step",
        units: "ms",
        defaults: &[1.0],
        description: "the time offset steps half way through",
        make: |v| Fault::Stream(StreamError::OffsetStep { step_s: v[0] * MS }),
    },
    FaultName {
        name: "doubled-frames",
        units: "%",
        defaults: &[5.0],
        description: "frames that repeat the picture before",
        make: |v| Fault::Stream(StreamError::DoubledFrames { share: v[0] * PERCENT }),
    },
    FaultName {
        name: "uncounted-losses",
        units: "%",
        defaults: &[5.0],
        description: "lost frames that the counter does not count",
        make: |v| Fault::Stream(StreamError::UncountedLosses { share: v[0] * PERCENT }),
    },
    FaultName {
        name: "frame-slip",
        units: "frames",
        defaults: &[1.0],
        description: "from half way on features carry a later frame's stamp",
        make: |v| Fault::Stream(StreamError::FrameSlip { frames: v[0] }),
    },
    FaultName {
        name: "late-arrival",
        units: "ms",
        defaults: &[5.0],
        description: "frames arrive late by a random time: mean",
        make: |v| Fault::Stream(StreamError::LateArrival { mean_s: v[0] * MS }),
    },
    FaultName {
        name: "bursts",
        units: "",
        defaults: &[],
        description: "twenty bad frames in a row, three times",
        make: |_| Fault::Event(Event::Bursts),
    },
    FaultName {
        name: "second-line",
        units: "",
        defaults: &[],
        description: "for a quarter of the scan the detector follows a parallel edge 5 mm beside",
        make: |_| Fault::Event(Event::SecondLine),
    },
    FaultName {
        name: "robot-gaps",
        units: "",
        defaults: &[],
        description: "the robot stream is silent for 0.4 s, twice",
        make: |_| Fault::Event(Event::RobotGaps),
    },
    FaultName {
        name: "duplicate-rows",
        units: "",
        defaults: &[],
        description: "every 50th robot row is recorded twice",
        make: |_| Fault::Event(Event::DuplicateRows),
    },
    FaultName {
        name: "robot-clock-step",
        units: "",
        defaults: &[],
        description: "the robot's clock is set forward by 80 ms two thirds through",
        make: |_| Fault::Event(Event::RobotClockStep),
    },
    FaultName {
        name: "late-images",
        units: "",
        defaults: &[],
        description: "from two thirds on images arrive 45 ms later",
        make: |_| Fault::Event(Event::LateImages),
    },
];
