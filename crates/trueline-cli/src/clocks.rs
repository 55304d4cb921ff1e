//! `--align-clocks`: streams without a common clock.

use crate::failure::Failure;
use crate::{opening, output, progress};
use trueline_dataset::{Profile, Recording};
use trueline_method::Config;
use trueline_method::diagnose::clock_alignment::{align, aligned};

/// Takes from the image stamps what they are ahead of the robot's, ns, and says so.
pub(crate) fn align_recording(
    recording: &mut Recording,
    config: &Config,
    quiet: bool,
) -> Result<(), Failure> {
    let tried = progress::steps(quiet, |watch| align(recording, config, watch));
    let found = tried.map_err(|error| Failure::new(error.to_string(), error.hint()))?;
    *recording = aligned(recording, found.images_ahead_ns);
    if !quiet {
        output::words(&format!(
            "note: image stamps are {:.3} s ahead of the robot's; the time offset below contains that",
            found.images_ahead_ns as f64 * 1e-9
        ));
    }
    Ok(())
}

/// The same for an import, whose profiles may not have been looked at.
pub(crate) fn align_import(recording: &mut Recording, profiles: &mut [Profile]) -> Result<(), Failure> {
    if profiles.is_empty() {
        return align_recording(recording, &Config::default(), false);
    }
    let features = opening::in_profiles(profiles, None, false)?.features;
    let mut seen = Recording { features, ..recording.clone() };
    align_recording(&mut seen, &Config::default(), false)?;
    profiles.iter_mut().for_each(|profile| profile.stamp_ns -= seen.images_ahead_ns);
    Ok(())
}
