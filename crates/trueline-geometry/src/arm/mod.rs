//! Robot arms: from joint angles to the pose of the flange and back.
//!
//! ```
//! use trueline_geometry::arm::{named, inverse};
//!
//! let arm = named::find("ur10e").unwrap().arm();
//! let angles = [0.3, -1.2, 1.5, -1.8, -1.4, 0.2];
//! let base_from_flange = arm.base_from_flange(&angles);
//! let near = angles.map(|angle| angle + 0.1);
//! let found = inverse::angles_for(&arm, &base_from_flange, &near).unwrap();
//! assert!((0..6).all(|k| (found[k] - angles[k]).abs() < 1e-8));
//! ```

pub mod dh;
pub mod inverse;
pub mod named;
pub mod six_axes;
pub mod urdf;

pub use named::NamedArm;
pub use six_axes::{AXES, Angles, Arm, Joint};
