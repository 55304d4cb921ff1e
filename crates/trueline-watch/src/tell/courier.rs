//! Carries messages to a receiver in a thread of its own, with its own connection to the state. A receiver
//! that is slow, dead or hostile delays nothing else.

use super::pace::Pace;
use super::receiver::Receiver;
use crate::store::{Message, Store, StoreError};
use std::path::Path;
use std::sync::mpsc::{Receiver as Ear, RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::{Instant, SystemTime, UNIX_EPOCH};

/// Reason why messages cannot be sent.
#[derive(Debug, thiserror::Error)]
pub enum CourierError {
    /// The state cannot be used.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// No thread.
    #[error("no thread can be started: {0}")]
    Thread(std::io::Error),
}

/// A thread that sends messages to one receiver.
#[derive(Debug)]
pub struct Courier {
    /// Dropped to end the thread.
    end: Option<Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Courier {
    /// Sends present and future messages of a state to a receiver.
    ///
    /// # Errors
    /// A state that cannot be opened, or a system that has no thread left.
    pub fn start(state: &Path, receiver: Box<dyn Receiver>, pace: Pace) -> Result<Self, CourierError> {
        let store = Store::open(state)?;
        let id = store.receiver(receiver.address(), &receiver.name())?;
        let (end, ear) = channel();
        let work = move || carry(&store, id, receiver.as_ref(), &ear, pace);
        let thread =
            std::thread::Builder::new().name("tell".to_owned()).spawn(work).map_err(CourierError::Thread)?;
        Ok(Self { end: Some(end), thread: Some(thread) })
    }
}

impl Drop for Courier {
    /// Sends due messages once each, and ends: a dead receiver costs one try.
    fn drop(&mut self) {
        drop(self.end.take());
        if let Some(thread) = self.thread.take() {
            let _panicked = thread.join();
        }
    }
}

fn carry(store: &Store, id: i64, receiver: &dyn Receiver, ear: &Ear<()>, pace: Pace) {
    loop {
        let is_over = ear.recv_timeout(pace.look_every) == Err(RecvTimeoutError::Disconnected);
        let until = Instant::now() + pace.patience;
        // A state that cannot be read now may be readable later; the watcher meets the same error and reports it.
        while let Ok(Some(message)) = store.take_message(id, now_s(), now_s() + pace.taken_for_s()) {
            let settled = match receiver.tell(&with_id(&message)) {
                Ok(()) => {
                    tracing::debug!(receiver = receiver.name(), id = message.id, "told");
                    store.told(id, message.id)
                }
                Err(why) => {
                    let wait_s = pace.wait_s(message.tries);
                    tracing::warn!(receiver = receiver.name(), id = message.id, why, wait_s, "not delivered");
                    store.not_told(id, now_s() + wait_s, &why)
                }
            };
            if settled.is_err() || Instant::now() > until {
                break;
            }
        }
        if is_over {
            return;
        }
    }
}

/// The message with its number, which identifies repeated messages.
fn with_id(message: &Message) -> String {
    match message.body.strip_prefix('{') {
        Some(rest) => format!("{{\"id\":{},{rest}", message.id),
        None => message.body.clone(),
    }
}

fn now_s() -> i64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |d| d.as_secs().cast_signed())
}
