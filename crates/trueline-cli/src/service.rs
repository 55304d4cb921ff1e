//! Messages to systemd about a service (`sd_notify`): ready, alive, stopping. If systemd did not start the program, no
//! message is sent.

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// A program that runs until it is stopped.
pub(crate) struct Service {
    /// Time between messages that it is alive; `None` if these are not expected.
    every: Option<Duration>,
    told: Instant,
}

impl Service {
    /// Reports that it is ready, and its status.
    pub(crate) fn ready(status: &str) -> Self {
        notify::ready(status);
        // Twice within systemd's limit.
        Self { every: notify::watchdog().map(|limit| limit / 2), told: Instant::now() }
    }

    /// Reports that it is alive; call it often, from the part that must keep running.
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
            tracing::warn!(%error, "systemd cannot be notified");
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
