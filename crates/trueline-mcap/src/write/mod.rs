//! Writes events to a file while they happen.

pub(crate) mod cloud;
pub(crate) mod entry;
mod entry_queue;
pub(crate) mod listener;
pub mod log_writer;
pub(crate) mod record_error;
pub(crate) mod recorder;
pub(crate) mod seam_points;
pub(crate) mod sink;
