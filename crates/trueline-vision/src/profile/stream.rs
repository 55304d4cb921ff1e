//! Seams of profiles that come one after the other, as they come.
//!
//! The end of a face that is its plate's, the losses there and the scatter need several profiles, and so does the joint. So
//! they are processed by the second, like the profiles of a short scan. The joint is the one found in most of the seconds so
//! far.

use super::joint::ProfileJoint;
use super::joint_choice;
use super::scan::seams;
use std::collections::BTreeMap;
use trueline_dataset::{Feature, Profile};

/// Minimum number of profiles in a block, and its minimum duration, ns.
const FEWEST: usize = 24;
const LEAST_NS: i64 = 1_000_000_000;
/// Maximum number of profiles in a block.
const MOST: usize = 4096;

/// Profiles that still come.
#[derive(Clone, Debug, Default)]
pub struct ProfileStream {
    named: Option<ProfileJoint>,
    /// For how many of the seconds each joint speaks.
    shown: BTreeMap<ProfileJoint, usize>,
    waiting: Vec<Profile>,
}

impl ProfileStream {
    /// A stream of a joint, or of the one that its profiles show.
    #[must_use]
    pub fn new(joint: Option<ProfileJoint>) -> Self {
        Self { named: joint, ..Self::default() }
    }

    /// The joint of the search; `None` before any was found.
    #[must_use]
    pub fn joint(&self) -> Option<ProfileJoint> {
        // Of equals the first in order.
        let most = self.shown.iter().rev().max_by_key(|(_, count)| **count);
        self.named.or(most.map(|(joint, _)| *joint))
    }

    /// Takes a profile in; returns the features of the waiting ones.
    pub fn push(&mut self, profile: Profile) -> Vec<Feature> {
        self.waiting.push(profile);
        let count = self.waiting.len();
        let span_ns = self.waiting[count - 1].stamp_ns.saturating_sub(self.waiting[0].stamp_ns);
        if (count >= FEWEST && span_ns >= LEAST_NS) || count >= MOST { self.finish() } else { Vec::new() }
    }

    /// The features of all that wait: nothing more comes.
    pub fn finish(&mut self) -> Vec<Feature> {
        let profiles = std::mem::take(&mut self.waiting);
        if self.named.is_none()
            && let Some(joint) = joint_choice::joint(&profiles)
        {
            *self.shown.entry(joint).or_default() += 1;
        }
        self.joint().map_or_else(Vec::new, |joint| seams(&profiles, Some(joint)).found.features)
    }
}
