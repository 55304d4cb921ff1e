//! What systemd is told of a service (`sd_notify`): that it is ready, that it is alive, that it stops. Where systemd did not start the program, nobody
//! is told.

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// A program that runs until it is stopped.
pub(crate) struct Service {
    /// Between messages that it is alive; `None` if nobody waits for these.
    every: Option<Duration>,
    told: Instant,
}

impl Service {
    /// Tells that it is ready, and what it does.
    pub(crate) fn ready(status: &str) -> Self {
        notify::ready(status);
        // Twice in the time after which it would be taken for dead.
        Self { every: notify::watchdog().map(|limit| limit / 2), told: Instant::now() }
    }

    /// Tells that it is alive; to be called often, by what must go on.
    pub(crate) fn alive(&mut self) {
        if self.every.is_some_and(|every| self.told.elapsed() >= every) {
            self.told = Instant::now();
            notify::alive();
        }
    }
}

impl Drop for Service {
    fn drop(&mut self) {
        notify::stopping();
    }
}

/// Rounds of a thread that must go on.
#[derive(Default)]
pub(crate) struct Rounds {
    count: AtomicU64,
    seen: AtomicU64,
}

impl Rounds {
    /// One more; always true.
    pub(crate) fn one(&self) -> bool {
        self.count.fetch_add(1, Ordering::Relaxed);
        true
    }

    /// Whether there were any since this was asked before.
    pub(crate) fn have_grown(&self) -> bool {
        let count = self.count.load(Ordering::Relaxed);
        self.seen.swap(count, Ordering::Relaxed) != count
    }
}

#[cfg(target_os = "linux")]
mod notify {
    use sd_notify::NotifyState;
    use std::time::Duration;

    fn notify(states: &[NotifyState<'_>]) {
        if let Err(error) = sd_notify::notify(states) {
            tracing::warn!(%error, "systemd cannot be told");
        }
    }

    pub(super) fn ready(status: &str) {
        notify(&[NotifyState::Ready, NotifyState::Status(status)]);
    }

    pub(super) fn alive() {
        notify(&[NotifyState::Watchdog]);
    }

    pub(super) fn stopping() {
        notify(&[NotifyState::Stopping]);
    }

    pub(super) fn watchdog() -> Option<Duration> {
        sd_notify::watchdog_enabled()
    }
}

#[cfg(not(target_os = "linux"))]
mod notify {
    use std::time::Duration;

    pub(super) fn ready(_status: &str) {}

    pub(super) fn alive() {}

    pub(super) fn stopping() {}

    pub(super) fn watchdog() -> Option<Duration> {
        None
    }
}
