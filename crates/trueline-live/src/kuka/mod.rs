//! KUKA's Robot Sensor Interface (RSI): the controller sends an XML text each cycle.
//!
//! With `ONLYSEND` it wants no answer, and nothing is ever sent. This is the normal way unless an [`Answer`](zero_answer)
//! was requested. [`rsi`] is the stream, [`ethernet_config`] its configuration on the controller, [`rsi_sim`] the
//! controller's side, simulated.

pub mod ethernet_config;
pub mod input_element;
pub mod ipoc;
pub mod rob_message;
pub mod rsi;
pub mod rsi_sim;
pub mod zero_answer;

pub use ethernet_config::EthernetConfig;
pub use input_element::InputElement;
pub use rsi::Rsi;
pub use zero_answer::ZeroAnswer;
