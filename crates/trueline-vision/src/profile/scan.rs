//! The seams of all profiles of a scan, and the stripes on the plates that meet there.

use super::corner::{CornerFinder, FaceSupport, MeetingFaces, NoCorner, ProfileCorner};
use super::shared_noise::share_noise;
use nalgebra::Vector2;
use rayon::prelude::*;
use std::collections::BTreeMap;
use trueline_dataset::unit::MM_PER_M;
use trueline_dataset::{Feature, FoundSeams, Measured, PlateStripe, Profile, correlation_of};

/// What was found in the profiles of a scan.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ProfileSeams {
    /// One feature for each profile with a corner, by rising stamp, and the stripes of its two faces.
    pub found: FoundSeams,
    /// Profiles without one, by reason.
    pub not_found: BTreeMap<NoCorner, usize>,
}

/// Looks at every profile as a whole; from its neighbours it has but the noise. The result does not depend on the number of
/// threads.
#[must_use]
pub fn seams(profiles: &[Profile]) -> ProfileSeams {
    let mut faces: Vec<Result<MeetingFaces, NoCorner>> =
        profiles.par_iter().map_init(CornerFinder::default, faces).collect();
    share_noise(&mut faces.iter_mut().flatten().collect::<Vec<_>>());
    let mut seams = ProfileSeams::default();
    for (profile, faces) in profiles.iter().zip(faces) {
        match faces.and_then(|faces| faces.corner().ok_or(NoCorner::NoAngle)) {
            Ok(corner) => {
                seams.found.features.push(feature(profile, &corner));
                seams.found.stripes.extend(stripes(profile, &corner));
            }
            Err(reason) => *seams.not_found.entry(reason).or_insert(0) += 1,
        }
    }
    seams
}

fn faces(finder: &mut CornerFinder, profile: &Profile) -> Result<MeetingFaces, NoCorner> {
    let points_mm: Vec<[f64; 2]> =
        profile.points.iter().map(|point| [point.x_m * MM_PER_M, point.z_m * MM_PER_M]).collect();
    finder.faces(&points_mm)
}

fn measured(point_mm: &Vector2<f64>) -> Measured {
    Measured::Profile([point_mm.x / MM_PER_M, point_mm.y / MM_PER_M])
}

fn feature(profile: &Profile, corner: &ProfileCorner) -> Feature {
    let covariance = corner.covariance_mm2;
    Feature {
        stamp_ns: profile.stamp_ns,
        line: 0,
        frame: profile.frame,
        device_ns: None,
        measured: measured(&corner.point_mm),
        sigma: Some([covariance.m11.sqrt() / MM_PER_M, covariance.m22.sqrt() / MM_PER_M]),
        correlation: correlation_of(&covariance),
    }
}

fn stripes(profile: &Profile, corner: &ProfileCorner) -> [PlateStripe; 2] {
    let stripe = |plate: u32, face: &FaceSupport| PlateStripe {
        stamp_ns: profile.stamp_ns,
        frame: profile.frame,
        plate,
        points: [measured(&face.points_mm[0]), measured(&face.points_mm[1])],
        sigma: face.sigma_mm / MM_PER_M,
    };
    [stripe(0, &corner.faces[0]), stripe(1, &corner.faces[1])]
}
