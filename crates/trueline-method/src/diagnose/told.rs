//! Messages of a calibration about the data, which the doctor repeats before it tries anything.

use crate::{Calibration, Reason, Warning};

/// Reasons and warnings about the data, without those that require other motion or follow from the residuals.
pub(super) fn of_data(c: &Calibration) -> Vec<String> {
    let reasons = c.reasons().iter().filter(|reason| is_reason_of_data(reason)).map(ToString::to_string);
    let warnings = c.warnings().iter().filter(|warning| is_warning_of_data(warning)).map(ToString::to_string);
    reasons.chain(warnings).collect()
}

fn is_reason_of_data(reason: &Reason) -> bool {
    if let Reason::TooManyOutliers { outliers } = reason {
        // The doctor searches the cause of a majority of outliers itself.
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
        // Statements, decisions, and requests for other motion.
        Warning::DecidedByUser { .. }
            | Warning::UncertaintyNotApplied
            | Warning::SensorOfItsOwnScan
            | Warning::DrawnLineNotNeeded { .. }
            | Warning::MirrorBySensor
            | Warning::HeldAtGuess { .. }
            | Warning::WidenedByProfile { .. }
            | Warning::PoorlyKnown { .. }
            | Warning::NoPointAtStandOff { .. }
            // Errors that were removed, and symptoms whose cause has its own warning.
            | Warning::FeatureBias { .. }
            | Warning::StructuredResiduals { .. }
            | Warning::CrossValidationMisfit { .. }
            | Warning::CrossValidationShift { .. }
    )
}
