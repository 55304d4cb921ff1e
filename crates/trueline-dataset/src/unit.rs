//! Units at the end of names: `x_mm`, `time_ns`. Inside, everything is metre and second.

/// Quantity of a column.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// A time stamp.
    Time,
    /// A length.
    Length,
    /// Image coordinates.
    Pixel,
    /// An angle.
    Angle,
    /// A component of a rotation vector: radians alone, since `rx_deg` is something else on most robots.
    RotationVector,
    /// A number without a unit: a quaternion component.
    Plain,
    /// A whole number from 0.
    Count,
    /// Words: a file name.
    Text,
}

impl Quantity {
    /// The suffixes that are understood, the usual one first, with their size in SI.
    #[must_use]
    pub(crate) fn suffixes(self) -> &'static [(&'static str, f64)] {
        match self {
            Self::Time => &[("_s", 1.0), ("_ms", 1e-3), ("_us", 1e-6), ("_ns", 1e-9)],
            Self::Length => &[("_mm", 1e-3), ("_m", 1.0), ("_cm", 1e-2), ("_um", 1e-6), ("_in", 0.0254)],
            Self::Angle => &[("_deg", RAD_PER_DEG), ("_rad", 1.0), ("_mrad", 1e-3), ("_gon", RAD_PER_GON)],
            Self::RotationVector => &[("_rad", 1.0)],
            Self::Pixel => &[("_px", 1.0)],
            Self::Plain | Self::Count | Self::Text => &[("", 1.0)],
        }
    }

    /// The usual suffix.
    #[must_use]
    pub(crate) fn usual_suffix(self) -> &'static str {
        self.suffixes()[0].0
    }
}

/// Metres to the millimetres of files.
pub const MM_PER_M: f64 = 1e3;

/// Radians in a gon; a full turn has 400.
const RAD_PER_GON: f64 = std::f64::consts::PI / 200.0;

/// Radians in a degree of files.
pub(crate) const RAD_PER_DEG: f64 = std::f64::consts::PI / 180.0;
