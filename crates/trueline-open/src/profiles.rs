//! The seam in whole profiles.

use crate::error::OpenError;
use crate::observer::{OpenObserver, Told};
use trueline_dataset::{FoundSeams, Profile};
use trueline_vision::profile;

/// The seams of profiles.
///
/// # Errors
/// Profiles of which none shows a corner.
pub fn seams_of_profiles(profiles: &[Profile], observer: &dyn OpenObserver) -> Result<FoundSeams, OpenError> {
    let seams = profile::seams(profiles);
    observer.told(&Told::SeamsInProfiles {
        found: seams.found.features.len(),
        of: profiles.len(),
        without: &seams.not_found,
    });
    if seams.found.features.is_empty() {
        return Err(OpenError::NoSeamInProfiles(profiles.len()));
    }
    Ok(seams.found)
}
