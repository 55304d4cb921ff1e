//! Entries on their way to the file: bounded, so that a slow disk costs entries and not memory.

use crate::read::chunk::RECORD_LIMIT;
use crate::write::entry::Entry;
use std::collections::VecDeque;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Largest number of waiting entries: four minutes of a robot at 250 Hz.
pub(crate) const MOST_ENTRIES: usize = 65_536;
/// Largest size of waiting pictures, bytes.
pub(crate) const MOST_PICTURE_BYTES: usize = 1 << 30;
/// A larger picture would make a larger record than the reader takes.
pub(crate) const LARGEST_PICTURE_BYTES: usize = RECORD_LIMIT / 2;

/// How a recording is doing.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RecorderState {
    /// Entries handed to the operating system: they survive the end of this program.
    pub written: u64,
    /// Bytes of the file.
    pub bytes: u64,
    /// Entries that are accepted and not written yet.
    pub waiting: u64,
    /// Accepted entries with data of the cell: all but clocks and notes.
    pub of_cell: u64,
    /// Entries that are not in the file and will not be, for want of room or because writing failed.
    pub refused: u64,
    /// Why nothing is written any more.
    pub failure: Option<String>,
}

#[derive(Default)]
struct State {
    entries: VecDeque<Box<Entry>>,
    picture_bytes: usize,
    /// Entries that were taken out and are not yet with the operating system.
    in_writer: u64,
    closed: bool,
    written: u64,
    of_cell: u64,
    bytes: u64,
    refused: u64,
    failure: Option<String>,
}

/// The writer's next task.
pub(super) enum Next {
    /// Write this.
    Entry(Box<Entry>),
    /// Nothing came in time.
    Idle,
    /// Nothing will come any more.
    Closed,
}

/// The queue between the sources and the writer.
pub(super) struct EntryQueue {
    state: Mutex<State>,
    arrived: Condvar,
}

impl EntryQueue {
    pub(super) fn new() -> Self {
        // Growing would copy everything while a source waits; boxed, the largest room is half a megabyte.
        let entries = VecDeque::with_capacity(MOST_ENTRIES);
        Self { state: Mutex::new(State { entries, ..State::default() }), arrived: Condvar::new() }
    }

    /// Takes an entry if there is room. Waits for nothing but the moment in which the writer takes one out.
    pub(super) fn offer(&self, entry: Entry) -> bool {
        let mut state = self.lock();
        let picture_bytes = state.picture_bytes.saturating_add(entry.picture_bytes());
        let full = state.entries.len() >= MOST_ENTRIES
            || entry.picture_bytes() > LARGEST_PICTURE_BYTES
            || (entry.picture_bytes() > 0 && picture_bytes > MOST_PICTURE_BYTES);
        if full || state.closed {
            state.refused += 1;
            return false;
        }
        state.picture_bytes = picture_bytes;
        state.of_cell += u64::from(entry.is_of_cell());
        state.entries.push_back(Box::new(entry));
        drop(state);
        self.arrived.notify_one();
        true
    }

    /// The oldest entry; waits for one at most until `deadline`.
    pub(super) fn next(&self, deadline: Instant) -> Next {
        let mut state = self.lock();
        loop {
            if let Some(entry) = state.entries.pop_front() {
                state.picture_bytes -= entry.picture_bytes();
                state.in_writer += 1;
                return Next::Entry(entry);
            }
            if state.closed {
                return Next::Closed;
            }
            let left = deadline.saturating_duration_since(Instant::now());
            if left == Duration::ZERO {
                return Next::Idle;
            }
            state = self.arrived.wait_timeout(state, left).unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    /// Everything that was taken out is with the operating system.
    pub(super) fn flushed(&self, bytes: u64) {
        let mut state = self.lock();
        state.written += std::mem::take(&mut state.in_writer);
        state.bytes = bytes;
    }

    /// Nothing is accepted any more.
    pub(super) fn close(&self) {
        self.lock().closed = true;
        self.arrived.notify_all();
    }

    /// Nothing can be written any more: the waiting entries are lost, and reported.
    pub(super) fn fail(&self, why: String) {
        let mut state = self.lock();
        state.closed = true;
        state.failure.get_or_insert(why);
        state.refused += state.entries.len() as u64 + std::mem::take(&mut state.in_writer);
        state.picture_bytes = 0;
        // Freeing the pictures takes a moment; nothing should wait for that.
        let lost = std::mem::take(&mut state.entries);
        drop(state);
        drop(lost);
    }

    pub(super) fn state(&self) -> RecorderState {
        let state = self.lock();
        RecorderState {
            written: state.written,
            of_cell: state.of_cell,
            bytes: state.bytes,
            waiting: state.entries.len() as u64 + state.in_writer,
            refused: state.refused,
            failure: state.failure.clone(),
        }
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
