//! A camera's intrinsics from pictures of a board.

pub mod cross_validation;
pub mod distortion_model;
pub mod field;
pub mod fit;
pub mod next_picture;
mod start;

pub use cross_validation::CrossValidation;
pub use distortion_model::{DistortionModel, Evidence};
pub use field::{Field, Sensitivity};
pub use fit::{CameraFit, FEWEST_PICTURES, fit};
pub use next_picture::NextPicture;
