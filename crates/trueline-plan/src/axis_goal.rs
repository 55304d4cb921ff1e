//! Requirements on the external axes, beside those on time offset and hand-eye. Without them the best scan would leave an axis standing.

use crate::cell_axis::CellAxis;
use crate::criterion::Goal;
use nalgebra::DMatrix;
use trueline_dataset::{AxisMotion, Carries};
use trueline_geometry::AxisKind;
use trueline_geometry::axis::{AXIS, AXIS_POINT, AXIS_TIME_OFFSET};
use trueline_method::problem::parameters::LINES;

/// Standard deviations of direction (rad), place (m) and time offset (s) that are about as hard to reach as the default goal:
/// 0.01°, 0.1 mm and 0.1 ms.
const WANTED: [f64; 3] = [1.7453e-4, 1e-4, 1e-4];

/// The largest standard deviation of an axis over the required one. A goal that is less strict than the default is so for the axes too.
/// Parts that no motion of one straight seam shows do not count.
#[must_use]
pub(crate) fn score(axes: &[CellAxis], goal: &Goal, covariance: &DMatrix<f64>) -> f64 {
    let usual = Goal::default();
    let ratios = (0..LINES).filter_map(|k| Some(goal.wanted(k)? / usual.wanted(k)?));
    let less_strict = ratios.fold(1.0, f64::max);
    let of_axis = |(k, axis): (usize, &CellAxis)| {
        let [least, most] = ends(covariance, AXIS * k);
        let is_track = axis.record.kind == AxisKind::Linear;
        let direction = if is_track && axis.record.carries != Carries::Sensor { least } else { most };
        let place = if is_track { 0.0 } else { ends(covariance, AXIS * k + AXIS_POINT)[1] };
        let at = AXIS * k + AXIS_TIME_OFFSET;
        let offset =
            if axis.limits.motion == AxisMotion::Runs { 0.0 } else { covariance[(at, at)].max(0.0).sqrt() };
        let ratios = [direction, place, offset].into_iter().zip(WANTED);
        ratios.map(|(sigma, wanted)| sigma / wanted).fold(0.0, f64::max)
    };
    axes.iter().enumerate().map(of_axis).fold(0.0, f64::max) / less_strict
}

/// Least and largest standard deviation of two numbers in any direction.
fn ends(covariance: &DMatrix<f64>, first: usize) -> [f64; 2] {
    let (a, b, c) =
        (covariance[(first, first)], covariance[(first, first + 1)], covariance[(first + 1, first + 1)]);
    let (mean, half) = (0.5 * (a + c), (0.5 * (a - c)).hypot(b));
    [mean - half, mean + half].map(|variance| variance.max(0.0).sqrt())
}
