//! A seam about a place: the local quadratic through the points around it.

use crate::track_settings::{AheadError, TrackSettings};
use nalgebra::{SMatrix, Vector3};
use trueline_geometry::local_polynomial::{slope_at, value_at};

/// Fewest points of a fit.
pub(crate) const FEWEST: usize = 5;
/// Largest number of points used: of more, every other one or fewer.
const MOST: usize = 128;

/// The seam at a place.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SeamFit {
    pub along_m: f64,
    pub point: Vector3<f64>,
    /// Unit direction in which the way rises.
    pub tangent: Vector3<f64>,
    /// Standard deviation across the seam, along each direction, m.
    pub sigma_m: f64,
}

/// The fit at a way along the seam, m.
pub(crate) fn at(
    settings: &TrackSettings,
    points: &[Vector3<f64>],
    along_m: &[f64],
    sigmas_m: &[f64],
    at_m: f64,
) -> Result<SeamFit, AheadError> {
    let (Some(first_m), Some(last_m)) = (along_m.first().copied(), along_m.last().copied()) else {
        return Err(AheadError::TooFewPoints { points: 0, needed: FEWEST });
    };
    let limit_m = settings.longest_extrapolation_m;
    if at_m > last_m + limit_m {
        return Err(AheadError::BeyondSeam { by_m: at_m - last_m, limit_m });
    }
    if at_m < first_m - limit_m {
        return Err(AheadError::BeforeSeam { by_m: first_m - at_m });
    }
    // Near an end the window is that of the end.
    let half_m = settings.half_window_m;
    let middle_m = at_m.clamp(
        first_m + half_m.min(0.5 * (last_m - first_m)),
        (last_m - half_m).max(0.5 * (first_m + last_m)),
    );
    let from = along_m.partition_point(|way| *way < middle_m - half_m);
    let to = along_m.partition_point(|way| *way <= middle_m + half_m);
    let count = to - from;
    if count < FEWEST {
        return Err(AheadError::TooFewPoints { points: count, needed: FEWEST });
    }
    let chosen = || (from..to).step_by(count.div_ceil(MOST));
    let powers = |k: usize| value_at::<3>((along_m[k] - middle_m) / half_m);
    let (mut normal, mut right) = (SMatrix::<f64, 3, 3>::zeros(), SMatrix::<f64, 3, 3>::zeros());
    for k in chosen() {
        let weight = sigmas_m[k].powi(-2);
        normal += powers(k) * powers(k).transpose() * weight;
        right += powers(k) * (points[k] - points[from]).transpose() * weight;
    }
    let few = AheadError::TooFewPoints { points: count, needed: FEWEST };
    let Some(factor) = normal.cholesky() else { return Err(few) };
    let fit = factor.solve(&right);
    let place = (at_m - middle_m) / half_m;
    let value = |powers: &nalgebra::SVector<f64, 3>| (powers.transpose() * fit).transpose();
    let slope = value(&slope_at::<3>(place));
    let Some(tangent) = slope.try_normalize(f64::MIN_POSITIVE) else { return Err(few) };
    // Points scatter as they state, or more: then the fit is worse by as much.
    let squares: f64 = chosen()
        .map(|k| {
            let off = points[k] - points[from] - value(&powers(k));
            (off - tangent * off.dot(&tangent)).norm_squared() * sigmas_m[k].powi(-2)
        })
        .sum();
    let free = 2.0 * (chosen().count() - 3) as f64;
    let factor_of_noise = (squares / free).max(1.0);
    let by_noise = value_at::<3>(place).dot(&factor.solve(&value_at::<3>(place))) * factor_of_noise;
    // Beyond the points the seam may bend.
    let beyond_m = (at_m - last_m).max(first_m - at_m).max(0.0);
    let by_bend_m = 0.5 * settings.curvature_per_m * beyond_m * (beyond_m + half_m);
    Ok(SeamFit {
        along_m: at_m,
        point: points[from] + value(&value_at::<3>(place)),
        tangent,
        sigma_m: by_noise.sqrt().hypot(by_bend_m),
    })
}
