//! Checks that a stated noise applies to any feature.

use crate::config::Config;
use crate::error::noise_unused::NoiseUnused;
use trueline_dataset::{Recording, Sensor};

/// Rejects a stated noise that would be ignored.
pub(crate) fn check(recording: &Recording, config: &Config) -> Result<(), NoiseUnused> {
    let are_pixels = matches!(recording.sensor, Sensor::CameraLaser { .. });
    let has_own = |feature: &trueline_dataset::Feature| feature.sigma.is_some();
    // If stripes are lengths, the noise gives the scale of their bias with the tilt.
    let is_of_stripes = !are_pixels && !recording.stripes.is_empty();
    let unused = match (config.feature_sigma_px, config.feature_sigma_m) {
        (None, None) => return Ok(()),
        (_, Some(_)) if are_pixels => NoiseUnused::FeaturesArePixels,
        (Some(_), _) if !are_pixels => NoiseUnused::FeaturesAreLengths,
        _ if recording.features.iter().all(has_own) && !is_of_stripes => NoiseUnused::EachHasItsOwn,
        _ => return Ok(()),
    };
    Err(unused)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::{NoiseUnused, check};
    use crate::config::Config;
    use trueline_sim::{Preset, simulate};

    #[test]
    fn a_noise_that_would_be_ignored_is_refused_with_its_reason() {
        let mut camera = simulate(&Preset::Good.scenario(), 1).unwrap();
        camera.features.iter_mut().for_each(|feature| feature.sigma = None);
        let mut profiler = camera.clone();
        profiler.sensor = trueline_dataset::Sensor::Profiler;
        let mut with_own = camera.clone();
        with_own.features.iter_mut().for_each(|feature| feature.sigma = Some([0.2; 2]));
        let px = Config { feature_sigma_px: Some(0.5), ..Config::default() };
        let mm = Config { feature_sigma_m: Some(1e-4), ..Config::default() };
        assert_eq!(check(&camera, &px), Ok(()));
        assert_eq!(check(&profiler, &mm), Ok(()));
        assert_eq!(check(&with_own, &Config::default()), Ok(()));
        assert_eq!(check(&camera, &mm), Err(NoiseUnused::FeaturesArePixels));
        assert_eq!(check(&profiler, &px), Err(NoiseUnused::FeaturesAreLengths));
        assert_eq!(check(&with_own, &px), Err(NoiseUnused::EachHasItsOwn));
        // One feature without its own noise is enough.
        with_own.features[3].sigma = None;
        assert_eq!(check(&with_own, &px), Ok(()));
    }
}
