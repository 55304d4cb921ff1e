//! Confounded causes: errors that a scan cannot separate from a wrong shape of the sensor.
//!
//! A seam that swings with one frequency has an acceleration proportional to its displacement. An arm that lags behind its commands then changes the
//! measured width in the same way as a wrong scale of the sensor. Each cause is therefore estimated with a prior of its usual size. If the shape is
//! no longer significant, that cause may explain it.

use crate::assess::cause_kind::CauseKind;
use crate::assess::misfit_patterns::Patterns;
use crate::assess::sensor_shape::{SensorShape, WALD_LIMIT};
use crate::problem::parameters::Parameters;
use nalgebra::{DMatrix, SVector};

/// A cause that a scan cannot separate from a wrong sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConfoundedCause {
    /// Its kind.
    pub kind: CauseKind,
    /// Its size if it is the cause, in the unit of its kind. The largest of several numbers.
    pub size: f64,
}

/// Difference of hᵀ C⁻¹ h that separates two causes: three standard deviations.
const TOLD_APART: f64 = 9.0;

/// A size below this fraction of the usual one is ignored.
const WORTH_NAMING: f64 = 0.05;

/// The confounded causes of a shape, the likeliest first, at a solution with the total covariance of all unknowns.
#[must_use]
pub(crate) fn find(
    patterns: &Patterns,
    shape: &SensorShape,
    at: &Parameters,
    covariance: &DMatrix<f64>,
) -> Vec<ConfoundedCause> {
    let first = at.unknowns().shape().start;
    let own = covariance.fixed_view::<5, 5>(first, first).into_owned();
    let h = SVector::<f64, 5>::from(shape.found.h);
    let mut found: Vec<(f64, ConfoundedCause)> = CauseKind::ALL
        .into_iter()
        .filter_map(|kind| {
            let allowed = patterns.allowed_for(kind, usual_sizes(kind))?;
            let moves = allowed.unknowns_per_size.rows(first, 5);
            let beside = h + moves * &allowed.size;
            let with_size = &allowed.covariance * moves.transpose();
            let solved = (own + moves * &with_size).cholesky()?.solve(&beside);
            // Its size if the sensor is right.
            let sizes = &allowed.size - with_size * solved;
            let size = sizes.iter().copied().max_by(|a, b| a.abs().total_cmp(&b.abs()))?;
            let usual = usual_sizes(kind).first().copied().unwrap_or_default();
            let is_possible = (size > 0.0 || !kind.is_one_sided()) && size.abs() > WORTH_NAMING * usual;
            let wald = beside.dot(&solved);
            (wald < WALD_LIMIT && is_possible).then_some((wald, ConfoundedCause { kind, size }))
        })
        .collect();
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    let most = found.first().map_or(0.0, |(least, _)| least + TOLD_APART);
    found.into_iter().filter(|(wald, _)| *wald < most).map(|(_, cause)| cause).collect()
}

/// Usual sizes of a cause's numbers, in the unit of its kind. Empty for causes of the sensor itself, and for causes that are always estimated.
fn usual_sizes(kind: CauseKind) -> &'static [f64] {
    match kind {
        CauseKind::Flex => &[2e-4],
        CauseKind::Backlash => &[1e-4; 3],
        CauseKind::AttitudeLag => &[5e-3],
        CauseKind::RollingShutter => &[20e-3],
        CauseKind::SideBias => &[1.0; 2],
        // A time constant of 30 ms, squared.
        CauseKind::CommandedPose => &[9e-4],
        CauseKind::Lens | CauseKind::TiltBias => &[],
    }
}
