//! What a laser vision sensor on a robot sees: four independent stages, each with value and Jacobian.
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
//! A residual with its Jacobian is the chain rule over the stages it needs. Pure functions: no data, no
//! solver. Metre, radian, second and pixel; pixel (0, 0) is the centre of the top-left pixel.

pub mod camera;
pub mod curvature;
pub mod distortion;
pub mod placement;
pub mod plate;
pub mod point_to_line;
pub mod sheet;
pub mod sheet_residual;
pub mod sheet_shape;
pub mod stripe_residual;

pub use camera::{Camera, PixelError};
pub use curvature::Curvature;
pub use distortion::BrownConrady;
pub use placement::{Placement, PlacementJacobian};
pub use plate::{Plate, PlateChart};
pub use point_to_line::ResidualJacobian;
pub use sheet::LaserSheet;
pub use sheet_residual::SeamInSheet;
pub use sheet_shape::SheetShape;
pub use stripe_residual::{StripeJacobian, StripeOnPlate};
