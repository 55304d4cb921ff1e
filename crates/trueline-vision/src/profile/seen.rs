//! Findings in the profiles of a scan.

use super::face_end::FaceEnd;
use super::finder::ProfileFinder;
use super::joint::ProfileJoint;
use super::no_seam::NoSeam;
use super::seen_joint::SeenJoint;
use super::shape_of_plate::{refuse_shapes, share_radius, widen_rounded};
use super::sight::Sight;
use super::view::at_border;
use crate::scan::joint_choice::odd_widths;
use rayon::prelude::*;
use trueline_dataset::Profile;
use trueline_dataset::unit::MM_PER_M;

/// Measurement of a joint in each profile; all profiles determine which end is a plate's, and which gap the joint's.
pub(super) fn seen(profiles: &[&Profile], joint: ProfileJoint) -> Vec<Result<SeenJoint, NoSeam>> {
    let sights: Vec<Result<Sight, NoSeam>> = profiles
        .par_iter()
        .map_init(ProfileFinder::default, |finder, profile| sight(finder, profile, joint))
        .collect();
    let [left, right] = [(0, -1.0), (1, 1.0)].map(|(side, sign)| {
        let ends: Vec<Option<FaceEnd>> = sights.iter().map(|sight| sight.as_ref().ok()?.end(side)).collect();
        at_border(&ends, sign)
    });
    let mut joints: Vec<Result<SeenJoint, NoSeam>> = sights
        .into_iter()
        .enumerate()
        .map(|(k, sight)| sight.and_then(|sight| sight.joint([left[k], right[k]])))
        .collect();
    refuse_odd_gaps(&mut joints);
    refuse_shapes(&mut joints);
    share_radius(&mut joints);
    widen_rounded(&mut joints);
    joints
}

fn refuse_odd_gaps(joints: &mut [Result<SeenJoint, NoSeam>]) {
    let gaps = joints.iter_mut().filter_map(|joint| {
        let (width_mm, pitch_mm) = joint.as_ref().ok()?.gap_mm()?;
        Some((joint, width_mm, pitch_mm))
    });
    let (gaps, sizes): (Vec<_>, Vec<_>) = gaps.map(|(joint, width, pitch)| (joint, (width, pitch))).unzip();
    let widths: Vec<f64> = sizes.iter().map(|(width, _)| *width).collect();
    // Each end is exact to a column.
    let most_pitch = sizes.iter().map(|(_, pitch)| *pitch).fold(0.0, f64::max);
    for (joint, is_odd) in gaps.into_iter().zip(odd_widths(&widths, 2.0 * most_pitch)) {
        if is_odd {
            *joint = Err(NoSeam::OddGap);
        }
    }
}

fn sight(finder: &mut ProfileFinder, profile: &Profile, joint: ProfileJoint) -> Result<Sight, NoSeam> {
    let points_mm: Vec<[f64; 2]> =
        profile.points.iter().map(|point| [point.x_m * MM_PER_M, point.z_m * MM_PER_M]).collect();
    finder.sight(&points_mm, joint)
}
