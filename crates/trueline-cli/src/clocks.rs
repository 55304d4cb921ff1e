//! `--align-clocks`: streams without a common clock.

use crate::failure::Failure;
use crate::{opening, output, progress};
use trueline_dataset::{Profile, Recording};
use trueline_method::Config;
use trueline_method::diagnose::clock_alignment::{align, aligned};

/// Subtracts from the image stamps their lead over the robot's, ns, and reports it.
pub(crate) fn align_recording(
    recording: &mut Recording,
    config: &Config,
    quiet: bool,
) -> Result<(), Failure> {
    let ahead_s = shift(recording, config, quiet)?;
    if !quiet {
        output::words(&format!(
            "note: the image clock is {:.3} s {} the robot clock; the time offset below includes this",
            ahead_s.abs(),
            if ahead_s < 0.0 { "behind" } else { "ahead of" }
        ));
    }
    Ok(())
}

/// Takes the shift from the image stamps, and returns it, s.
fn shift(recording: &mut Recording, config: &Config, quiet: bool) -> Result<f64, Failure> {
    let tried = progress::steps(quiet, |watch| align(recording, config, watch));
    let found = tried.map_err(|error| Failure::new(error.to_string(), error.hint()))?;
    *recording = aligned(recording, found.images_ahead_ns);
    Ok(found.images_ahead_ns as f64 * 1e-9)
}

/// The same for an import; its profiles may not have been searched yet. The dataset is written with the moved stamps.
pub(crate) fn align_import(recording: &mut Recording, profiles: &mut [Profile]) -> Result<(), Failure> {
    let ahead_s = if profiles.is_empty() {
        shift(recording, &Config::default(), false)?
    } else {
        let features = opening::in_profiles(profiles, None, false)?.features;
        let mut seen = Recording { features, ..recording.clone() };
        let ahead_s = shift(&mut seen, &Config::default(), false)?;
        profiles.iter_mut().for_each(|profile| profile.stamp_ns -= seen.images_ahead_ns);
        ahead_s
    };
    output::words(&format!(
        "note: {:+.3} s is added to the sensor's stamps in this dataset. The time offset of `calibrate` \
         holds for these stamps; for the sensor's own stamps add {ahead_s:+.3} s to it",
        -ahead_s
    ));
    Ok(())
}
