//! Ctrl-C, and the signals that mean the same.

use crate::failure::Failure;
use std::sync::atomic::{AtomicU32, Ordering};

static TIMES: AtomicU32 = AtomicU32::new(0);

/// From now on Ctrl-C, SIGTERM and SIGHUP are counted and end nothing by themselves.
pub fn watch() -> Result<(), Failure> {
    ctrlc::set_handler(|| {
        TIMES.fetch_add(1, Ordering::SeqCst);
    })
    .map_err(|error| {
        Failure::new(format!("Ctrl-C cannot be watched: {error}"), "is the program started oddly?")
    })
}

/// How often it was pressed.
pub fn times() -> u32 {
    TIMES.load(Ordering::SeqCst)
}
