//! The joint of a scan: the one that most of its pictures confirm.

use crate::detection::Detection;
use crate::measure::regression::median;
use crate::not_found::NotFound;
use crate::rare_joint::is_rare;
use crate::seam::Joint;

/// Findings in one picture of each joint of [`Joint::ALL`], if any.
pub(crate) type JointTrial = [Option<Detection>; Joint::ALL.len()];

/// Part of the pictures in which a joint of several segments must be found to be preferred to a simpler one.
const MOSTLY: f64 = 0.5;
/// A gap is a joint only in several pictures, and only if it is equally wide everywhere (median deviation as a part of the
/// median), or present in this part of the pictures. Soot and scratches make gaps as well, but not one in each picture.
const EVEN: f64 = 0.15;
const NEARLY_ALWAYS: f64 = 0.8;
const SEVERAL: usize = 6;
const FEWEST_GAPS: usize = 3;
/// A groove with faces this far apart at the root, as a part of its width, has a flat root and no bottom.
const FLAT: f64 = 0.2;
/// Gaps are of the same width within this part of it.
const ALIKE: f64 = 0.25;
/// Part of the gaps that must share a width for it to be the joint's.
const SHARED: f64 = 0.6;

/// The joint; `None` if there is no seam in any picture.
#[must_use]
pub fn joint(trials: &[JointTrial]) -> Option<Joint> {
    let found = |number: usize| trials.iter().filter(|trial| trial[number].is_some()).count();
    // Joints with more segments are tried first: every groove has a corner that a fillet could be, too.
    for (number, joint) in Joint::ALL.into_iter().enumerate() {
        let share = found(number) as f64 / trials.len().max(1) as f64;
        let plausible = match joint {
            Joint::VGroove => !has_flat_root(trials),
            Joint::Butt => trials.len() >= FEWEST_GAPS && (share >= NEARLY_ALWAYS || even(trials, number)),
            // Every stripe ends somewhere: an edge is a joint if it is there always, in several pictures.
            Joint::Edge => share >= NEARLY_ALWAYS && trials.len() >= SEVERAL,
            _ => true,
        };
        if share >= MOSTLY && plausible {
            return Some(joint);
        }
    }
    // Less often: the most frequent one, unless it is so rare that it is chance. A gap, or an end, in fewer than half of the
    // pictures is dirt.
    let joints = Joint::ALL.into_iter().enumerate();
    let joints = joints.filter(|(_, joint)| !matches!(joint, Joint::Butt | Joint::Edge));
    let most = joints.max_by_key(|(number, _)| (found(*number), Joint::ALL.len() - number));
    most.filter(|(number, _)| !is_rare(found(*number), trials.len())).map(|(_, joint)| joint)
}

/// Refuses the gaps that are not as wide as most of the others. Without a width that most of them share, nothing is
/// refused.
pub fn refuse_odd_gaps<'a>(seams: impl Iterator<Item = &'a mut Result<Detection, NotFound>>) {
    let mut found: Vec<&mut Result<Detection, NotFound>> = seams.filter(|found| found.is_ok()).collect();
    let widths: Vec<f64> =
        found.iter().filter_map(|found| found.as_ref().ok().map(|found| found.seam.gap_m)).collect();
    for (found, is_odd) in found.iter_mut().zip(odd_widths(&widths, 0.0)) {
        if is_odd {
            **found = Err(NotFound::OddGap);
        }
    }
}

/// The widths that differ from those of most others by more than a quarter or `least`; none without a width that most of
/// them share.
pub(crate) fn odd_widths(widths: &[f64], least: f64) -> Vec<bool> {
    let near = |width: f64, other: f64| (width - other).abs() <= (ALIKE * width).max(least);
    let sharing = |width: f64| widths.iter().filter(|other| near(width, **other)).count();
    let usual = widths.iter().copied().max_by_key(|width| sharing(*width));
    let usual = usual.filter(|width| sharing(*width) as f64 >= SHARED * widths.len() as f64);
    widths.iter().map(|width| usual.is_some_and(|usual| !near(usual, *width))).collect()
}

/// Whether the root of a groove is flat in most of the pictures that show both its faces and its shoulders.
fn has_flat_root(trials: &[JointTrial]) -> bool {
    let [bottoms, shoulders] =
        [Joint::VGroove, Joint::Groove].map(|joint| Joint::ALL.iter().position(|other| *other == joint));
    let (Some(bottoms), Some(shoulders)) = (bottoms, shoulders) else { return false };
    let mut parts: Vec<f64> = trials
        .iter()
        .filter_map(|trial| {
            let (bottom, shoulders) = (trial[bottoms]?, trial[shoulders]?);
            Some(bottom.seam.gap_m / (shoulders.second?.on_sheet_m - shoulders.seam.on_sheet_m).norm())
        })
        .collect();
    !parts.is_empty() && median(&mut parts) > FLAT
}

/// Whether the gap is the same in all pictures: gaps that soot or scratches make are not.
fn even(trials: &[JointTrial], number: usize) -> bool {
    let mut widths: Vec<f64> =
        trials.iter().filter_map(|trial| trial[number].map(|found| found.seam.gap_m)).collect();
    let middle = median(&mut widths);
    let mut off: Vec<f64> = widths.iter().map(|width| (width - middle).abs()).collect();
    median(&mut off) < EVEN * middle
}
