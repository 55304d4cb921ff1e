//! Calls other people's decoders, which may panic on damaged bytes: a panic is an answer then, and no crash.

use std::cell::Cell;
use std::panic::{self, AssertUnwindSafe};

thread_local! {
    static GUARDED: Cell<bool> = const { Cell::new(false) };
}

/// Runs a decoder; `None` if it panicked. The unfinished value is dropped, so no partial data are visible.
pub(crate) fn run<T>(decode: impl FnOnce() -> T) -> Option<T> {
    let outer = GUARDED.replace(true);
    let decoded = panic::catch_unwind(AssertUnwindSafe(decode));
    GUARDED.set(outer);
    decoded.ok()
}

/// Whether this thread is in a decoder that reports its panics as errors: a program's panic hook need not report them as
/// well.
#[must_use]
pub fn is_guarded() -> bool {
    GUARDED.get()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_is_no_crash() {
        assert_eq!(
            run(|| if is_guarded() {
                panic!("a bad code")
            }),
            None
        );
        assert!(run(|| 1) == Some(1) && !is_guarded());
    }
}
