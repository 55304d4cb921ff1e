//! Why stripes say nothing of plates.

/// Why the stripes are not used though there are some.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoPlates {
    /// A joint has no stripes on one of its plates, or none at all.
    Missing,
    /// Points of a plate that do not span a plane.
    NoPlane,
    /// Two plates that do not meet in a line.
    Parallel,
}
