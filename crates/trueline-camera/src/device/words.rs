//! Big-endian words, and locks that outlive a panic.

use std::sync::{Mutex, MutexGuard, PoisonError};

/// The word at an offset; zero beyond the end.
pub(super) fn word(bytes: &[u8], at: usize) -> u32 {
    bytes.get(at..at + 4).map_or(0, |b| u32::from_be_bytes([b[0], b[1], b[2], b[3]]))
}

/// A lock with whole contents even after a panic: no value here is left half written.
pub(super) fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
