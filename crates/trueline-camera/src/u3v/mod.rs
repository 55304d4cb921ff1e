//! A USB3 Vision camera: any maker's that follows the standard.
//!
//! Registers, commands and the stream are what viva-u3v makes of them, features what telegenic makes of the camera's description; this
//! module keeps what a device says of itself within bounds, stamps what arrives, and makes pictures of it.

mod bounded;
mod camera;
mod description;
mod errors;
mod features;
mod found;
mod link;
mod picture;
mod settings;
mod stream;

pub use camera::{U3vCamera, U3vCounts};
pub use link::UsbEndpoints;
pub use settings::U3vSettings;
pub use viva_u3v::{U3vError, UsbTransfer};
