//! A production: the same part welded piece after piece, each lying a little differently, and one thing that changes.
//!
//! The robot follows the seams as they were taught, whatever moves: the part in its fixture, each seam on the part, and, from
//! a piece of choice on, the clock, the bracket, the sensor or the fixture. What the sensor reports is cast forward as
//! everywhere in this crate; nothing here knows of the detector that is to find it.

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
