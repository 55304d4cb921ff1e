//! The seams of all profiles of a scan, and the stripes on the plates that make them.

use super::end_scatter::widen;
use super::face::FaceSupport;
use super::joint::ProfileJoint;
use super::joint_choice;
use super::lingering_ends::count_once;
use super::no_seam::NoSeam;
use super::seen::seen;
use super::seen_joint::ProfileSeam;
use super::shared_noise::share_noise;
use nalgebra::Vector2;
use std::collections::BTreeMap;
use trueline_dataset::unit::MM_PER_M;
use trueline_dataset::{Feature, FoundSeams, Measured, PlateStripe, Profile, correlation_of};

/// Seams found in the profiles of a scan.
#[derive(Clone, Debug, PartialEq)]
pub struct ProfileSeams {
    /// The joint of the search.
    pub joint: ProfileJoint,
    /// One feature for each profile with a seam, by rising stamp, and the stripes of its faces.
    pub found: FoundSeams,
    /// Profiles without one, by their place in the scan.
    pub not_found: Vec<(usize, NoSeam)>,
}

impl ProfileSeams {
    /// Number of profiles without a seam, by reason.
    #[must_use]
    pub fn reasons(&self) -> BTreeMap<NoSeam, usize> {
        let mut reasons = BTreeMap::new();
        self.not_found.iter().for_each(|(_, reason)| *reasons.entry(*reason).or_insert(0) += 1);
        reasons
    }
}

/// The seam in every profile. Without a joint, the most frequent one is detected. The result does not depend on the number of
/// threads.
#[must_use]
pub fn seams(profiles: &[Profile], joint: Option<ProfileJoint>) -> ProfileSeams {
    // Most scans are made over two faces, and their reasons say most.
    let joint = joint.or_else(|| joint_choice::joint(profiles)).unwrap_or(ProfileJoint::Meeting);
    let mut joints = seen(&profiles.iter().collect::<Vec<_>>(), joint);
    share_noise(&mut joints.iter_mut().flatten().collect::<Vec<_>>());
    let mut with_stamps: Vec<_> = profiles
        .iter()
        .zip(&mut joints)
        .filter_map(|(profile, joint)| Some((profile.stamp_ns, joint.as_mut().ok()?)))
        .collect();
    widen(&mut with_stamps);
    count_once(&mut with_stamps);
    let mut seams = ProfileSeams { joint, found: FoundSeams::default(), not_found: Vec::new() };
    for (k, (profile, joint)) in profiles.iter().zip(joints).enumerate() {
        match joint.and_then(|joint| joint.seam().ok_or(NoSeam::NoAngle)) {
            Ok(seam) => {
                seams.found.features.push(feature(profile, &seam));
                seams.found.stripes.extend(stripes(profile, &seam));
            }
            Err(reason) => seams.not_found.push((k, reason)),
        }
    }
    seams
}

fn measured(point_mm: &Vector2<f64>) -> Measured {
    Measured::Profile([point_mm.x / MM_PER_M, point_mm.y / MM_PER_M])
}

fn feature(profile: &Profile, seam: &ProfileSeam) -> Feature {
    let covariance = seam.covariance_mm2;
    Feature {
        stamp_ns: profile.stamp_ns,
        line: 0,
        frame: profile.frame,
        device_ns: None,
        measured: measured(&seam.point_mm),
        sigma: Some([covariance.m11.sqrt() / MM_PER_M, covariance.m22.sqrt() / MM_PER_M]),
        correlation: correlation_of(&covariance),
    }
}

fn stripes<'a>(profile: &'a Profile, seam: &'a ProfileSeam) -> impl Iterator<Item = PlateStripe> + 'a {
    let stripe = |(plate, face): (u32, &FaceSupport)| PlateStripe {
        stamp_ns: profile.stamp_ns,
        frame: profile.frame,
        plate,
        points: [measured(&face.points_mm[0]), measured(&face.points_mm[1])],
        sigma: face.sigma_mm / MM_PER_M,
    };
    (0..).zip(&seam.faces).filter_map(|(plate, face)| Some((plate, face.as_ref()?))).map(stripe)
}
