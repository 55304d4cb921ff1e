//! Quantities that may change, their order and their units.
//!
//! Inside the detector every number is counted in units of a change that matters: 0.1 ms, 0.05°, 0.1 mm, 0.3
//! %, 1e-4 per mm. So one threshold on eigenvalues serves all of them.

use std::ops::Range;

/// Column of the time offset.
pub const TIME_OFFSET: usize = 0;
/// First column of the hand-eye rotation (left perturbation, tool frame).
pub const ROTATION: usize = 1;
/// First column of the hand-eye translation (tool frame).
pub const TRANSLATION: usize = 4;
/// First column of the shape of the laser plane.
pub const SHAPE: usize = 7;
/// Number of columns of the calibration, θ.
pub const CALIBRATION: usize = 12;
/// First column of the part's translation in base.
pub(crate) const PART_TRANSLATION: usize = 12;
/// First column of the part's rotation about its middle, base axes.
pub(crate) const PART_ROTATION: usize = 15;
/// Number of all columns, θ and ψ.
pub const ALL: usize = 18;

const TIME_UNIT_S: f64 = 1e-4;
/// 0.05°.
const ANGLE_UNIT_RAD: f64 = 8.726_646_259_971_648e-4;
const LENGTH_UNIT_M: f64 = 1e-4;
const SCALE_UNIT: f64 = 3e-3;
/// 1e-4 per mm.
const KEYSTONE_UNIT_PER_M: f64 = 0.1;

/// The unit of each column, SI.
pub const UNITS: [f64; ALL] = [
    TIME_UNIT_S,
    ANGLE_UNIT_RAD,
    ANGLE_UNIT_RAD,
    ANGLE_UNIT_RAD,
    LENGTH_UNIT_M,
    LENGTH_UNIT_M,
    LENGTH_UNIT_M,
    SCALE_UNIT,
    SCALE_UNIT,
    SCALE_UNIT,
    KEYSTONE_UNIT_PER_M,
    KEYSTONE_UNIT_PER_M,
    LENGTH_UNIT_M,
    LENGTH_UNIT_M,
    LENGTH_UNIT_M,
    ANGLE_UNIT_RAD,
    ANGLE_UNIT_RAD,
    ANGLE_UNIT_RAD,
];

/// Quantities that can have changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// The time offset: camera, clocks, network.
    Timing,
    /// The hand-eye transform: the sensor's bracket, or the tool.
    Bracket,
    /// The sensor itself: scale, shear or keystone of its laser plane.
    Sensor,
    /// Pose of the part: fixture, or the seam itself.
    Seam,
}

impl Kind {
    /// All, in the order of their columns.
    pub const ALL: [Self; 4] = [Self::Timing, Self::Bracket, Self::Sensor, Self::Seam];

    /// Its columns among [`ALL`].
    #[must_use]
    pub fn columns(self) -> Range<usize> {
        match self {
            Self::Timing => TIME_OFFSET..ROTATION,
            Self::Bracket => ROTATION..SHAPE,
            Self::Sensor => SHAPE..CALIBRATION,
            Self::Seam => CALIBRATION..ALL,
        }
    }

    /// The word in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Timing => "timing",
            Self::Bracket => "bracket",
            Self::Sensor => "sensor",
            Self::Seam => "seam",
        }
    }
}
