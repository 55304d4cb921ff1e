//! Many welds → whether something changed, what, by how much and since when.

pub mod blindness;
pub mod change;
pub mod inside;
pub mod judgement;
pub mod piece;
pub mod scatter;
pub mod sensor_axes;
pub mod tail;
pub mod windows;

pub use change::Change;
pub use judgement::{Alarm, History, Judgement, Since, judge};
pub use piece::PieceInformation;
pub use scatter::Scatter;
