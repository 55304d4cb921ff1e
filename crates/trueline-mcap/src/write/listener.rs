//! Whoever wants to hear what is recorded, while it is recorded.

use crate::write::entry::Entry;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

/// Hears of every entry in the thread that writes it; whoever records does not wait for it.
pub trait Listener: Send + Sync {
    /// An entry, before it is written.
    fn entry(&self, entry: &Entry);

    /// A message of that entry: its topic, its log time (ns since 1970) and its bytes as in the file.
    fn message(&self, topic: &str, log_ns: i64, bytes: &[u8]);
}

/// A listener that cannot end the recording: one that panics is not called again.
#[derive(Default)]
pub(crate) struct Heard {
    listener: Option<Arc<dyn Listener>>,
}

impl Heard {
    pub(crate) fn by(listener: Option<Arc<dyn Listener>>) -> Self {
        Self { listener }
    }

    pub(crate) fn entry(&mut self, entry: &Entry) {
        self.tell(|listener| listener.entry(entry));
    }

    pub(crate) fn message(&mut self, topic: &str, log_ns: i64, bytes: &[u8]) {
        self.tell(|listener| listener.message(topic, log_ns, bytes));
    }

    fn tell(&mut self, tell: impl FnOnce(&dyn Listener)) {
        let Some(listener) = &self.listener else { return };
        if catch_unwind(AssertUnwindSafe(|| tell(listener.as_ref()))).is_err() {
            self.listener = None;
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use crate::write::entry::ClockEntry;
    use std::sync::atomic::{AtomicU32, Ordering};

    struct Fails(AtomicU32);

    impl Listener for Fails {
        fn entry(&self, _: &Entry) {
            self.0.fetch_add(1, Ordering::SeqCst);
            panic!("as asked");
        }

        fn message(&self, _: &str, _: i64, _: &[u8]) {
            self.0.fetch_add(1, Ordering::SeqCst);
        }
    }

    #[test]
    fn a_listener_that_panics_is_not_called_again() {
        let fails = Arc::new(Fails(AtomicU32::new(0)));
        let mut heard = Heard::by(Some(Arc::<Fails>::clone(&fails)));
        heard.message("/tf", 1, &[]);
        heard.entry(&Entry::Clock(ClockEntry { steady_ns: 1, wall_ns: 1 }));
        heard.message("/tf", 2, &[]);
        assert_eq!(fails.0.load(Ordering::SeqCst), 2);
    }
}
