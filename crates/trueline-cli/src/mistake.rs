//! The doctor's finding on a scan with residuals that look like a mistake in the data.

use crate::progress;
use std::time::Duration;
use trueline_dataset::Recording;
use trueline_method::diagnose::doctor::diagnose;
use trueline_method::{Calibration, Config, Reason, Target};

/// After this no further mistake is tried: `trueline doctor` has more time.
const LONGEST: Duration = Duration::from_secs(5);

/// The mistake that explains a refused calibration, in a user's words; `None` if its residuals do not suggest one, or none
/// of the mistakes tried explains it.
pub(crate) fn found(
    recording: &Recording,
    calibration: &Calibration,
    config: &Config,
    quiet: bool,
) -> Option<String> {
    let first = calibration.reasons().first()?;
    let is_misfit = matches!(first, Reason::ResidualsTooLarge { .. } | Reason::TooManyOutliers { .. });
    // A curve can follow data with a mistake in them. A straight line that fits without the mistake explains them better.
    let is_curve = calibration.findings.curve.is_some() && config.target != Target::Curve;
    if !is_misfit && !is_curve {
        return None;
    }
    let look = || diagnose(recording, config, Some(LONGEST), |_| {});
    let diagnosis = progress::during("looking for a mistake in the data", quiet, look);
    let is_explained = !diagnosis.explained_by.is_empty() && !diagnosis.as_recorded.fits();
    diagnosis.findings.into_iter().next().filter(|_| is_explained)
}
