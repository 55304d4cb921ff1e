//! Information of a scan on all unknowns, by differences at the truth.

use super::seam::{Motion, Off, in_tool};
use nalgebra::{DMatrix, Matrix2, Matrix4, RowVector2, SMatrix, Vector2, Vector3, Vector4};
use trueline_geometry::so3;

/// Clock and hand-eye transform.
pub(super) const SHARED: usize = 7;
/// Place of a part.
pub(super) const PLACE: usize = 6;
/// Noise of a seam point with the robot's, m.
const POINT_M: f64 = 0.0447e-3;
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

/// Light that a frame measures.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Light {
    /// A seam point with noise of its own.
    Point,
    /// Two lines; the seam point is where they meet.
    Lines,
}

/// Points of a line, their noise, m, and distances of its ends from the seam, m.
const LINE_POINTS: f64 = 40.0;
const LINE_POINT_M: f64 = 0.04e-3;
const LINE_M: [f64; 2] = [1e-3, 11e-3];
/// Noise of the robot, m.
const ROBOT_M: f64 = 0.02e-3;

impl Light {
    /// Information of a frame on the seam point and the angles of both lines, by the directions of the lines in the sheet.
    fn weights(self, outward: &[Vector2<f64>; 2], plates: Plates) -> Matrix4<f64> {
        let covariance = self.covariance(outward);
        let mut weights = Matrix4::zeros();
        if plates == Plates::Unseen {
            let of_point = covariance.fixed_view::<2, 2>(0, 0).try_inverse().unwrap_or_default();
            weights.fixed_view_mut::<2, 2>(0, 0).copy_from(&of_point);
            return weights;
        }
        covariance.try_inverse().unwrap_or_default()
    }

    fn covariance(self, outward: &[Vector2<f64>; 2]) -> Matrix4<f64> {
        let mean_m2 = LINE_POINT_M.powi(2) / LINE_POINTS;
        let (middle_m, spread_m2) = ((LINE_M[0] + LINE_M[1]) / 2.0, (LINE_M[1] - LINE_M[0]).powi(2) / 12.0);
        let angle = mean_m2 / spread_m2;
        if self == Self::Point {
            return Matrix4::from_diagonal(&Vector4::new(POINT_M.powi(2), POINT_M.powi(2), angle, angle));
        }
        // Distance of the line from the seam point, square to it, and its angle.
        let (at_seam, mixed) = (mean_m2 + middle_m.powi(2) * angle, -middle_m * angle);
        let normals = outward.map(|along| RowVector2::new(-along.y, along.x));
        let point_by_distance = Matrix2::from_rows(&normals).try_inverse().unwrap_or_default();
        let mut covariance = Matrix4::zeros();
        let of_point = point_by_distance * at_seam * point_by_distance.transpose();
        covariance
            .fixed_view_mut::<2, 2>(0, 0)
            .copy_from(&(of_point + Matrix2::identity() * ROBOT_M.powi(2)));
        covariance.fixed_view_mut::<2, 2>(0, 2).copy_from(&(point_by_distance * mixed));
        covariance.fixed_view_mut::<2, 2>(2, 0).copy_from(&(point_by_distance.transpose() * mixed));
        covariance.fixed_view_mut::<2, 2>(2, 2).copy_from(&(Matrix2::identity() * angle));
        covariance
    }
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
pub(super) fn information(motions: &[Motion], plates: Plates, light: Light) -> DMatrix<f64> {
    let layout = Layout::of(motions, plates);
    let mut sum = DMatrix::zeros(layout.size, layout.size);
    let middle = middle(motions);
    for (number, motion) in motions.iter().enumerate() {
        for time_s in motion.times_s() {
            let found = columns((motion, time_s), &middle, (&layout, number, plates));
            let weights = light.weights(&motion.outward(time_s, &middle), plates);
            for (i, one) in &found {
                let weighted = weights * one;
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
