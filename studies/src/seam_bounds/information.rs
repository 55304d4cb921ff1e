//! Information of a scan on all unknowns, by differences at the truth.

use super::seam::{Motion, Off, in_tool};
use nalgebra::{DMatrix, SMatrix, Vector3, Vector4};
use trueline_geometry::so3;

/// Clock and hand-eye transform.
pub(super) const SHARED: usize = 7;
/// Place of a part.
pub(super) const PLACE: usize = 6;
/// Noise of a seam point with the robot's, m.
const POINT_M: f64 = 0.0447e-3;
/// Noise of the angle of a line through 40 points of 0.04 mm over 10 mm, rad: σ √12 / (L √40).
const ANGLE_RAD: f64 = 2.19e-3;
/// Steps of differences: s, rad, m.
const STEPS: [f64; 3] = [1e-5, 1e-5, 1e-6];
/// Information on a control point that is known beforehand, 1/m²: 1 m.
const LEAST: f64 = 1.0;

/// What is known of the plates beside the seam.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Plates {
    Unseen,
    /// Each has an angle at each control point.
    Free,
    /// Each has one angle along the whole seam.
    Constant,
}

/// Unknowns: clock and hand-eye transform, place of the part, curves, plates.
pub(super) struct Layout {
    pub(super) size: usize,
    curves: Vec<usize>,
    plates: Vec<usize>,
}

impl Layout {
    fn of(motions: &[Motion], plates: Plates) -> Self {
        let mut size = SHARED + PLACE;
        let mut block = |own: usize| {
            size += own;
            size - own
        };
        let curves = motions.iter().map(|motion| block(2 * motion.seam.knots())).collect();
        let of_plates = |motion: &Motion| match plates {
            Plates::Unseen => 0,
            Plates::Free => 2 * motion.seam.knots(),
            Plates::Constant => 2,
        };
        let plates = motions.iter().map(|motion| block(of_plates(motion))).collect();
        Self { size, curves, plates }
    }
}

/// Derivatives of a frame: unknown and column.
fn columns(
    (motion, time_s): (&Motion, f64),
    middle: &Vector3<f64>,
    (layout, number, plates): (&Layout, usize, Plates),
) -> Vec<(usize, Vector4<f64>)> {
    let slope = |off: &dyn Fn(f64) -> Off, step: f64| {
        (motion.seen(time_s, middle, &off(step)) - motion.seen(time_s, middle, &off(-step))) / (2.0 * step)
    };
    let mut found = Vec::with_capacity(40);
    for k in 0..SHARED + PLACE {
        let off = |size: f64| {
            let mut off = Off::default();
            if k < SHARED {
                off.shared[k] = size
            } else {
                off.place[k - SHARED] = size
            }
            off
        };
        let is_turn = (1..4).contains(&k) || k >= SHARED + 3;
        let step = STEPS[if k == 0 {
            0
        } else if is_turn {
            1
        } else {
            2
        }];
        found.push((k, slope(&off, step)));
    }
    // The sheet may meet the curve one span farther on than the sensor's place.
    let at_m = motion.along_m(time_s);
    let mut near: Vec<usize> = [-2.0, -1.0, 0.0, 1.0, 2.0]
        .iter()
        .flat_map(|spans| motion.seam.basis(at_m + spans * 10e-3).map(|(knot, _)| knot))
        .collect();
    near.sort_unstable();
    near.dedup();
    for (knot, side) in near.iter().flat_map(|knot| [(*knot, 0), (*knot, 1)]) {
        let curve = |size: f64| Off { curve: Some((knot, side, size)), ..Off::default() };
        found.push((layout.curves[number] + 2 * knot + side, slope(&curve, STEPS[2])));
        let plate = |size: f64| Off { plate: Some((Some(knot), side, size)), ..Off::default() };
        if plates == Plates::Free {
            found.push((layout.plates[number] + 2 * knot + side, slope(&plate, STEPS[1])));
        }
    }
    for side in (0..2).filter(|_| plates == Plates::Constant) {
        let plate = |size: f64| Off { plate: Some((None, side, size)), ..Off::default() };
        found.push((layout.plates[number] + side, slope(&plate, STEPS[1])));
    }
    found
}

/// Information of one part with these seams.
pub(super) fn information(motions: &[Motion], plates: Plates) -> DMatrix<f64> {
    let layout = Layout::of(motions, plates);
    let mut sum = DMatrix::zeros(layout.size, layout.size);
    let middle = middle(motions);
    let mut weights = Vector4::repeat(POINT_M.powi(-2));
    let of_angle = if plates == Plates::Unseen { 0.0 } else { ANGLE_RAD.powi(-2) };
    weights.fixed_rows_mut::<2>(2).fill(of_angle);
    for (number, motion) in motions.iter().enumerate() {
        for time_s in motion.times_s() {
            let found = columns((motion, time_s), &middle, (&layout, number, plates));
            for (i, one) in &found {
                let weighted = one.component_mul(&weights);
                for (j, other) in &found {
                    sum[(*i, *j)] += weighted.dot(other);
                }
            }
        }
    }
    sum
}

fn middle(motions: &[Motion]) -> Vector3<f64> {
    let places = |motion: &Motion| {
        let quarter = |k: i32| motion.seam.point(motion.seam.length_m() * f64::from(k) / 4.0);
        (0..4).map(quarter).sum::<Vector3<f64>>() / 4.0
    };
    motions.iter().map(places).sum::<Vector3<f64>>() / motions.len() as f64
}

/// Adds what is known of some unknowns.
pub(super) fn known(information: &mut DMatrix<f64>, unknowns: std::ops::Range<usize>, sigma: f64) {
    for k in unknowns {
        information[(k, k)] += sigma.powi(-2);
    }
}

/// Information on the first unknowns if the others are unknown: what is left of them.
pub(super) fn left(information: &DMatrix<f64>, first: usize) -> DMatrix<f64> {
    let others = information.nrows() - first;
    let mut own = information.view((first, first), (others, others)).into_owned();
    for k in 0..others {
        own[(k, k)] += LEAST;
    }
    let mixed = information.view((first, 0), (others, first)).into_owned();
    let kept = information.view((0, 0), (first, first)).into_owned();
    own.cholesky().map_or_else(|| kept.clone(), |root| &kept - mixed.transpose() * root.solve(&mixed))
}

/// Standard deviations of the time offset, s, and of a point of the sheet ±30 × ±30 mm in the tool, RMS, m.
pub(super) fn bounds(shared: &DMatrix<f64>) -> [f64; 2] {
    let own: SMatrix<f64, SHARED, SHARED> = shared.fixed_view::<SHARED, SHARED>(0, 0).into();
    // Units of a millisecond, a milliradian and a millimetre, so that nothing is lost in the inverse.
    let scaled = own * 1e-6 + SMatrix::identity() * 1e-12;
    let Some(root) = scaled.cholesky() else { return [f64::INFINITY; 2] };
    let covariance = root.inverse() * 1e-6;
    // The four points have the second moments of the square.
    let half_m = 30e-3 / 3.0_f64.sqrt();
    let mut sum = 0.0;
    for [x, z] in [[-1.0, -1.0], [-1.0, 1.0], [1.0, -1.0], [1.0, 1.0]] {
        let place = in_tool(&Vector3::new(x * half_m, 0.0, 0.16 + z * half_m));
        let mut by = SMatrix::<f64, 3, SHARED>::zeros();
        by.fixed_columns_mut::<3>(1).copy_from(&-so3::hat(&place));
        by.fixed_columns_mut::<3>(4).fill_with_identity();
        sum += (by * covariance * by.transpose()).trace() / 4.0;
    }
    [covariance[(0, 0)].sqrt(), sum.sqrt()]
}
