//! Profiles one after the other, as their file is read: in memory is the one that is read.

use crate::profile::Profile;
use std::ops::ControlFlow;

/// Takes the profiles of a file in the file's order; [`ControlFlow::Break`] ends the reading.
pub type EachProfile<'a> = dyn FnMut(Profile) -> ControlFlow<()> + 'a;

/// Joins rows of the same stamp and frame to profiles, and hands these over.
pub(crate) struct Assembly<'a, 'b> {
    current: Option<Profile>,
    each: &'a mut EachProfile<'b>,
    /// Profiles so far.
    pub profiles: usize,
    /// Whether one of those handed over has a point.
    has_points: bool,
}

impl<'a, 'b> Assembly<'a, 'b> {
    pub(crate) fn new(each: &'a mut EachProfile<'b>) -> Self {
        Self { current: None, each, profiles: 0, has_points: false }
    }

    /// The profile that is read.
    pub(crate) fn last(&self) -> Option<&Profile> {
        self.current.as_ref()
    }

    /// The profile of rows with this stamp and frame: that which is read, or a new one.
    pub(crate) fn of_row(&mut self, stamp_ns: i64, frame: Option<u64>) -> ControlFlow<(), &mut Profile> {
        let is_it = |last: &Profile| (last.stamp_ns, last.frame) == (stamp_ns, frame);
        if !self.current.as_ref().is_some_and(is_it) {
            // Profiles of a sensor have about as many points.
            let points = Vec::with_capacity(self.current.as_ref().map_or(0, |last| last.points.len()));
            self.add(Profile { stamp_ns, frame, points })?;
        }
        self.current.as_mut().map_or(ControlFlow::Break(()), ControlFlow::Continue)
    }

    /// Begins a profile, and hands the one before over.
    pub(crate) fn add(&mut self, profile: Profile) -> ControlFlow<()> {
        self.profiles += 1;
        match self.current.replace(profile) {
            Some(done) => self.hand_over(done),
            None => ControlFlow::Continue(()),
        }
    }

    /// Hands the last one over; returns whether any profile has a point.
    pub(crate) fn end(mut self) -> bool {
        if let Some(done) = self.current.take() {
            // Nothing is read after it.
            let _ended = self.hand_over(done);
        }
        self.has_points
    }

    fn hand_over(&mut self, done: Profile) -> ControlFlow<()> {
        self.has_points |= !done.points.is_empty();
        (self.each)(done)
    }
}
