//! How the sensor moves over the seam: one motion a file.

mod c_path;
mod drawn_course;
mod hand_guided;
mod planned;
mod s_path;
mod swing;
mod taught;
mod weave;

pub use drawn_course::Motion;

pub(crate) use drawn_course::Course;
pub(crate) use swing::Swing;
