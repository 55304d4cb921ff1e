//! A USB3 Vision camera: any maker's that follows the standard.
//!
//! viva-u3v gives registers, commands and the stream; telegenic gives features from the camera's description. This module
//! bounds the device's statements, stamps its pictures and decodes them.

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
