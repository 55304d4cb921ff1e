//! The seams of all profiles of a scan.

use super::corner::{CornerFinder, NoCorner};
use rayon::prelude::*;
use std::collections::BTreeMap;
use trueline_dataset::unit::MM_PER_M;
use trueline_dataset::{Feature, Measured, Profile};

/// What was found in the profiles of a scan.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ProfileSeams {
    /// One feature for each profile with a corner, by rising stamp.
    pub features: Vec<Feature>,
    /// Profiles without one, by reason.
    pub not_found: BTreeMap<NoCorner, usize>,
}

/// Looks at every profile as a whole; nothing is remembered from the one before. The result does not depend on the number of threads.
#[must_use]
pub fn seams(profiles: &[Profile]) -> ProfileSeams {
    let found: Vec<Result<Feature, NoCorner>> =
        profiles.par_iter().map_init(CornerFinder::default, feature).collect();
    let mut seams = ProfileSeams::default();
    for result in found {
        match result {
            Ok(feature) => seams.features.push(feature),
            Err(reason) => *seams.not_found.entry(reason).or_insert(0) += 1,
        }
    }
    seams
}

fn feature(finder: &mut CornerFinder, profile: &Profile) -> Result<Feature, NoCorner> {
    let points_mm: Vec<[f64; 2]> =
        profile.points.iter().map(|point| [point.x_m * MM_PER_M, point.z_m * MM_PER_M]).collect();
    let corner = finder.find(&points_mm)?;
    let covariance = corner.covariance_mm2;
    Ok(Feature {
        stamp_ns: profile.stamp_ns,
        line: 0,
        frame: profile.frame,
        device_ns: None,
        measured: Measured::Profile([corner.point_mm.x / MM_PER_M, corner.point_mm.y / MM_PER_M]),
        sigma: Some([covariance.m11.sqrt() / MM_PER_M, covariance.m22.sqrt() / MM_PER_M]),
    })
}
