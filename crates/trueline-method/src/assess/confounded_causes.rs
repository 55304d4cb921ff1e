//! Alternative causes: errors that a scan cannot separate from a wrong shape of the sensor.
//!
//! A seam that swings with one frequency has an acceleration in proportion to its place: an arm that lags behind its commands then
//! widens or narrows what is seen as a wrong scale of the sensor does. So each cause is allowed for, as large as such causes are,
//! and where the shape is then nothing that a sensor without fault does not show, it may be that cause instead.

use crate::assess::cause_kind::CauseKind;
use crate::assess::misfit_patterns::Patterns;
use crate::assess::sensor_shape::{SensorShape, WALD_LIMIT};
use crate::problem::parameters::Parameters;
use nalgebra::{DMatrix, SVector};

/// A cause that a scan cannot separate from a wrong sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConfoundedCause {
    /// Which.
    pub kind: CauseKind,
    /// How large it would be, in the unit of its kind; of several numbers the largest.
    pub size: f64,
}

/// Difference of hᵀ C⁻¹ h that separates two causes: three standard deviations.
const TOLD_APART: f64 = 9.0;

/// Less than this part of its usual size is none.
const WORTH_NAMING: f64 = 0.05;

/// The causes that may be there in place of a shape, the likeliest first, at a solution with the covariance of all unknowns,
/// everything included.
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
            // As large as it is if the sensor is right.
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

/// How large the numbers of a cause are in cells that have it, in the unit of its kind; empty where a cause is the sensor's own, or
/// is allowed for anyway.
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
