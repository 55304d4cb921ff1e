//! Statements of `sensor.toml` besides the sensor itself: its uncertainty, its mounting, and the robot's accuracy.

use nalgebra::DMatrix;
pub use trueline_model::SheetShape;

/// Everything in `sensor.toml` that is not camera and laser plane. All of it is optional.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SensorSetup {
    /// Uncertainty of the sensor's own calibration: the prior of the joint estimate.
    pub uncertainty: Option<SensorUncertainty>,
    /// A correction of the sheet's coordinates, found by an earlier calibration.
    pub shape: Option<SheetShape>,
    /// Absolute accuracy of the robot (m), as its data sheet states it; 0 is an ideal robot.
    pub robot_accuracy_m: Option<f64>,
    /// Radius of the seam's edge (m): a detector finds its outermost point. 0 is a sharp edge, or a point where two lines
    /// cross.
    pub edge_radius_m: Option<f64>,
    /// Root mean square of the seam's form beyond a bow (m); 0 is a seam without any.
    pub waviness_m: Option<f64>,
    /// Carrier of the sensor; [`Mounted::Tool`] if the file does not state it.
    pub mounted: Mounted,
    /// The part of the field of view that counts.
    pub region_of_interest: Option<RegionOfInterest>,
}

/// Carrier of the sensor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mounted {
    /// The robot carries the sensor.
    #[default]
    Tool,
    /// The sensor stands beside the robot, which carries the part.
    Fixed,
}

impl Mounted {
    /// The carrier in words.
    #[must_use]
    pub fn in_words(self) -> &'static str {
        match self {
            Self::Tool => "on the tool",
            Self::Fixed => "beside the robot",
        }
    }
}

/// One standard deviation of each property of a sensor; `None` if it was not stated.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SensorUncertainty {
    /// Offset of the laser plane along its normal, m.
    pub plane_offset_m: Option<f64>,
    /// Normal of the laser plane about each of two axes in it, rad.
    pub plane_normal_rad: Option<f64>,
    /// Focal lengths, each, as a fraction.
    pub focal: Option<f64>,
    /// Principal point along each axis, px.
    pub principal_point_px: Option<f64>,
    /// Profilers: width and depth scale, each, as a fraction.
    pub scale: Option<f64>,
    /// Profilers: shear of the sheet, rad.
    pub shear_rad: Option<f64>,
    /// Profilers: change of scale over [`KEYSTONE_REACH_M`] along each axis, as a fraction.
    pub keystone: Option<f64>,
    /// The joint covariance, as `trueline sensor` writes it. If present, it counts, and the single numbers beside it
    /// are for people.
    pub covariance: Option<SensorCovariance>,
    /// SHA-256 of the files of the scans behind these values: none of them is counted again. Empty if no scan is in it.
    pub found_from: Vec<String>,
}

/// The distance from the middle of the field at which a profiler's keystone is stated, m.
pub const KEYSTONE_REACH_M: f64 = 0.030;

/// Joint covariance of a sensor's parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct SensorCovariance {
    /// The parameters, in the order of rows and columns; parameters that are not listed are held exact.
    pub order: Vec<SensorParameter>,
    /// Symmetric, positive semi-definite, in px, rad and m.
    pub matrix: DMatrix<f64>,
}

/// A parameter of a sensor's own calibration.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum SensorParameter {
    /// Focal length along u, px.
    Fx,
    /// Focal length along v, px.
    Fy,
    /// Principal point along u, px.
    Cx,
    /// Principal point along v, px.
    Cy,
    /// Radial distortion k₁.
    K1,
    /// Radial distortion k₂.
    K2,
    /// Tangential distortion p₁.
    P1,
    /// Tangential distortion p₂.
    P2,
    /// Radial distortion k₃.
    K3,
    /// Tilt of the plane's normal toward the sheet's first axis, rad: n ← n + θ e₁, with e₁ and e₂ the axes of
    /// [`trueline_model::LaserSheet::from_plane`].
    NormalE1,
    /// Tilt of the plane's normal toward the sheet's second axis, rad.
    NormalE2,
    /// Offset of the plane, m.
    Offset,
    /// Profilers and points: h₁ of the shape, about the origin of `[shape]`, and without one about the middle of the scan.
    H1,
    /// h₂.
    H2,
    /// h₃.
    H3,
    /// h₄, 1/m.
    H4,
    /// h₅, 1/m.
    H5,
}

impl SensorParameter {
    /// All, in their usual order.
    pub const ALL: [Self; 17] = [
        Self::Fx,
        Self::Fy,
        Self::Cx,
        Self::Cy,
        Self::K1,
        Self::K2,
        Self::P1,
        Self::P2,
        Self::K3,
        Self::NormalE1,
        Self::NormalE2,
        Self::Offset,
        Self::H1,
        Self::H2,
        Self::H3,
        Self::H4,
        Self::H5,
    ];

    /// The parameters of a shape, in their order.
    pub const SHAPE: [Self; 5] = [Self::H1, Self::H2, Self::H3, Self::H4, Self::H5];

    /// The name in `sensor.toml`, with its unit.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Fx => "fx_px",
            Self::Fy => "fy_px",
            Self::Cx => "cx_px",
            Self::Cy => "cy_px",
            Self::K1 => "k1",
            Self::K2 => "k2",
            Self::P1 => "p1",
            Self::P2 => "p2",
            Self::K3 => "k3",
            Self::NormalE1 => "normal_e1_rad",
            Self::NormalE2 => "normal_e2_rad",
            Self::Offset => "offset_mm",
            Self::H1 => "h1",
            Self::H2 => "h2",
            Self::H3 => "h3",
            Self::H4 => "h4_per_mm",
            Self::H5 => "h5_per_mm",
        }
    }
}

/// The part of the field of view that counts; both ends belong to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RegionOfInterest {
    /// Of a camera: from and to, px.
    Pixels {
        /// Columns.
        u_px: [f64; 2],
        /// Rows.
        v_px: [f64; 2],
    },
    /// Of a profiler or points: from and to, m.
    Sheet {
        /// Along the stripe.
        x_m: [f64; 2],
        /// Range.
        z_m: [f64; 2],
    },
}
