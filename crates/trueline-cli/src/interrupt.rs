//! Ctrl-C, and the signals that mean the same.

use crate::failure::Failure;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::Duration;

static TIMES: AtomicU32 = AtomicU32::new(0);

/// From now on Ctrl-C, SIGTERM and SIGHUP are counted and end nothing by themselves.
pub(crate) fn watch() -> Result<(), Failure> {
    ctrlc::set_handler(|| {
        TIMES.fetch_add(1, Ordering::SeqCst);
    })
    .map_err(|error| {
        Failure::new(format!("Ctrl-C cannot be watched: {error}"), "check how the program is started")
    })
}

/// How often it was pressed.
pub(crate) fn times() -> u32 {
    TIMES.load(Ordering::SeqCst)
}

/// Continues until a duration has passed, or it was pressed.
pub(crate) fn until(passed: Duration, duration: Duration) -> ControlFlow<()> {
    if passed >= duration || times() > 0 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
}
