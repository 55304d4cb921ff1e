//! Limits of the sensor's view, estimated from the ends of faces in all profiles of a scan.
//!
//! A plate that continues beyond the view ends at the border in one profile after the other. These ends lie on one straight
//! line, because a view is a rectangle or a trapezium, and in the same column. A plate's edge moves through the view with
//! the robot, and turns smoothly at its nearest place to the border: its frequency within x of a turning point is
//! proportional to √x. So ends are at a border where three in four of those within six columns of their outermost line lie
//! within one and a half.

use super::face_end::FaceEnd;
use crate::measure::regression::median;

/// Ends so near to the outermost line lie on it, and others so near are compared with them; distances of columns.
const ON_BORDER: f64 = 1.5;
const NEAR_BORDER: f64 = 6.0;
/// Part of those near it that lie on it if it is a border, and fewest of them.
const PILED_UP: f64 = 0.75;
const FEWEST: usize = 5;
/// Part of all ends on the border beyond which all others with lost columns count as on it, too.
const MOSTLY: f64 = 0.5;
/// So far from a border an end may be its, distances of columns: a few were lost.
const AT_BORDER: f64 = 3.0;
/// Largest slope of a view's side, x over range: 45°.
const MOST_LEAN: f64 = 1.0;
/// A face that slopes by less does not leave the view by its range.
const LEAST_SLOPE: f64 = 0.1;

/// Which ends on one side (`sign` −1 or 1 along x) lie where the view ends.
pub(super) fn at_border(ends: &[Option<FaceEnd>], sign: f64) -> Vec<bool> {
    let seen: Vec<(usize, &FaceEnd)> =
        ends.iter().enumerate().filter_map(|(k, end)| Some((k, end.as_ref()?))).collect();
    let mut pitches: Vec<f64> = seen.iter().map(|(_, end)| end.pitch_mm()).collect();
    let pitch_mm = median(&mut pitches);
    let mut border = vec![false; ends.len()];
    let mut mark = |slacks: &[(usize, f64)]| {
        piled_up(slacks).for_each(|k| border[k] = true);
    };
    // Sides of the view.
    let places: Vec<[f64; 2]> = seen.iter().map(|(_, end)| [end.last().y, sign * end.last().x]).collect();
    if let Some([at_zero, slope]) = outermost_line(&places) {
        let slack = |[z, x]: &[f64; 2]| (at_zero + slope * z - x) / pitch_mm;
        mark(&seen.iter().zip(&places).map(|((k, _), place)| (*k, slack(place))).collect::<Vec<_>>());
    }
    // Its nearest and its furthest range.
    for towards in [-1.0, 1.0] {
        let leaving: Vec<&(usize, &FaceEnd)> =
            seen.iter().filter(|(_, end)| towards * end.slope() > LEAST_SLOPE).collect();
        let range = |end: &FaceEnd| towards * end.last().y;
        let last = leaving.iter().map(|(_, end)| range(end)).fold(f64::NEG_INFINITY, f64::max);
        let slack = |end: &FaceEnd| (last - range(end)) / (pitch_mm * end.slope().abs());
        mark(&leaving.iter().map(|(k, end)| (*k, slack(end))).collect::<Vec<_>>());
    }
    border
}

/// The distances from an outermost line, numbered, in distances of columns, that lie at a border.
fn piled_up(slacks: &[(usize, f64)]) -> impl Iterator<Item = usize> + '_ {
    let within = |limit: f64| slacks.iter().filter(|(_, slack)| *slack <= limit).count();
    let (on, near) = (within(ON_BORDER), within(NEAR_BORDER));
    let is_border = on >= FEWEST && on as f64 >= PILED_UP * near as f64;
    let limit = match is_border {
        true if on as f64 >= MOSTLY * slacks.len() as f64 => f64::INFINITY,
        true => AT_BORDER,
        false => f64::NEG_INFINITY,
    };
    slacks.iter().filter(move |(_, slack)| *slack <= limit).map(|(k, _)| *k)
}

/// The nearest line y = a + b x on or above all points, with the possible slope of a view's side: the edge of their upper
/// hull above their mean, or the steepest line that touches them.
fn outermost_line(points: &[[f64; 2]]) -> Option<[f64; 2]> {
    let mut sorted = points.to_vec();
    sorted.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    let mut hull: Vec<[f64; 2]> = Vec::new();
    let turn = |a: &[f64; 2], b: &[f64; 2], c: &[f64; 2]| {
        (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    };
    for point in sorted {
        while let [.., before, last] = hull.as_slice()
            && turn(before, last, &point) >= 0.0
        {
            hull.pop();
        }
        hull.push(point);
    }
    let mean = points.iter().map(|point| point[0]).sum::<f64>() / points.len() as f64;
    let pair = hull.windows(2).find(|pair| pair[0][0] <= mean && mean <= pair[1][0])?;
    let slope = (pair[1][1] - pair[0][1]) / (pair[1][0] - pair[0][0]);
    // Ends of a plate that is passed over at one height lie on one line as well, which leans like the plate.
    let slope = slope.clamp(-MOST_LEAN, MOST_LEAN);
    let touching = points.iter().map(|[x, y]| y - slope * x).fold(f64::NEG_INFINITY, f64::max);
    slope.is_finite().then_some([touching, slope])
}
