//! A production: the same part welded piece after piece, each lying a little differently, and one thing that changes.
//!
//! The robot follows the seams as taught, while things move: the part in its fixture, each seam on the part and, from a
//! chosen piece on, the clock, the bracket, the sensor or the fixture. The sensor's reports are cast forward as everywhere
//! in this crate, independently of the detector under test.

mod change;
mod change_text;
mod layout;
mod piece;
mod settings;

pub use change::{Change, ScheduledChange};
pub use change_text::CHANGE_WORDS;
pub use layout::Layout;
pub use piece::piece;
pub use settings::{PlacementScatter, Production, SeamPass};
