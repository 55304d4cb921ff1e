//! A robot controller that is not there: EGM's protocol, states and queue, a control loop that follows references as
//! late as a real one, clocks and networks with their faults. It shares only the codec with the PC's side.

pub mod arm;
#[expect(clippy::module_inception, reason = "the controller is what the folder is about")]
pub mod controller;
pub mod joints;
pub mod network;
pub mod real_time;
mod robot_output;
pub mod settings;
pub(crate) mod trigger_feed;
mod truth_feed;
pub(crate) mod virtual_time;
mod wiring;

pub use controller::{Controller, GuidanceEnd};
pub use network::{Network, NetworkSettings};
pub use real_time::RealTime;
pub use robot_output::OutputEvery;
pub use settings::{ControllerSettings, Event, StopMode, Task};
pub use trigger_feed::{TriggerReceiver, TriggerSender};
pub use truth_feed::{TruthReceiver, TruthSender};
pub use virtual_time::VirtualTime;
pub use wiring::{Wiring, WiringSettings};
