//! Space and time for calibration: rotations, poses, lines, planes and sampled trajectories.
//!
//! Everything is in SI units (metre, radian, second) and double precision. Transforms are named
//! `a_from_b`: they map coordinates in `b` to coordinates in `a`, so neighbours cancel in
//! `base_from_tool * tool_from_camera`. Rotations are perturbed on the left, `R ← Exp(δ) R`, as in
//! Eq. (18) of the paper (`docs/references.md`, \[Yang2025\]).
//!
//! There is no input or output, no serialisation and no other unit. Those are in other crates.
//!
//! ```
//! use nalgebra::Vector3;
//! use trueline_geometry::{Line, Pose, so3};
//!
//! // The camera stands 100 mm in front of the tool, turned by 90° about its own axis.
//! let quarter_turn = so3::exp(&Vector3::new(0.0, 0.0, std::f64::consts::FRAC_PI_2));
//! let tool_from_camera = Pose::from_parts(Vector3::new(0.0, 0.0, 0.1).into(), quarter_turn);
//! let base_from_tool = Pose::translation(1.0, 0.0, 0.5);
//! let base_from_camera = base_from_tool * tool_from_camera;
//! let point_in_base = base_from_camera * nalgebra::Point3::new(0.2, 0.0, 0.3);
//! let seam = Line::new(Vector3::new(1.0, 0.0, 0.9), &Vector3::y_axis());
//! assert!(seam.distance(&point_in_base.coords) < 1e-12);
//! ```

#[cfg(feature = "arm")]
pub mod arm;
pub mod axis;
pub mod circle;
pub mod curve;
pub mod euler;
pub mod fit;
pub mod lag;
pub mod line;
pub mod local_polynomial;
pub mod plane;
pub mod polyline;
pub mod se3;
pub mod smooth;
pub mod smoothed_velocity;
pub mod so3;
pub mod statistics;
pub mod trajectory;

pub use axis::{Axis, AxisKind};
pub use circle::Circle;
pub use euler::EulerSequence;
pub use line::{Line, OrthonormalLine, PlueckerLine};
pub use plane::Plane;
pub use polyline::Polyline;
pub use trajectory::{Segment, Trajectory};

/// A rigid transform. A value is named `a_from_b` after its frames.
pub type Pose = nalgebra::Isometry3<f64>;
