//! Carries messages to a receiver in a thread of its own, with its own connection to the state: a receiver that is slow, dead or
//! hostile delays nobody but itself.

use super::receiver::{PATIENCE, Receiver};
use crate::store::{Message, Store, StoreError};
use std::path::Path;
use std::sync::mpsc::{Receiver as Ear, RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// Between looks for new messages.
const LOOK_EVERY: Duration = Duration::from_secs(1);
/// A message that was taken is due again after this: longer than a try can take.
const TAKEN_FOR_S: i64 = 3 * PATIENCE.as_secs() as i64;
/// Between tries at first; twice as long each time.
const FIRST_WAIT_S: i64 = 2;
/// Between tries at most.
const LONGEST_WAIT_S: i64 = 600;

/// Why a receiver cannot be told.
#[derive(Debug, thiserror::Error)]
pub enum CourierError {
    /// The state cannot be used.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// No thread.
    #[error("no thread can be started: {0}")]
    Thread(std::io::Error),
}

/// A thread that tells one receiver.
#[derive(Debug)]
pub struct Courier {
    /// Dropped to say that this is the end.
    end: Option<Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Courier {
    /// Tells a receiver, from now on, what is and will be in a state.
    ///
    /// # Errors
    /// A state that cannot be opened, or a system that has no thread left.
    pub fn start(state: &Path, receiver: Box<dyn Receiver>) -> Result<Self, CourierError> {
        let store = Store::open(state)?;
        let id = store.receiver(receiver.address(), &receiver.name())?;
        let (end, ear) = channel();
        let work = move || carry(&store, id, receiver.as_ref(), &ear);
        let thread =
            std::thread::Builder::new().name("tell".to_owned()).spawn(work).map_err(CourierError::Thread)?;
        Ok(Self { end: Some(end), thread: Some(thread) })
    }
}

impl Drop for Courier {
    /// Tells what is due, once each, and ends: a receiver that is dead costs one try.
    fn drop(&mut self) {
        drop(self.end.take());
        if let Some(thread) = self.thread.take() {
            let _panicked = thread.join();
        }
    }
}

fn carry(store: &Store, id: i64, receiver: &dyn Receiver, ear: &Ear<()>) {
    loop {
        let is_over = ear.recv_timeout(LOOK_EVERY) == Err(RecvTimeoutError::Disconnected);
        let until = Instant::now() + PATIENCE;
        // A state that cannot be read now may be later; whoever watches meets the same error and says so.
        while let Ok(Some(message)) = store.take_message(id, now_s(), now_s() + TAKEN_FOR_S) {
            let settled = match receiver.tell(&with_id(&message)) {
                Ok(()) => store.told(id, message.id),
                Err(why) => store.not_told(id, now_s() + wait_s(message.tries), &why),
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

/// The message with its number, by which a receiver knows what it was told before.
fn with_id(message: &Message) -> String {
    match message.body.strip_prefix('{') {
        Some(rest) => format!("{{\"id\":{},{rest}", message.id),
        None => message.body.clone(),
    }
}

fn wait_s(tries: u32) -> i64 {
    (FIRST_WAIT_S << tries.min(10)).min(LONGEST_WAIT_S)
}

fn now_s() -> i64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |d| d.as_secs().cast_signed())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waits_double_up_to_ten_minutes() {
        let waits: Vec<i64> = [0, 1, 2, 8, 9, 40, u32::MAX].map(wait_s).to_vec();
        assert_eq!(waits, [2, 4, 8, 512, 600, 600, 600]);
    }
}
