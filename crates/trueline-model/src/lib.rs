//! The view of a laser vision sensor on a robot: four independent stages, each with value and Jacobian.
//!
//! ```text
//! pixel ──camera──▶ ray ──laser_plane──▶ point_in_camera ──placement──▶ point_in_base ──residual──▶ r
//! ```
//!
//! | symbol | code | meaning |
//! |---|---|---|
//! | t_d | `time_offset` | camera lag, s: the image stamped t was exposed at t − t_d |
//! | R_BE, p_BE | `base_from_tool` | robot pose at the exposure |
//! | R_EC, p_EC | `tool_from_camera` | hand-eye transform |
//! | n·p = d | `laser_plane_in_camera` | laser sheet |
//! | L | `line_in_base` | the straight line |
//! | n·p = d | `plate` | a plate of the joint, nearly flat |
//!
//! A residual with its Jacobian follows by the chain rule over the required stages. Pure functions without data or solver. Units are metre, radian,
//! second and pixel. Pixel (0, 0) is the centre of the top-left pixel.
//!
//! ```
//! use nalgebra::{Vector2, Vector3};
//! use trueline_geometry::Plane;
//! use trueline_model::{BrownConrady, Camera, LaserSheet};
//!
//! let camera = Camera {
//!     size: [1280, 1024],
//!     focal: Vector2::new(2400.0, 2400.0),
//!     centre: Vector2::new(640.0, 512.0),
//!     distortion: BrownConrady::from_opencv([-0.1, 0.02, 0.0, 0.0, 0.0]),
//! };
//! let plane = Plane::new(Vector3::new(0.0, -1.0, 1.0), 0.2).ok_or("no plane")?;
//! let pixel = Vector2::new(800.0, 300.0);
//! let (ray, _d_ray_d_pixel) = camera.ray(&pixel)?;
//! let (point_in_camera, _d_point_d_ray) =
//!     LaserSheet::from_plane(plane).intersect(&ray).ok_or("the ray runs along the laser plane")?;
//! let seen = camera.project(&point_in_camera).ok_or("behind the camera")?;
//! assert!((seen - pixel).norm() < 1e-6);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod camera;
pub mod curvature;
pub mod distortion;
pub mod placement;
pub mod plate;
pub mod point_to_line;
pub mod sheet;
pub mod sheet_field;
pub mod sheet_residual;
pub mod sheet_shape;
pub mod stripe_residual;
pub mod support_residual;

pub use camera::{Camera, PixelError};
pub use curvature::Curvature;
pub use distortion::BrownConrady;
pub use placement::{ByLinks, Placement, PlacementJacobian, PoseGradient};
pub use plate::{Plate, PlateChart};
pub use point_to_line::ResidualJacobian;
pub use sheet::LaserSheet;
pub use sheet_field::{RigidPart, RigidPartOfShape, SheetField};
pub use sheet_residual::SeamInSheet;
pub use sheet_shape::SheetShape;
pub use stripe_residual::{StripeJacobian, StripeOnPlate};
pub use support_residual::SupportPair;
