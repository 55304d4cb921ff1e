//! Samples that are kept from one sweep to the next.
//!
//! A solve sweeps a scan at time offsets that hardly differ, and gathering the samples is half of a sweep. So they are kept from
//! the second sweep at nearly the same time offset on, or from the first where that is known beforehand. Of scans of more than one
//! chunk they would not stay in the processor's caches, and are gathered each time.

use crate::problem::simd::{CHUNK, Gathering, Samples, Scan};
use std::sync::{Arc, Mutex, PoisonError};

/// The samples of a scan, as they are swept.
pub(crate) struct Packed {
    /// The samples.
    pub samples: Vec<Samples>,
    time_offset_s: f64,
}

impl Packed {
    fn of(scan: &Scan<'_>) -> Self {
        let (lines, time_offset_s) = (scan.at.lines.len(), scan.at.time_offset_s);
        let gathering = Gathering::new(scan.observations, scan.list, lines, time_offset_s);
        Self { samples: gathering.all(), time_offset_s }
    }
}

/// Keeps the samples of one problem.
#[derive(Default)]
pub(crate) struct Packing(Mutex<Kept>);

#[derive(Default)]
enum Kept {
    /// Nothing was swept yet.
    #[default]
    Nothing,
    /// It was swept at this time offset, s.
    Offset(f64),
    /// The samples.
    Samples(Arc<Packed>),
}

/// Samples hold for another time offset as long as it is within this part of the robot's period: of four stamps one leaves its
/// segment in as many cases.
const SAME_PART: f64 = 0.1;

impl Packing {
    /// Of a problem that will be swept beside this time offset, s.
    pub(crate) fn beside(time_offset_s: f64) -> Self {
        Self(Mutex::new(Kept::Offset(time_offset_s)))
    }

    /// The samples that a scan is to be swept by, if any are worth keeping.
    pub(crate) fn samples(&self, scan: &Scan<'_>) -> Option<Arc<Packed>> {
        if scan.list.len() > CHUNK {
            return None;
        }
        // What a panic left is whole: it is replaced in one go.
        let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let offset_s = scan.at.time_offset_s;
        let same_s = SAME_PART * scan.observations.robot.trajectory.median_period();
        let is_same = |other_s: f64| (offset_s - other_s).abs() < same_s;
        match &*kept {
            Kept::Samples(packed) if is_same(packed.time_offset_s) => return Some(Arc::clone(packed)),
            Kept::Offset(last_s) if is_same(*last_s) => {}
            _ => {
                *kept = Kept::Offset(offset_s);
                return None;
            }
        }
        let packed = Arc::new(Packed::of(scan));
        *kept = Kept::Samples(Arc::clone(&packed));
        Some(packed)
    }
}
