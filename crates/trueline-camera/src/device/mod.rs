//! A GigE Vision camera that is not there: its registers, its clock, its exposures and its packets.
//!
//! An exposure starts every period. A thread of its own draws the picture after the end of the exposure. The picture
//! leaves after readout and latency. A picture that is late is dropped, and so is one that the network is too slow
//! for. Every exposure takes a number, so a dropped one is a gap.

mod control;
mod device_clock;
mod facts;
mod handle;
mod pacing;
mod packets;
mod pictures;
mod privilege;
mod registers;
mod sender;
mod sensor;
mod sequence;
mod settings;
mod shared;
mod words;

pub use device_clock::{ClockStep, DeviceClock};
pub use facts::{DeviceCounts, SentFrame};
pub use handle::{Device, DeviceHandle};
pub use pictures::{Edge, Pictures};
pub use settings::{Chunks, DeviceSettings, OutputMode, RangeFeatures, TriggerOf};
