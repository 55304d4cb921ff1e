//! The truth of a cell, by which its calibration is judged.

use super::course::Motion;
use super::error_table::ErrorRow;
use super::level::Level;
use nalgebra::Vector3;
use trueline_geometry::Pose;

/// A reading of the check pass.
#[derive(Clone, Copy, Debug)]
pub struct CheckPoint {
    /// Place of the seam point in the tool, m.
    pub in_tool: Vector3<f64>,
    /// Unit direction in the tool in which the sensor moves over the seam.
    pub velocity_in_tool: Vector3<f64>,
    /// The pose that the controller reports.
    pub reported: Pose,
    /// Place that the torch must be sent to for its tip to touch the point: in base, m, in the controller's sense. `None`
    /// out of reach.
    pub torch_reference: Option<Vector3<f64>>,
}

/// The truth of a cell.
#[derive(Clone, Debug)]
pub struct ShopTruth {
    /// The shop.
    pub level: Level,
    /// Seed of the cell.
    pub seed: u64,
    /// Names of the errors that are left, where others were taken out.
    pub only: Option<Vec<&'static str>>,
    /// The motion.
    pub motion: Motion,
    /// The kind of sensor: camera, profiler, points.
    pub sensor: &'static str,
    /// The arm's name.
    pub arm: &'static str,
    /// Duration, s.
    pub duration_s: f64,
    /// Tilt of the sensor about each axis, rad; for a designed scan the RMS rotation from its mean attitude.
    pub tilt_rad: f64,
    /// Share of the images in which the seam is in view.
    pub seen_share: f64,
    /// Share of the features that are outliers.
    pub outlier_share: f64,
    /// The scan's own Cramér–Rao bound of the seam error, m.
    pub bound_m: f64,
    /// Time offset, s: of image stamps against the robot's log, including the log's own delay.
    pub time_offset_s: f64,
    /// Range of the time offset at other times, of other joints, or with the lateness of either stream, s.
    pub time_offset_interval_s: [f64; 2],
    /// Hand-eye transform, in the middle of the scan.
    pub tool_from_camera: Pose,
    /// Reading of the clock at the start of the scan, s.
    pub start_s: f64,
    /// Speed over the seam at which the check points are placed, m/s.
    pub speed_m_s: f64,
    /// The check pass.
    pub points: Vec<CheckPoint>,
    /// Every error that the cell has, with its size in the unit of its row.
    pub errors: Vec<(&'static ErrorRow, f64)>,
}

/// A good scan has this error from its noise alone, m.
const GOOD_BOUND_M: f64 = 0.08e-3;
/// It tilts by more than this, rad.
const GOOD_TILT_RAD: f64 = 6.0 * std::f64::consts::PI / 180.0;
/// Fewer of its features are outliers.
const GOOD_OUTLIERS: f64 = 0.25;
/// The seam is in view in this share of the images.
const GOOD_SEEN: f64 = 0.5;

impl ShopTruth {
    /// Whether the scan deserves an answer.
    #[must_use]
    pub fn is_good_scan(&self) -> bool {
        self.bound_m < GOOD_BOUND_M
            && self.tilt_rad > GOOD_TILT_RAD
            && self.outlier_share < GOOD_OUTLIERS
            && self.seen_share > GOOD_SEEN
            && self.motion.shows_everything()
    }

    /// The cell in words.
    #[must_use]
    pub fn about(&self) -> String {
        let article = if self.level == Level::Ordinary { "an" } else { "a" };
        let alone = match self.only.as_deref() {
            None => String::new(),
            Some([]) => ", without errors".to_owned(),
            Some(names) => format!(", {} alone", names.join(", ")),
        };
        format!("{article} {} shop{alone}", self.level.name())
    }
}
