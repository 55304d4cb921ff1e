//! Cameras: pictures with the stamps of every clock that saw them.
//!
//! A [`FrameSource`] gives pictures. It is a recording ([`Replay`]), a simulation in this program ([`InProcess`]) or a
//! camera: GigE Vision ([`gige::GigeCamera`], feature `gige`), USB3 Vision (feature `u3v`), or one of the Linux kernel
//! (feature `v4l2`). The common part of GenICam for the first two is in [`genicam`]. [`LatchMap`] maps the camera's clock
//! to that of the PC. [`device`] is the other side: a camera that is simulated down to its packets, for tests and for
//! foreign programs.
//!
//! ```
//! use trueline_camera::{LatchMap, LatchSample};
//!
//! // A camera reports its time every second; its clock began at 5 s and runs 100 ppm fast.
//! let samples: Vec<LatchSample> = (0..20_i64)
//!     .map(|k| {
//!         let middle_ns = 1_000_000_000 * (k + 1);
//!         let device_ns = 5_000_000_000 + 1_000_100_000 * k;
//!         LatchSample { before_ns: middle_ns - 100_000, device_ns, after_ns: middle_ns + 100_000 }
//!     })
//!     .collect();
//! let map = LatchMap::of(&samples).ok_or("too few exchanges")?;
//! assert!((map.drift_ppm - 100.0).abs() < 0.1);
//! assert!((map.host_ns(5_000_000_000) - 1_000_000_000).abs() < 1000);
//! # Ok::<(), &str>(())
//! ```

#[cfg(feature = "gige")]
pub mod device;
pub mod error;
mod frame_source;
#[cfg(feature = "gige")]
pub mod genicam;
#[cfg(feature = "gige")]
pub mod gige;
mod gray_image;
mod in_process;
mod latch_clock;
mod mosaic;
mod packed;
mod pixel_format;
mod range;
mod reconnecting;
pub mod replay;
mod setup;
mod trigger;
#[cfg(feature = "u3v")]
pub mod u3v;
#[cfg(all(feature = "v4l2", target_os = "linux"))]
pub mod v4l2;

pub use error::CameraError;
pub use frame_source::{CameraFrame, FrameSource, FrameStatus, SourceAbout};
#[cfg(feature = "gige")]
pub use gige::{GigeCamera, GigeSettings};
pub use gray_image::gray_image;
pub use in_process::{InProcess, InProcessSettings};
pub use latch_clock::{LatchMap, LatchSample};
pub use pixel_format::{Mosaic, PixelFormat, Samples};
pub use range::{RangeAxis, RangeProfile, RangeScale};
pub use reconnecting::Reconnecting;
pub use replay::{Pace, Replay};
pub use setup::CameraSetup;
pub use trigger::{NotATrigger, Trigger, TriggerEdge};
