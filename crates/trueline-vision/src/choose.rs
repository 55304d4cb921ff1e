//! Which joint a scan shows: the one that most of its pictures bear out.

use crate::regression::median;
use crate::seam::{Joint, Seam};

/// The seam of each joint of [`Joint::ALL`] in one picture, where there is one.
pub type Trial = [Option<Seam>; 4];

/// Part of the pictures in which a joint of several pieces must be found to be preferred to a simpler one.
const MOSTLY: f64 = 0.5;
/// A gap is a joint only if it is equally wide everywhere (median deviation as a part of the median), or there in
/// this part of the pictures: soot and scratches make gaps as well, but not one in each picture.
const EVEN: f64 = 0.15;
const NEARLY_ALWAYS: f64 = 0.8;

/// The joint; `None` if there is no seam in any picture.
#[must_use]
pub fn joint(trials: &[Trial]) -> Option<Joint> {
    let found = |number: usize| trials.iter().filter(|trial| trial[number].is_some()).count();
    // What has more pieces is asked for first: every groove has a corner that a fillet could be, too.
    for (number, joint) in Joint::ALL.into_iter().enumerate() {
        let share = found(number) as f64 / trials.len().max(1) as f64;
        let gap = joint != Joint::Butt || share >= NEARLY_ALWAYS || even(trials, number);
        if share >= MOSTLY && gap {
            return Some(joint);
        }
    }
    // Less often: whatever there is most of, but a gap only if it is the same everywhere.
    let most = (0..3).max_by_key(|number| (found(*number), 3 - number));
    most.filter(|number| found(*number) > 0).map(|number| Joint::ALL[number])
}

/// Whether the gap is the same in all pictures: gaps that soot or scratches make are not.
fn even(trials: &[Trial], number: usize) -> bool {
    let mut widths: Vec<f64> =
        trials.iter().filter_map(|trial| trial[number].map(|seam| seam.gap_m)).collect();
    let middle = median(&mut widths);
    let mut off: Vec<f64> = widths.iter().map(|width| (width - middle).abs()).collect();
    median(&mut off) < EVEN * middle
}
