//! The user's options. Every field has a sensible default.

pub mod known_of_cell;

use crate::config::known_of_cell::KnownOfCell;
use nalgebra::{UnitVector3, Vector3};
use trueline_geometry::{Line, Polyline};
use trueline_lsq::Loss;

/// The minimised residual.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ResidualKind {
    /// Measured point minus the line's intersection with the laser sheet: maximum likelihood.
    #[default]
    Sheet,
    /// Distance of the point from the line in base, as in the paper.
    PointToLine,
}

impl ResidualKind {
    /// The name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Sheet => "sheet",
            Self::PointToLine => "point-to-line",
        }
    }
}

/// A group of unknowns that is held at its initial value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Hold {
    /// The time offset.
    TimeOffset,
    /// Hand-eye rotation and translation.
    HandEye,
}

impl Hold {
    /// The name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::TimeOffset => "time-offset",
            Self::HandEye => "hand-eye",
        }
    }
}

/// Standard deviations of the held values. `None` treats a value as exact.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct HeldSigma {
    /// Time offset, s.
    pub time_s: Option<f64>,
    /// Hand-eye rotation about any axis, rad.
    pub rotation_rad: Option<f64>,
    /// Hand-eye translation along any axis, m.
    pub translation_m: Option<f64>,
}

/// A line held at its position in a drawing, or in a measurement of the part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DrawnLine {
    /// Its number among the features.
    pub line: usize,
    /// Its position in base.
    pub line_in_base: Line,
    /// Standard deviation of its direction about any axis, rad.
    pub direction_sigma_rad: f64,
    /// Standard deviation of its place in any direction, at the middle of the scan, m.
    pub offset_sigma_m: f64,
}

impl DrawnLine {
    /// Points closer than this do not define a direction, m.
    const NEAREST_M: f64 = 1e-3;

    /// Through two points in base, each with a standard deviation of `sigma_m` in any direction. `None` for points less than a millimetre apart.
    #[must_use]
    pub fn through(line: usize, points_in_base: [Vector3<f64>; 2], sigma_m: f64) -> Option<Self> {
        let [from, to] = points_in_base;
        let direction = UnitVector3::try_new(to - from, Self::NEAREST_M)?;
        Some(Self {
            line,
            line_in_base: Line::new(from, &direction),
            direction_sigma_rad: std::f64::consts::SQRT_2 * sigma_m / (to - from).norm(),
            offset_sigma_m: sigma_m,
        })
    }
}

/// Time stamps to use.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Stamps {
    /// The stamps that fit the data better: the clock's, if they leave clearly smaller residuals.
    #[default]
    Auto,
    /// As recorded.
    Raw,
    /// Those of the underlying clock of each stream with a regular tick.
    Regular,
}

impl Stamps {
    /// The name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Raw => "raw",
            Self::Regular => "regular",
        }
    }
}

/// Treatment of the sensor's own calibration.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SensorMode {
    /// It is held as in its file; its stated uncertainty goes into the covariance.
    Fixed,
    /// The shape of its sheet is estimated with its prior.
    #[default]
    Prior,
    /// The shape is estimated from the scan alone.
    Free,
}

impl SensorMode {
    /// The name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Fixed => "fixed",
            Self::Prior => "prior",
            Self::Free => "free",
        }
    }
}

/// Measurement of the joint to use: the seam point, or the plates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Measurements {
    /// Whole stripes if most frames show both plates and agree with the seam points. Else the seam points.
    #[default]
    Auto,
    /// Seam points.
    Seam,
    /// The stripes on the plates.
    Stripe,
    /// The stripes, and the seam points of frames without both plates.
    Both,
}

impl Measurements {
    /// The name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Seam => "seam",
            Self::Stripe => "stripe",
            Self::Both => "both",
        }
    }
}

/// Largest standard deviation of a useful seam point, m.
pub const SEAM_ERROR_CEILING_M: f64 = 1e-3;

/// The same where the errors of robot and sensor are not estimated with the answer, at stops say: the seam error contains them as large as
/// they may be, m.
pub const CONSIDERED_CEILING_M: f64 = 10e-3;

/// Standard deviations that a result must reach to be accepted; `None` asks for nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Requirement {
    /// A later seam point, m. `None` is [`SEAM_ERROR_CEILING_M`].
    pub seam_m: Option<f64>,
    /// Time offset, s.
    pub time_s: Option<f64>,
    /// Hand-eye rotation about any axis, rad.
    pub rotation_rad: Option<f64>,
    /// Hand-eye translation along any axis, m.
    pub translation_m: Option<f64>,
}

/// The scanned target.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Target {
    /// A seam: a straight line with a bow, or a curve if no line explains the scan.
    #[default]
    Seam,
    /// A straight line with a bow. Curves are not tried.
    Line,
    /// A curve. A line is not accepted.
    Curve,
}

impl Target {
    /// The name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Seam => "seam",
            Self::Line => "line",
            Self::Curve => "curve",
        }
    }
}

/// A drawing of the seam, in the part's own frame. The position of the part is unknown.
#[derive(Clone, Debug, PartialEq)]
pub struct SeamCad {
    /// The file that it was read from.
    pub file: String,
    /// The curve, m.
    pub curve: Polyline,
    /// Standard deviation of the seam from the drawing, in any direction at each knot, and of the size of the part, m.
    pub tolerance_m: f64,
}

/// Scatter of the place of a part between two passes of a scan: that of its fixture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PartMoves {
    /// Standard deviation of each shift, m.
    pub shift_m: f64,
    /// Standard deviation of the turn about each axis through the middle of the curve, rad.
    pub turn_rad: f64,
}

impl PartMoves {
    /// Scatter of a usual fixture.
    pub(crate) const USUAL: Self = Self { shift_m: 0.3e-3, turn_rad: 1.75e-3 };
}

/// Use of a seam point, for the error at the torch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Use {
    /// Speed along the seam, m/s.
    pub speed_m_s: f64,
    /// Distance of the seam from the sensor's origin, m; `None` is the scan's own.
    pub stand_off_m: Option<f64>,
    /// Whether another robot uses it. The uncertainty is then that of the true transform.
    pub by_another_robot: bool,
}

impl Default for Use {
    fn default() -> Self {
        Self { speed_m_s: 0.050, stand_off_m: None, by_another_robot: false }
    }
}

/// How to calibrate.
#[derive(Clone, Debug, PartialEq)]
pub struct Config {
    /// The scanned target.
    pub target: Target,
    /// Measurement of the joint to use.
    pub measurements: Measurements,
    /// The residual.
    pub residual: ResidualKind,
    /// Robust loss on the whitened residual. `None` selects the residual's default: see [`Config::final_loss`].
    pub loss: Option<Loss>,
    /// Whether the robot stands at each reading. Then there is no time offset, and stamps only pair readings with poses.
    pub at_stops: bool,
    /// Groups held at their initial values.
    pub hold: Vec<Hold>,
    /// Their standard deviations.
    pub held_sigma: HeldSigma,
    /// Lines that are held where a drawing has them.
    pub drawn_lines: Vec<DrawnLine>,
    /// A drawing of a curved seam.
    pub seam_cad: Option<SeamCad>,
    /// Scatter of the part's place between the passes over its seam; `None` if it stays.
    pub part_moves: Option<PartMoves>,
    /// Expected standard deviation of a feature, px, if the recording does not state it; `None` is [`USUAL_FEATURE_SIGMA_PX`].
    pub feature_sigma_px: Option<f64>,
    /// The same for sensors that report lengths, m; `None` is [`USUAL_FEATURE_SIGMA_M`].
    pub feature_sigma_m: Option<f64>,
    /// Standard deviation of the robot's position, per axis, m; `None` measures it on the recording.
    pub robot_sigma_m: Option<f64>,
    /// Expected jitter of an image stamp, s; `None` measures it on the recording.
    pub stamp_sigma_s: Option<f64>,
    /// Time stamps to use.
    pub stamps: Stamps,
    /// Treatment of the sensor's own calibration.
    pub sensor: SensorMode,
    /// Absolute accuracy of the robot, m; `None` is the value in the recording's sensor file, or
    /// [`ASSUMED_ROBOT_ACCURACY_M`].
    pub robot_accuracy_m: Option<f64>,
    /// Bias of the features for each 10° of tilt, px.
    pub feature_bias_px: f64,
    /// Radius of the seam's edge, m; `None` is the value in the recording's sensor file, or [`ASSUMED_EDGE_RADIUS_M`].
    pub edge_radius_m: Option<f64>,
    /// RMS of the seam's form beyond a bow, m. `None` is the value in the recording's sensor file, or [`ASSUMED_WAVINESS_M`] as an initial value
    /// that the scan corrects.
    pub waviness_m: Option<f64>,
    /// Whether unobservable directions may be held at the initial guess.
    pub accept_partial: bool,
    /// Required accuracy.
    pub require: Requirement,
    /// Prior knowledge of the cell, which decides if the scan cannot.
    pub known: KnownOfCell,
    /// Use of the calibration.
    pub used_at: Use,
    /// The time offset is searched within plus and minus this, s.
    pub offset_search_s: f64,
    /// Threads for the starts of a search, and for the sums of scans of more than 16 384 features. The result does not depend on it.
    pub threads: usize,
}

/// Assumed absolute accuracy of a robot, m. Uncalibrated arms reach 0.2 to 0.8 mm.
pub const ASSUMED_ROBOT_ACCURACY_M: f64 = 0.5e-3;

/// Assumed radius of an edge, m: that of a sheared or folded sheet.
pub const ASSUMED_EDGE_RADIUS_M: f64 = 0.3e-3;

/// Assumed RMS of a seam's form, m: that of a clamped and tacked part.
pub const ASSUMED_WAVINESS_M: f64 = 0.06e-3;

/// Assumed standard deviation of a feature in an image, px.
pub const USUAL_FEATURE_SIGMA_PX: f64 = 0.3;

/// Assumed standard deviation of a feature of a sensor that reports lengths, m.
pub const USUAL_FEATURE_SIGMA_M: f64 = 0.02e-3;

impl Default for Config {
    fn default() -> Self {
        Self {
            target: Target::Seam,
            measurements: Measurements::Auto,
            residual: ResidualKind::Sheet,
            loss: None,
            at_stops: false,
            hold: Vec::new(),
            held_sigma: HeldSigma::default(),
            drawn_lines: Vec::new(),
            seam_cad: None,
            part_moves: None,
            feature_sigma_px: None,
            feature_sigma_m: None,
            robot_sigma_m: None,
            stamp_sigma_s: None,
            stamps: Stamps::Auto,
            sensor: SensorMode::Prior,
            robot_accuracy_m: None,
            feature_bias_px: 0.2,
            edge_radius_m: None,
            waviness_m: None,
            accept_partial: false,
            require: Requirement::default(),
            known: KnownOfCell::default(),
            used_at: Use::default(),
            offset_search_s: 1.2,
            threads: 1,
        }
    }
}

impl Config {
    /// Whether an option requires a curve, so that a straight seam is no answer.
    #[must_use]
    pub fn asks_for_curve(&self) -> bool {
        self.target == Target::Curve || self.seam_cad.is_some() || self.part_moves.is_some()
    }

    /// Expected standard deviation of a feature that the recording does not state, px.
    #[must_use]
    pub fn usual_feature_sigma_px(&self) -> f64 {
        self.feature_sigma_px.unwrap_or(USUAL_FEATURE_SIGMA_PX)
    }

    /// The same for sensors that report lengths, m.
    #[must_use]
    pub fn usual_feature_sigma_m(&self) -> f64 {
        self.feature_sigma_m.unwrap_or(USUAL_FEATURE_SIGMA_M)
    }

    /// The length that counts as a pixel if features are lengths, m: the ratio of the usual noise there to that of 0.3 px in an image.
    #[must_use]
    pub fn length_per_px_m(&self) -> f64 {
        self.usual_feature_sigma_m() / USUAL_FEATURE_SIGMA_PX
    }

    /// Options with noise as the only error: the sensor is exact, the robot ideal, the features free of bias. A sensor whose file states its
    /// uncertainty keeps that.
    #[must_use]
    pub fn noise_only() -> Self {
        Self {
            sensor: SensorMode::Fixed,
            robot_accuracy_m: Some(0.0),
            feature_bias_px: 0.0,
            edge_radius_m: Some(0.0),
            waviness_m: Some(0.0),
            ..Self::default()
        }
    }

    /// The loss of the last solve. Huber for the paper's residual \[Yang2025, Eq. 16\]. Tukey's biweight for the sheet: it is 99.2 % efficient on
    /// Gaussian data (two components) and rejects everything beyond 8 σ.
    #[must_use]
    pub fn final_loss(&self) -> Loss {
        self.loss.unwrap_or(match self.residual {
            ResidualKind::Sheet => Loss::Tukey { scale: 8.0 },
            ResidualKind::PointToLine => Loss::Huber { scale: 3.0 },
        })
    }
}
