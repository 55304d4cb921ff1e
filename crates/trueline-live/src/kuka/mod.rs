//! KUKA's Robot Sensor Interface (RSI): the controller sends an XML text each cycle. With `ONLYSEND` it wants no answer, and
//! that is the one way it is listened to here: nothing is ever sent.

pub mod rob_message;
pub mod rsi;
pub mod rsi_sim;

pub use rsi::Rsi;
