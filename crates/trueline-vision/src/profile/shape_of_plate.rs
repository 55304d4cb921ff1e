//! Shapes that are a matter of the plate, and not of one profile: a rounded end, a round face.
//!
//! Behind the last column on the face of a rounded plate others follow, further and further off, up to its end. If a few of them are
//! lost, or one sees another object, a profile seems to end there. Some profiles see too little of a round face to separate it from two
//! straight ones. Their neighbours correct this.

use super::no_seam::{NoSeam, RadiusUm};
use super::seen_joint::SeenJoint;
use crate::measure::regression::median;

/// Profiles before and after one that are asked.
const NEIGHBOURS: usize = 16;
/// Part of the profiles with a joint, or such a shape, above which the shape is the plate's. Sharp ends, ends rounded by up
/// to a millimetre, and straight faces stay below.
const MANY: f64 = 1.0 / 3.0;

/// Behind a sharp end the edge is exact to a column or two. Ends with a larger uncertainty, in distances of columns, are
/// rounded.
const SHARP_COLUMNS: f64 = 3.0;

/// The profiles about one.
fn about<T>(all: &[T], k: usize) -> &[T] {
    &all[k.saturating_sub(NEIGHBOURS)..(k + NEIGHBOURS + 1).min(all.len())]
}

/// Refuses the joints of profiles with neighbours that show a rounded end, or a round face.
pub(super) fn refuse_shapes(joints: &mut [Result<SeenJoint, NoSeam>]) {
    let seen: Vec<Option<NoSeam>> = joints.iter().map(|joint| joint.as_ref().err().copied()).collect();
    for (k, joint) in joints.iter_mut().enumerate().filter(|(_, joint)| joint.is_ok()) {
        let about = about(&seen, k);
        let count =
            |is: fn(&NoSeam) -> bool| about.iter().flatten().filter(|reason| is(reason)).count() as f64;
        let shown = about.iter().filter(|reason| reason.is_none()).count() as f64;
        let [ends, faces] = [count(is_rounded_end), count(is_round_face)];
        if ends > 0.0 && ends >= MANY * (ends + shown) {
            *joint = Err(NoSeam::RoundedEnd);
        } else if faces > 0.0 && faces >= MANY * (faces + shown) {
            *joint = Err(NoSeam::RoundFace(usual_radius(about)));
        }
    }
}

/// Gives all round faces of a scan the radius that they usually have: one reason, and not one a profile.
pub(super) fn share_radius(joints: &mut [Result<SeenJoint, NoSeam>]) {
    let seen: Vec<Option<NoSeam>> = joints.iter().map(|joint| joint.as_ref().err().copied()).collect();
    let usual = NoSeam::RoundFace(usual_radius(&seen));
    joints
        .iter_mut()
        .filter(|joint| joint.as_ref().is_err_and(is_round_face))
        .for_each(|joint| *joint = Err(usual));
}

fn is_rounded_end(reason: &NoSeam) -> bool {
    *reason == NoSeam::RoundedEnd
}

fn is_round_face(reason: &NoSeam) -> bool {
    matches!(reason, NoSeam::RoundFace(_))
}

fn usual_radius(seen: &[Option<NoSeam>]) -> RadiusUm {
    let of = |reason: &Option<NoSeam>| match reason {
        Some(NoSeam::RoundFace(radius)) => Some(radius.mm()),
        _ => None,
    };
    RadiusUm::of_mm(median(&mut seen.iter().filter_map(of).collect::<Vec<_>>()))
}

/// If neighbours show a rounded end, the uncertainty of the edge is at least their median.
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
