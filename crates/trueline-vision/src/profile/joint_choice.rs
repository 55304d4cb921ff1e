//! The joint of a scan: the one that most of its profiles confirm.

use super::joint::ProfileJoint;
use super::no_seam::NoSeam;
use super::seen::seen;
use super::seen_joint::SeenJoint;
use crate::rare_joint::is_rare;
use trueline_dataset::Profile;

/// Number of sampled profiles.
const SAMPLED: usize = 24;
/// Least part of them with the joint; for an end, which every face has somewhere, the larger one.
const MOSTLY: f64 = 0.5;
const NEARLY_ALWAYS: f64 = 0.8;
/// Fewest profiles that show a gap, and an end: one alone may be dirt.
const FEWEST_GAPS: usize = 3;
const FEWEST_ENDS: usize = 6;

/// The joint; `None` if hardly any profile shows one.
pub(super) fn joint(profiles: &[Profile]) -> Option<ProfileJoint> {
    let step = profiles.len().div_ceil(SAMPLED).max(1);
    let sampled: Vec<&Profile> = profiles.iter().step_by(step).collect();
    let [meeting, laps, gaps, edges] = ProfileJoint::ALL.map(|joint| seen(&sampled, joint));
    let count = |seen: &[Result<SeenJoint, NoSeam>]| seen.iter().filter(|seen| seen.is_ok()).count();
    // A gap wider than the misalignment of its plates is not a step.
    let steps = laps.iter().zip(&gaps).filter(|(lap, gap)| lap.is_ok() && gap.is_err()).count();
    let (corners, gaps, edges) = (count(&meeting), count(&gaps), count(&edges));
    let part = |count: usize| count as f64 / sampled.len().max(1) as f64;
    if part(corners) >= MOSTLY {
        return Some(ProfileJoint::Meeting);
    }
    if part(steps) >= MOSTLY {
        return Some(ProfileJoint::Lap);
    }
    if part(gaps) >= MOSTLY && gaps >= FEWEST_GAPS {
        return Some(ProfileJoint::Butt);
    }
    if part(edges) >= NEARLY_ALWAYS && edges >= FEWEST_ENDS {
        return Some(ProfileJoint::Edge);
    }
    // Less often: the most frequent one, except gaps and ends, which are dirt then.
    let most = if steps > corners { (ProfileJoint::Lap, steps) } else { (ProfileJoint::Meeting, corners) };
    (!is_rare(most.1, sampled.len())).then_some(most.0)
}
