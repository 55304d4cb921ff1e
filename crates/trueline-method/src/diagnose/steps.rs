//! Progress of a search, and its time limit.

use std::time::{Duration, Instant};

/// Time limit of a search.
#[derive(Clone, Copy, Debug)]
pub(super) struct Budget {
    until: Option<Instant>,
}

impl Budget {
    /// From now on. `None` is no limit.
    pub(super) fn of(longest: Option<Duration>) -> Self {
        Self { until: longest.and_then(|longest| Instant::now().checked_add(longest)) }
    }

    /// Whether no further step may begin.
    pub(super) fn is_spent(&self) -> bool {
        self.until.is_some_and(|until| Instant::now() >= until)
    }
}

/// The next step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Step<'a> {
    /// Its name.
    pub name: &'a str,
    /// Completed work, in quick fits …
    pub done: usize,
    /// … of all work known so far. More may be added.
    pub of: usize,
}

/// Counts them.
pub(super) struct Steps<W> {
    watch: W,
    done: usize,
    of: usize,
}

impl<W: FnMut(Step<'_>)> Steps<W> {
    /// No work yet.
    pub(super) fn new(watch: W) -> Self {
        Self { watch, done: 0, of: 0 }
    }

    /// Adds expected work.
    pub(super) fn expect(&mut self, work: usize) {
        self.of += work;
    }

    /// Begins a step with its amount of work.
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
