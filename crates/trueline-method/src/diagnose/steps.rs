//! How far a search has come, for whoever waits for it, and how long it may go on.

use std::time::{Duration, Instant};

/// When a search must end.
#[derive(Clone, Copy, Debug)]
pub(super) struct Budget {
    until: Option<Instant>,
}

impl Budget {
    /// From now on; `None` is without end.
    pub(super) fn of(longest: Option<Duration>) -> Self {
        Self { until: longest.and_then(|longest| Instant::now().checked_add(longest)) }
    }

    /// Whether nothing new is to be begun.
    pub(super) fn is_spent(&self) -> bool {
        self.until.is_some_and(|until| Instant::now() >= until)
    }
}

/// What is tried next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Step<'a> {
    /// Its name.
    pub name: &'a str,
    /// Work that is done, in quick fits …
    pub done: usize,
    /// … of all that is known to be necessary by now: more may turn out to be.
    pub of: usize,
}

/// Counts them.
pub(super) struct Steps<W> {
    watch: W,
    done: usize,
    of: usize,
}

impl<W: FnMut(Step<'_>)> Steps<W> {
    /// Of which nothing is known yet.
    pub(super) fn new(watch: W) -> Self {
        Self { watch, done: 0, of: 0 }
    }

    /// So much more work is necessary.
    pub(super) fn expect(&mut self, work: usize) {
        self.of += work;
    }

    /// Begins a step of so much work.
    pub(super) fn begin(&mut self, name: &str, work: usize) {
        (self.watch)(Step { name, done: self.done, of: self.of.max(self.done + work) });
        self.done += work;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_is_counted_before_it_begins_and_never_passes_what_is_known() {
        let mut told = Vec::new();
        let mut steps = Steps::new(|step: Step<'_>| told.push((step.name.to_owned(), step.done, step.of)));
        steps.expect(5);
        steps.begin("first", 4);
        steps.begin("second", 1);
        steps.begin("unexpected", 2);
        let expected = [("first", 0, 5), ("second", 4, 5), ("unexpected", 5, 7)];
        assert_eq!(told, expected.map(|(name, done, of)| (name.to_owned(), done, of)));
    }
}
