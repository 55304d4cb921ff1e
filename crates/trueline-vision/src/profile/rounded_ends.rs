//! Ends that are rounded: whether the end of a plate bends away is a matter of the plate, and not of one profile.
//!
//! Behind the last column on the face of a rounded plate others follow, further and further off, up to its end. Where a few of them are lost, or one sees
//! something else, a profile ends there and says so to a column. Its neighbours know better.

use super::no_seam::NoSeam;
use super::seen_joint::SeenJoint;
use crate::measure::regression::median;

/// Profiles before and after one that are asked.
const NEIGHBOURS: usize = 16;
/// Part of those that show an end from which the end is a rounded one: of sharp ends, and of such that are rounded by up to a millimetre, none is.
const ROUNDED: f64 = 1.0 / 3.0;

/// Behind a sharp end the edge is known to a column or two; ends that are known to more, distances of columns, are rounded.
const SHARP_COLUMNS: f64 = 3.0;

/// The profiles about one.
fn about<T>(all: &[T], k: usize) -> &[T] {
    &all[k.saturating_sub(NEIGHBOURS)..(k + NEIGHBOURS + 1).min(all.len())]
}

/// Refuses the ends of profiles whose neighbours show that they are rounded.
pub(super) fn refuse_rounded(joints: &mut [Result<SeenJoint, NoSeam>]) {
    let is_rounded: Vec<Option<bool>> = joints
        .iter()
        .map(|joint| match joint {
            Ok(_) => Some(false),
            Err(NoSeam::RoundedEnd) => Some(true),
            Err(_) => None,
        })
        .collect();
    for (k, joint) in joints.iter_mut().enumerate().filter(|(_, joint)| joint.is_ok()) {
        let (rounded, all) = about(&is_rounded, k)
            .iter()
            .flatten()
            .fold((0_u32, 0_u32), |(rounded, all), is_rounded| (rounded + u32::from(*is_rounded), all + 1));
        if f64::from(rounded) >= ROUNDED * f64::from(all) {
            *joint = Err(NoSeam::RoundedEnd);
        }
    }
}

/// Where neighbours show an end that is rounded, the edge is nowhere known better than half of them say.
pub(super) fn widen_rounded(joints: &mut [Result<SeenJoint, NoSeam>]) {
    for number in 0..2 {
        let behind_mm: Vec<Option<f64>> = joints
            .iter_mut()
            .map(|joint| Some(joint.as_mut().ok()?.ends_mut().nth(number)?.behind_mm[1]))
            .collect();
        for (k, joint) in joints.iter_mut().enumerate() {
            let Some(end) = joint.as_mut().ok().and_then(|joint| joint.ends_mut().nth(number)) else {
                continue;
            };
            let mut of_neighbours: Vec<f64> = about(&behind_mm, k).iter().flatten().copied().collect();
            let usual_mm = median(&mut of_neighbours);
            if usual_mm > SHARP_COLUMNS * end.pitch_mm && end.behind_mm[1] < usual_mm {
                (end.behind_mm, end.is_bounded) = ([0.0, usual_mm], true);
            }
        }
    }
}
