//! Every error of a shop: median size, spread, share of the cells that have it, and where the figures are from.
//!
//! Sources: `README` is the population of the project's 37 given cells (shared/data/shop); `report` is its study
//! (shared/design/shop.md); `own` a figure that neither states.

use std::f64::consts::LN_2;

/// A kind of error.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum ShopError {
    /// Links of other lengths and twists than the controller's.
    ArmGeometry,
    /// Transmission error of strain-wave gears.
    GearRipple,
    /// Joints that lag behind their encoder by the direction of motion.
    Hysteresis,
    /// Joints that yield to gravity and acceleration.
    Sag,
    /// Links that grow while they warm up.
    WarmUp,
    /// A log of the commanded poses.
    CommandedPoses,
    /// A log of means over the past.
    MovingMean,
    /// Logged poses with few digits.
    QuantisedPoses,
    /// A log that is read more often than the controller renews the pose.
    PolledLog,
    /// Packets that arrive late.
    LatePackets,
    /// A PC that stalls.
    Stalls,
    /// Packets and images that are lost.
    LostPackets,
    /// Stamps cut to milliseconds.
    MillisecondStamps,
    /// Clocks that run apart.
    ClockSkew,
    /// A clock that is set during the scan.
    ClockStep,
    /// Focal length, centre and distortion of the camera.
    Intrinsics,
    /// Place and direction of the laser plane.
    LaserPlane,
    /// Scale, shear and keystone of a profiler.
    ProfileShape,
    /// Waves in a profiler's depth.
    Linearity,
    /// A laser sheet that is not plane.
    BentSheet,
    /// Lens terms that the file does not have.
    LensTerms,
    /// Rows exposed one after the other.
    RollingShutter,
    /// Exposure that follows the brightness.
    AutomaticExposure,
    /// A sensor that moves while it warms up.
    SensorWarming,
    /// Noise of the detected point.
    FeatureNoise,
    /// A seam that is bowed.
    Bow,
    /// A seam that is wavy.
    Waviness,
    /// Tack welds on the seam.
    Tacks,
    /// A seam bent by heat: cubic, with a kink.
    HeatBend,
    /// A rounded edge; the detector finds its outermost point.
    RoundedEdge,
    /// Spatter.
    Spatter,
    /// Reflections, which stay for some frames.
    Reflections,
    /// Stretches without a feature.
    Gaps,
    /// Stretches on the other edge of the joint.
    OtherEdge,
}

/// The unit of a size: its name and its size in SI.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SizeUnit(pub &'static str, pub f64);

const MM: SizeUnit = SizeUnit("mm", 1e-3);
const UM_PER_MIN: SizeUnit = SizeUnit("µm/min", 1e-6 / 60.0);
const MM_PER_MIN: SizeUnit = SizeUnit("mm/min", 1e-3 / 60.0);
const MS: SizeUnit = SizeUnit("ms", 1e-3);
const PPM: SizeUnit = SizeUnit("ppm", 1e-6);
const PERCENT: SizeUnit = SizeUnit("%", 1e-2);
const PX: SizeUnit = SizeUnit("px", 1.0);
const ARCSEC: SizeUnit = SizeUnit("arcsec", std::f64::consts::PI / 648_000.0);

/// A row of the table.
#[derive(Clone, Copy, Debug)]
pub struct ErrorRow {
    /// The kind.
    pub error: ShopError,
    /// Its name on the command line and in files.
    pub name: &'static str,
    /// Median size in an ordinary shop.
    pub median: f64,
    /// Unit of the size.
    pub unit: SizeUnit,
    /// Standard deviation of the logarithm of the size.
    pub spread: f64,
    /// Share of the cells of an ordinary shop that have it; 1 is always, at any level.
    pub share: f64,
    /// Source of the figures.
    pub source: &'static str,
    /// The quantity of the size.
    pub what: &'static str,
}

/// A range that is given as such holds 90 % of the sizes: its ends are ± this many spreads.
const RANGE_SPREADS: f64 = 1.645;
/// ln of (upper / lower) of these ranges, halved: 0.2–0.8, a doubling, 8–40, 0.001–0.01, 1–5, 0.5–8, 0.25–0.7.
const FOURFOLD: f64 = LN_2 / RANGE_SPREADS;
const TWOFOLD: f64 = 0.5 * LN_2 / RANGE_SPREADS;
const FIVEFOLD: f64 = 0.804_719 / RANGE_SPREADS;
const TENFOLD: f64 = 1.151_293 / RANGE_SPREADS;
const SIXTEENFOLD: f64 = 2.0 * LN_2 / RANGE_SPREADS;
const NOISE: f64 = 0.514_810 / RANGE_SPREADS;
/// Spread of sizes with only a known median (own): nine of ten lie within a factor of 2.3.
const USUAL: f64 = 0.5;

use ShopError as E;

const fn row(
    (error, name): (ShopError, &'static str),
    (median, unit): (f64, SizeUnit),
    spread: f64,
    share: f64,
    (source, what): (&'static str, &'static str),
) -> ErrorRow {
    ErrorRow { error, name, median, unit, spread, share, source, what }
}

/// The ordinary shop.
#[rustfmt::skip]
pub const TABLE: [ErrorRow; 34] = [
    row((E::ArmGeometry, "arm-geometry"), (0.4, MM), FOURFOLD, 1.0, ("README", "RMS position error over the workspace, mean removed")),
    row((E::GearRipple, "gear-ripple"), (5.66, ARCSEC), TWOFOLD, 1.0, ("README", "amplitude at 2 cycles a turn of the generator, half of it at 4")),
    row((E::Hysteresis, "hysteresis"), (2.83, ARCSEC), TWOFOLD, 1.0, ("README", "half the width, each joint")),
    row((E::Sag, "sag"), (0.1, MM), USUAL, 1.0, ("own", "sag of a tool 1 m from a joint")),
    row((E::WarmUp, "warm-up"), (6.0, UM_PER_MIN), USUAL, 1.0, ("README", "growth of each link")),
    row((E::CommandedPoses, "commanded-poses"), (25.0, MS), USUAL, 0.12, ("README", "time constant of the first-order lag, joints 8 % apart")),
    row((E::MovingMean, "moving-mean"), (17.9, MS), FIVEFOLD, 0.30, ("README", "length of the mean")),
    row((E::QuantisedPoses, "quantised-poses"), (0.00316, MM), TENFOLD, 1.0, ("README", "step of positions; angles: a tenth of it in degrees for mm")),
    row((E::PolledLog, "polled-log"), (16.0, MS), 0.3, 0.06, ("own", "time after which the controller renews the pose")),
    row((E::LatePackets, "late-packets"), (0.12, MS), USUAL, 1.0, ("README", "half-normal lateness; 0.5 % are later by an exponential of 25 times that")),
    row((E::Stalls, "stalls"), (15.0, MS), USUAL, 0.35, ("README", "length, every 8 s")),
    row((E::LostPackets, "lost-packets"), (1.0, PERCENT), USUAL, 0.5, ("own", "share of both streams")),
    row((E::MillisecondStamps, "millisecond-stamps"), (1.0, MS), 0.0, 0.08, ("README", "grain of one stream's stamps")),
    row((E::ClockSkew, "clock-skew"), (20.0, PPM), USUAL, 1.0, ("README", "drift of image stamps")),
    row((E::ClockStep, "clock-step"), (2.0, MS), SIXTEENFOLD, 0.03, ("README", "step of image stamps")),
    row((E::Intrinsics, "intrinsics"), (0.08, PERCENT), USUAL, 1.0, ("README", "focal lengths; with 0.08 %: centre 1.5 px, k1 0.004")),
    row((E::LaserPlane, "laser-plane"), (0.05, MM), USUAL, 1.0, ("README", "offset; with 0.05 mm: 0.05° about both axes")),
    row((E::ProfileShape, "profile-shape"), (0.1, PERCENT), USUAL, 1.0, ("README", "scale; with 0.1 %: shear 0.04°, keystone 0.06 %")),
    row((E::Linearity, "linearity"), (0.04, PERCENT), USUAL, 1.0, ("README", "amplitude of the waves, of the range")),
    row((E::BentSheet, "bent-sheet"), (0.05, MM), USUAL, 0.15, ("README (share), own", "sag of the sheet 20 mm from its middle")),
    row((E::LensTerms, "lens-terms"), (0.0004, SizeUnit("", 1.0)), USUAL, 0.12, ("README (share), own", "tangential terms p1, p2; k3 is 50 times that")),
    row((E::RollingShutter, "rolling-shutter"), (8.0, MS), USUAL, 0.25, ("own", "read-out of an image")),
    row((E::AutomaticExposure, "automatic-exposure"), (2.24, MS), FIVEFOLD, 0.30, ("README (size), own", "exposure in the middle of its range")),
    row((E::SensorWarming, "sensor-warming"), (0.01, MM_PER_MIN), USUAL, 1.0, ("README", "motion along the view")),
    row((E::FeatureNoise, "feature-noise"), (0.42, PX), NOISE, 1.0, ("README", "standard deviation, Student's t of 6; 1 px is 40 µm of profilers and points")),
    row((E::Bow, "bow"), (0.12, MM), USUAL, 1.0, ("README", "sagitta on 300 mm")),
    row((E::Waviness, "waviness"), (0.03, MM), USUAL, 1.0, ("README", "RMS; correlation length 3 to 30 mm")),
    row((E::Tacks, "tacks"), (0.3, MM), USUAL, 0.5, ("README (spacing), own", "height, every 80 to 220 mm")),
    row((E::HeatBend, "heat-bend"), (0.06, MM), USUAL, 1.0, ("README", "cubic, and kink, at the ends of the scan")),
    row((E::RoundedEdge, "rounded-edge"), (0.25, MM), USUAL, 0.6, ("README", "radius")),
    row((E::Spatter, "spatter"), (1.5, PERCENT), USUAL, 1.0, ("README", "share of the features")),
    row((E::Reflections, "reflections"), (3.0, PERCENT), USUAL, 1.0, ("README", "share of the features, in clusters")),
    row((E::Gaps, "gaps"), (4.0, PERCENT), USUAL, 0.5, ("own", "share of the scan")),
    row((E::OtherEdge, "other-edge"), (4.0, PERCENT), USUAL, 0.3, ("README (distance), own", "share of the scan, 2 to 6 mm aside")),
];

impl ShopError {
    /// The row of the table.
    #[must_use]
    pub fn row(self) -> &'static ErrorRow {
        &TABLE[self as usize]
    }

    /// Whether a kind of sensor (`camera`, `profiler`, `points`) can have it.
    #[must_use]
    pub fn is_of(self, sensor: &str) -> bool {
        match self {
            Self::Intrinsics | Self::LaserPlane | Self::LensTerms | Self::RollingShutter => {
                sensor == "camera"
            }
            Self::ProfileShape => sensor != "camera",
            Self::Linearity => sensor == "profiler",
            _ => true,
        }
    }

    /// The kind of a name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        TABLE.iter().find(|row| row.name == name).map(|row| row.error)
    }
}

#[cfg(test)]
mod tests {
    use super::TABLE;

    #[test]
    fn rows_stand_in_the_order_of_the_kinds() {
        for (index, row) in TABLE.iter().enumerate() {
            assert_eq!(row.error as usize, index, "{}", row.name);
            assert_eq!(row.error.row().name, row.name);
        }
    }
}
