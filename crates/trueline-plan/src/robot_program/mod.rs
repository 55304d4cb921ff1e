//! A path as the program of a robot: RAPID, KRL, URScript, FANUC's LS, or a table.
//!
//! The robot moves by its own program, and the PC only listens. Every program approaches the first pose by a joint move and
//! keeps the path's own times. Its head states that nobody has run it on a controller, and that reach and collisions are not
//! checked.

pub mod krl;
pub mod krl_rsi;
pub mod language;
pub mod ls;
pub mod program_file;
pub mod rapid_egm;
pub(crate) mod rapid_path;
pub mod table;
pub mod urscript;
mod warning;
pub mod waypoints;

pub use language::Language;
pub use program_file::ProgramFile;
pub use waypoints::{PathAxis, Waypoint, Waypoints};
