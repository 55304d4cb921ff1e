//! Cameras: pictures with the stamps of every clock that saw them.
//!
//! A [`FrameSource`] gives pictures: a recording ([`Replay`]), a simulation in this program ([`InProcess`]) or, with the feature
//! `gige`, a GigE Vision camera ([`gige::GigeCamera`]). [`LatchMap`] maps the camera's clock to that of the PC. [`device`] is the other side: a
//! camera that is simulated down to its packets, for tests and for programs that nobody here wrote.

#[cfg(feature = "gige")]
pub mod device;
pub mod error;
pub mod frame_source;
#[cfg(feature = "gige")]
pub mod gige;
pub mod in_process;
pub mod latch_clock;
pub mod replay;

pub use error::CameraError;
pub use frame_source::{CameraFrame, FrameSource, FrameStatus, SourceAbout};
#[cfg(feature = "gige")]
pub use gige::{GigeCamera, GigeSettings};
pub use in_process::{InProcess, InProcessSettings};
pub use latch_clock::{LatchMap, LatchSample};
pub use replay::{Pace, Replay};
