//! The seam in whole profiles.

use crate::open::error::OpenError;
use crate::open::observer::{OpenObserver, Told};
use trueline_dataset::{FoundSeams, Profile};
use trueline_vision::Joint;
use trueline_vision::profile::{self, ProfileJoint};

/// The seams of profiles; without a joint, of the most frequent one.
///
/// # Errors
/// A joint that profiles are not searched for, and profiles without it.
pub fn seams_of_profiles(
    profiles: &[Profile],
    joint: Option<Joint>,
    observer: &dyn OpenObserver,
) -> Result<FoundSeams, OpenError> {
    let of = |joint| ProfileJoint::of(joint).ok_or(OpenError::NotInProfiles(joint));
    let seams = profile::seams(profiles, joint.map(of).transpose()?);
    observer.told(&Told::SeamsInProfiles {
        found: seams.found.features.len(),
        of: profiles.len(),
        joint: seams.joint,
        without: &seams.reasons(),
    });
    if seams.found.features.is_empty() {
        let most = seams.reasons().into_iter().max_by_key(|(_, count)| *count).map(|(reason, _)| reason);
        return Err(OpenError::NoSeamInProfiles { profiles: profiles.len(), most });
    }
    Ok(seams.found)
}
