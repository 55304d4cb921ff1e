//! The pictures of a stream, read on a thread of its own.

use super::bounded::Arrivals;
use crate::error::CameraError;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TrySendError, sync_channel};
use std::thread::{self, JoinHandle};
use std::time::Duration;
use viva_u3v::{RawFrame, U3vError, U3vStream};

/// How often the thread looks whether it is to end.
const LOOK: Duration = Duration::from_millis(50);

/// A picture, good or bad, and when it came.
pub(super) struct Picture {
    /// The frame.
    pub frame: RawFrame,
    /// Steady time of its leader, ns; `None` for one that was not seen coming.
    pub first_ns: Option<i64>,
    /// Steady time of its trailer, ns; without one, when it was given up.
    pub complete_ns: i64,
}

/// The pictures of a stream.
pub(super) struct Pictures {
    waiting: Option<Receiver<Result<Picture, U3vError>>>,
    not_taken: Arc<AtomicU64>,
    ends: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Pictures {
    /// Reads a stream until `ends`; a limited number of pictures may wait.
    ///
    /// # Errors
    /// An operating system that gives no thread.
    pub(super) fn of(
        stream: U3vStream,
        arrivals: Arrivals,
        ends: Arc<AtomicBool>,
        most_waiting: usize,
    ) -> Result<Self, CameraError> {
        let (sender, receiver) = sync_channel(most_waiting);
        let not_taken = Arc::<AtomicU64>::default();
        let reader = Reader { stream, arrivals, ends: Arc::clone(&ends), not_taken: Arc::clone(&not_taken) };
        let thread =
            thread::Builder::new().name("usb pictures".to_owned()).spawn(move || reader.read(&sender))?;
        Ok(Self { waiting: Some(receiver), not_taken, ends, thread: Some(thread) })
    }

    /// The next one; `None` if none comes in time.
    ///
    /// # Errors
    /// Error that ended the stream; after it, the report that it has ended.
    pub(super) fn next(&self, timeout: Duration) -> Result<Option<Picture>, U3vError> {
        let Some(waiting) = &self.waiting else { return Err(U3vError::Disconnected) };
        match waiting.recv_timeout(timeout) {
            Ok(picture) => picture.map(Some),
            Err(RecvTimeoutError::Timeout) => Ok(None),
            Err(RecvTimeoutError::Disconnected) => Err(U3vError::Disconnected),
        }
    }

    /// Pictures dropped because those before them were not taken in time.
    pub(super) fn not_taken(&self) -> u64 {
        self.not_taken.load(Ordering::Relaxed)
    }

    /// Ends the stream.
    pub(super) fn stop(&mut self) {
        self.ends.store(true, Ordering::Relaxed);
        // A thread that waits for room to report its error continues.
        drop(self.waiting.take());
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

impl Drop for Pictures {
    fn drop(&mut self) {
        self.stop();
    }
}

struct Reader {
    stream: U3vStream,
    arrivals: Arrivals,
    ends: Arc<AtomicBool>,
    not_taken: Arc<AtomicU64>,
}

impl Reader {
    fn read(mut self, sender: &SyncSender<Result<Picture, U3vError>>) {
        while !self.ends.load(Ordering::Relaxed) {
            let frame = match self.stream.next_frame_within(LOOK) {
                Ok(Some(frame)) => frame,
                Ok(None) => continue,
                Err(error) => {
                    let _ = sender.send(Err(error));
                    return;
                }
            };
            let arrival = self.arrivals.take(frame.leader.block_id);
            let first_ns = arrival.map(|arrival| arrival.first_ns);
            let complete_ns =
                arrival.and_then(|arrival| arrival.last_ns).unwrap_or_else(|| self.arrivals.now_ns());
            match sender.try_send(Ok(Picture { frame, first_ns, complete_ns })) {
                Ok(()) => {}
                Err(TrySendError::Full(_)) => {
                    self.not_taken.fetch_add(1, Ordering::Relaxed);
                }
                Err(TrySendError::Disconnected(_)) => return,
            }
        }
    }
}
