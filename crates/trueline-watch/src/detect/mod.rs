//! Many welds → whether something changed, its kind, its size and its date.

pub mod blindness;
pub mod change;
pub mod history;
pub mod inside;
pub mod judgement;
pub mod links;
pub mod moved_axis;
mod over;
pub mod piece;
pub mod regime;
pub mod scatter;
pub mod seam_error;
pub mod sensor_axes;
pub mod tail;
pub mod windows;

pub use change::Change;
pub use history::History;
pub use judgement::{Alarm, Judgement, Since, judge};
pub use links::Link;
pub use piece::PieceInformation;
pub use regime::{Fault, Regime};
pub use scatter::Scatter;
pub use seam_error::{Movement, SeamError};
