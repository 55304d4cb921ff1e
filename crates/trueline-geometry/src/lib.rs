//! Space and time for calibration: rotations, poses, lines, planes and sampled trajectories.
//!
//! Everything is in SI units (metre, radian, second) and double precision. Transforms are named
//! `a_from_b`: they map coordinates in `b` to coordinates in `a`, so neighbours cancel in
//! `base_from_tool * tool_from_camera`. Rotations are perturbed on the left, `R ← Exp(δ) R`, as in
//! Eq. (18) of the paper (`docs/references.md`, \[Yang2025\]).
//!
//! No input or output, no serialisation, no other units: those live at the edges.

pub mod circle;
pub mod curve;
pub mod euler;
pub mod fit;
pub mod line;
pub mod plane;
pub mod polyline;
pub mod se3;
pub mod smooth;
pub mod so3;
pub mod trajectory;

pub use circle::Circle;
pub use euler::EulerSequence;
pub use line::{Line, OrthonormalLine, PlueckerLine};
pub use plane::Plane;
pub use polyline::Polyline;
pub use trajectory::{Segment, Trajectory};

/// A rigid transform; a value is called `a_from_b` after the frames it joins.
pub type Pose = nalgebra::Isometry3<f64>;
