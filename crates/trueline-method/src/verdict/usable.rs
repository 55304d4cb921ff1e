//! The share of the answer's measurements that could be used.

use super::limits::{LEAST_USED, LEAST_USED_BADLY, MANY_SKIPPED};
use super::reason::Reason;
use crate::findings::Findings;
use crate::input::skip::Skip;
use std::collections::BTreeMap;

/// Used measurements: stripes if these give the answer, else features.
struct Usable<'a> {
    used: usize,
    all: usize,
    skipped: &'a BTreeMap<Skip, usize>,
}

impl<'a> Usable<'a> {
    fn of(f: &'a Findings) -> Self {
        let of_features = || Self {
            used: f.fit.residuals.used,
            all: f.streams.features,
            skipped: &f.fit.residuals.skipped,
        };
        let of_stripes = || {
            let (used, skipped) = (f.used_stripes()?.counts.stripes, &f.stripes.as_ref()?.skipped);
            Some(Self { used, all: used + skipped.values().sum::<usize>(), skipped })
        };
        of_stripes().unwrap_or_else(of_features)
    }

    fn mostly(&self) -> Option<(Skip, usize)> {
        self.skipped.iter().max_by_key(|(_, count)| **count).map(|(why, count)| (*why, *count))
    }

    fn too_few(&self) -> Option<Reason> {
        let (mostly, mostly_count) = self.mostly()?;
        Some(Reason::TooFewUsed { used: self.used, features: self.all, mostly, mostly_count })
    }
}

/// Too few measurements could be used.
pub(super) fn too_few_used(f: &Findings) -> Option<Reason> {
    let usable = Usable::of(f);
    let share = usable.used as f64 / usable.all as f64;
    let badly = share < LEAST_USED_BADLY.0 && f.fit.noise_factor > LEAST_USED_BADLY.1;
    if share >= LEAST_USED && !badly { None } else { usable.too_few() }
}

/// An answer outside the search window must explain the whole scan. Otherwise it may be an alias of a repeating path, with part of the measurements
/// outside the robot's recording.
pub(super) fn beyond_the_window(f: &Findings) -> Option<Reason> {
    let usable = Usable::of(f);
    let is_beyond = f.unknowns.parameters.time_offset_s.abs() > f.config.offset_search_s;
    let is_part = usable.mostly()?.1 * MANY_SKIPPED > usable.all;
    if is_beyond && is_part { usable.too_few() } else { None }
}
