//! Options of the program that help with a calibration's reasons and warnings.

use trueline_method::error::noise_unused::NoiseUnused;
use trueline_method::{Calibration, Error, Reason, Warning};

/// Options for the user to try next, once each.
pub(crate) fn of(calibration: &Calibration) -> Vec<&'static str> {
    let reasons = calibration.reasons().iter().filter_map(for_reason);
    let mut hints: Vec<&'static str> = Vec::new();
    for hint in reasons.chain(calibration.warnings().iter().filter_map(for_warning)) {
        if !hints.contains(&hint) {
            hints.push(hint);
        }
    }
    hints
}

/// Pages of the book on the reasons, by their codes.
pub(crate) fn pages(calibration: &Calibration) -> Option<String> {
    let mut codes: Vec<&str> = calibration.reasons().iter().map(Reason::code).collect();
    codes.dedup();
    let named = codes.join(", ");
    (!codes.is_empty()).then(|| {
        format!("the documentation (docs/book, “It was not accepted”) has a page on each reason: {named}")
    })
}

fn for_reason(reason: &Reason) -> Option<&'static str> {
    match reason {
        Reason::ResidualsTooLarge { .. } => Some(
            "`trueline doctor` tries the usual mistakes; --feature-sigma-px or --feature-sigma-mm states the sensor's noise",
        ),
        Reason::SensorOff { beyond_stated: true, .. } => Some(
            "--sensor free ignores [uncertainty] in sensor.toml; correct that, or calibrate the sensor again",
        ),
        Reason::SensorOff { .. } => Some("--sensor prior corrects it, --write-sensor FILE writes it"),
        Reason::DrawnLineOff { .. } => Some(
            "without --drawn-line the result's `lines` contain the edge from the scan; --drawn-line-sigma-mm \
             states the uncertainty of the drawing",
        ),
        Reason::AmbiguousTimeOffset { .. } => {
            Some("state what you know with --offset-within SECONDS or --looks AXIS")
        }
        Reason::AtStops { .. } => Some("`trueline calibrate DATASET --at-stops`"),
        Reason::Unobservable(_) => Some("`trueline plan` finds a scan that determines everything"),
        _ => None,
    }
}

fn for_warning(warning: &Warning) -> Option<&'static str> {
    match warning {
        Warning::UnusualNoise { .. } => {
            Some("--feature-sigma-px or --feature-sigma-mm states the noise of the sensor")
        }
        Warning::SensorOff { .. } | Warning::LensOff { .. } => {
            Some("--write-sensor FILE writes the corrected sensor")
        }
        Warning::MirrorBySensor => {
            Some("`trueline plan` finds a scan that separates them; --sensor fixed holds the sensor")
        }
        _ => None,
    }
}

/// The same for a recording without any result; else the library's own hint.
pub(crate) fn for_error(error: &Error) -> &'static str {
    match error {
        Error::PointsNotInSheet { .. } => {
            "check that all points are measured by one laser plane, in the camera frame; --residual \
                point-to-line needs no plane"
        }
        Error::NoOverlap { .. } => {
            "if two clocks stamped them, --align-clocks estimates their shift; `trueline doctor` detects \
             wrong units of time"
        }
        Error::FeatureNoiseUnused { why: NoiseUnused::FeaturesArePixels } => "use --feature-sigma-px",
        Error::FeatureNoiseUnused { why: NoiseUnused::FeaturesAreLengths } => "use --feature-sigma-mm",
        Error::NothingToHold { .. } | Error::NoGuessToHold => "give it in initial.toml or with --initial",
        other => other.hint(),
    }
}
