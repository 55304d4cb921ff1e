//! A user's prior knowledge of his cell.

use nalgebra::Vector3;

/// An axis of the tool frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ToolAxis {
    /// +x.
    PlusX,
    /// −x.
    MinusX,
    /// +y.
    PlusY,
    /// −y.
    MinusY,
    /// +z.
    PlusZ,
    /// −z.
    MinusZ,
}

impl ToolAxis {
    /// All of them.
    pub const ALL: [Self; 6] =
        [Self::PlusX, Self::MinusX, Self::PlusY, Self::MinusY, Self::PlusZ, Self::MinusZ];

    /// The name: `+x` to `-z`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::PlusX => "+x",
            Self::MinusX => "-x",
            Self::PlusY => "+y",
            Self::MinusY => "-y",
            Self::PlusZ => "+z",
            Self::MinusZ => "-z",
        }
    }

    /// The axis in the tool frame.
    #[must_use]
    pub fn direction(self) -> Vector3<f64> {
        match self {
            Self::PlusX => Vector3::x(),
            Self::MinusX => -Vector3::x(),
            Self::PlusY => Vector3::y(),
            Self::MinusY => -Vector3::y(),
            Self::PlusZ => Vector3::z(),
            Self::MinusZ => -Vector3::z(),
        }
    }
}

/// Prior knowledge of the cell.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct KnownOfCell {
    /// The time offset is within plus and minus this, s.
    pub offset_within_s: Option<f64>,
    /// The sensor looks along this axis of the tool, to within 60°.
    pub looks: Option<ToolAxis>,
}

impl KnownOfCell {
    /// Whether anything is known.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}
