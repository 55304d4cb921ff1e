//! A clock that stepped amid a scan: outliers, rivals and large residuals then follow from it.

use super::reason::Reason;
use super::stream_name::StreamName;
use crate::assess::outlier_segments::{Cause, OutlierSegment};
use crate::findings::Findings;
use crate::input::timestamps::StampReport;

/// A stretch of fewer features than this part explains no refusal of the whole scan.
const LEAST_PART: f64 = 0.2;
/// Largest sum of the shares of features that two answers explain if they divide the features between them. An alias explains them twice.
const SHARED: f64 = 1.2;
/// A gap in the stamps is the step if it differs by less than this part.
const ALIKE: f64 = 0.1;

/// The reasons, with the step of a clock in the place of those that follow from it.
pub(super) fn instead_of_its_effects(f: &Findings, reasons: Vec<Reason>) -> Vec<Reason> {
    let is_effect = |reason: &Reason| {
        matches!(
            reason,
            Reason::TooManyOutliers { .. }
                | Reason::LineOfOutliers { .. }
                | Reason::AmbiguousTimeOffset { .. }
                | Reason::OtherTimeOffset { .. }
                | Reason::ClockStep { .. }
                | Reason::ResidualsTooLarge { .. }
                | Reason::PartMoved { .. }
        )
    };
    match stretch(f) {
        Some(step) if reasons.iter().any(is_effect) => {
            std::iter::once(step).chain(reasons.into_iter().filter(|reason| !is_effect(reason))).collect()
        }
        _ => reasons,
    }
}

/// Whether another time offset holds in a long stretch.
#[must_use]
pub(crate) fn is_shown(f: &Findings) -> bool {
    stretch(f).is_some()
}

/// The longest stretch in which another time offset holds.
fn stretch(f: &Findings) -> Option<Reason> {
    let least = LEAST_PART * f.fit.residuals.used as f64;
    let long = f.checks.outlier_segments.iter().filter(|segment| segment.features as f64 >= least);
    let (segment, step_s) = long.filter_map(|segment| Some((segment, step(f, segment)?))).next()?;
    let span_s = segment.span_s.map(|s| f.streams.stamp_s(s));
    Some(Reason::OtherTimeOffset { span_s, step_s, clock: clock(f, segment, step_s) })
}

/// Change of the time offset in a stretch, s: of the stretch itself, or of a rival that explains the other features.
fn step(f: &Findings, segment: &OutlierSegment) -> Option<f64> {
    if let Cause::ClockStep(step_s) = segment.cause {
        return Some(step_s);
    }
    let shares = |explains: f64, best_explains: f64| explains + best_explains < SHARED;
    let rival =
        f.checks.ambiguity.others().find(|rival| shares(rival.test.explains, rival.test.best_explains))?;
    Some(rival.parameters.time_offset_s - f.unknowns.parameters.time_offset_s)
}

/// The clock that stepped: the stamps of its stream have a gap as long as the step. A clock that steps back is refused where it is read.
fn clock(f: &Findings, segment: &OutlierSegment, step_s: f64) -> Option<StreamName> {
    let first_s = f.fit.features.iter().map(|feature| feature.stamp_s).fold(f64::INFINITY, f64::min);
    // A stretch at the beginning ends with the step.
    let onwards_s = if segment.span_s[0] <= first_s { -step_s } else { step_s };
    let stream = if onwards_s < 0.0 { StreamName::Robot } else { StreamName::Images };
    let stamps = match stream {
        StreamName::Robot => &f.streams.robot,
        StreamName::Images => &f.streams.images,
    };
    has_gap(stamps, onwards_s.abs()).then_some(stream)
}

fn has_gap(stamps: &StampReport, step_s: f64) -> bool {
    let gap_s = stamps.longest_gap_s - stamps.median_period_s;
    (gap_s - step_s).abs() < ALIKE * step_s + stamps.median_period_s
}
