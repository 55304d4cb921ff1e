//! The quantities in reasons and warnings, and the format of their numbers.

use std::fmt;

pub(super) const MM_PER_M: f64 = 1e3;
pub(super) const MS_PER_S: f64 = 1e3;

/// A group of unknowns with one unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// The time offset, s.
    TimeOffset,
    /// The hand-eye rotation, rad.
    Rotation,
    /// The hand-eye translation, m.
    Translation,
    /// A later seam point, m.
    SeamPoint,
}

impl Quantity {
    /// Its unit in sentences.
    #[must_use]
    pub fn unit(self) -> &'static str {
        match self {
            Self::TimeOffset => "ms",
            Self::Rotation => "°",
            Self::Translation | Self::SeamPoint => "mm",
        }
    }

    /// A value in that unit.
    #[must_use]
    pub fn shown(self, value_si: f64) -> f64 {
        match self {
            Self::TimeOffset => value_si * MS_PER_S,
            Self::Rotation => value_si.to_degrees(),
            Self::Translation | Self::SeamPoint => value_si * MM_PER_M,
        }
    }
}

impl fmt::Display for Quantity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::TimeOffset => "time offset",
            Self::Rotation => "rotation",
            Self::Translation => "translation",
            Self::SeamPoint => "seam point",
        })
    }
}

/// An axis of the tool.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axis {
    /// x
    X,
    /// y
    Y,
    /// z
    Z,
}

impl Axis {
    /// All, in their order.
    pub const ALL: [Self; 3] = [Self::X, Self::Y, Self::Z];

    /// Its letter.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::X => "x",
            Self::Y => "y",
            Self::Z => "z",
        }
    }
}

/// A number with three significant digits, however small.
pub(super) struct Significant(pub(super) f64);

impl fmt::Display for Significant {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let digits = (2.0 - self.0.abs().log10().floor()).clamp(0.0, 12.0) as usize;
        let text = format!("{:.digits$}", self.0);
        let short = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
        f.write_str(short)
    }
}
