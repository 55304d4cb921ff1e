//! What a calibration says of the data, in its own words: the doctor repeats it before it tries anything.

use crate::{Calibration, Reason, Warning};

/// Reasons and warnings that name something in the data; not those that ask for other motion, or follow from the residuals.
pub(super) fn of_data(c: &Calibration) -> Vec<String> {
    let reasons = c.reasons().iter().filter(|reason| is_reason_of_data(reason)).map(ToString::to_string);
    let warnings = c.warnings().iter().filter(|warning| is_warning_of_data(warning)).map(ToString::to_string);
    reasons.chain(warnings).collect()
}

fn is_reason_of_data(reason: &Reason) -> bool {
    if let Reason::TooManyOutliers { outliers } = reason {
        // Of a majority of outliers the doctor looks for the cause.
        return 2 * outliers.count < outliers.of;
    }
    matches!(
        reason,
        Reason::SensorOff { .. }
            | Reason::CoarseRobotStamps { .. }
            | Reason::StripesContradict { .. }
            | Reason::OtherTimeOffset { .. }
            | Reason::RobotStreamFroze { .. }
            | Reason::ClockStep { .. }
            | Reason::TooFewUsed { .. }
    )
}

fn is_warning_of_data(warning: &Warning) -> bool {
    !matches!(
        warning,
        // What was stated or decided, and what other motion would show.
        Warning::DecidedByUser { .. }
            | Warning::UncertaintyNotApplied
            | Warning::SensorOfItsOwnScan
            | Warning::DrawnLineNotNeeded { .. }
            | Warning::MirrorBySensor
            | Warning::HeldAtGuess { .. }
            | Warning::WidenedByProfile { .. }
            | Warning::PoorlyKnown { .. }
            | Warning::NoPointAtStandOff { .. }
            // What was taken out, or is a symptom whose cause has a warning of its own.
            | Warning::FeatureBias { .. }
            | Warning::StructuredResiduals { .. }
            | Warning::CrossValidationMisfit { .. }
            | Warning::CrossValidationShift { .. }
    )
}
