//! A camera of the kernel's Video4Linux: UVC cameras at USB, and any other with a driver.

mod camera;
mod layout;
mod stamps;

pub use camera::{V4l2Camera, V4l2Settings};
