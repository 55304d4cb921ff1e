//! What the scan says of the plates themselves: where they are, how well that is known, and whether they are flat.

use crate::assess::observability::is_null;
use crate::stripe::frames::{Sight, StripeFrame};
use crate::stripe::state::StripeState;
use crate::{input::observations::Observations, order_statistics::quantile, stripe::problem::placement};
use nalgebra::{DMatrix, DVector, Matrix2, Vector3};
use trueline_model::Plate;
use trueline_model::plate::{SURFACE_LENGTH_M, SURFACE_REACH_M, surface_terms};

/// One plate.
#[derive(Clone, Debug, PartialEq)]
pub struct PlaneEstimate {
    /// Its number.
    pub number: usize,
    /// The plate.
    pub plate: Plate,
    /// Standard deviation of its normal, about the axis about which it is known least, rad.
    pub sigma_rad: f64,
    /// Standard deviation of its offset at the middle of the scan, m.
    pub sigma_m: f64,
    /// Whether the scan shows its normal, and its offset.
    pub seen: [bool; 2],
    /// Largest distance of its visible surface from the plane that fits it best, m.
    pub bow_m: f64,
}

/// The angle between the plates of a joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointAngle {
    /// Angle that the plates open to the side on which they lie, rad.
    pub value_rad: f64,
    /// Standard deviation, rad.
    pub sigma_rad: f64,
}

/// Parts of the support points that may lie beyond either end of what counts as visible.
const BEYOND: f64 = 0.02;
/// Places along each axis at which a surface is looked at.
const GRID: usize = 5;

/// The plates of a state, with the covariance of its tangent and what of that is not seen.
#[must_use]
pub fn planes(
    observations: &Observations,
    frames: &[StripeFrame],
    at: &StripeState,
    (covariance, null): (&DMatrix<f64>, &DMatrix<f64>),
) -> Vec<PlaneEstimate> {
    let unknowns = at.unknowns();
    let mut all = Vec::new();
    for (joint, plates) in at.joints.iter().enumerate() {
        for (number, plate) in plates.iter().enumerate() {
            let first = unknowns.plane(joint, number).start;
            let tilts: Matrix2<f64> = covariance.fixed_view::<2, 2>(first, first).into_owned();
            let visible = visible(observations, frames, at, (joint, number));
            all.push(PlaneEstimate {
                number: 2 * joint + number,
                plate: *plate,
                sigma_rad: tilts.symmetric_eigenvalues().max().max(0.0).sqrt(),
                sigma_m: covariance[(first + 2, first + 2)].max(0.0).sqrt(),
                seen: [!(is_null(null, first) || is_null(null, first + 1)), !is_null(null, first + 2)],
                bow_m: visible.map_or(0.0, |visible| bow_m(plate, visible)),
            });
        }
    }
    all
}

/// The angle between the plates of each joint.
#[must_use]
pub fn angles(at: &StripeState, covariance: &DMatrix<f64>) -> Vec<JointAngle> {
    let unknowns = at.unknowns();
    let of = |(joint, plates): (usize, &[Plate; 2])| {
        let outward = plates.map(|plate| plate.chart.along.cross(&plate.normal));
        let axis = outward[0].cross(&outward[1]).normalize();
        // Turning plate k about the seam by θ opens the angle by −θ or θ, as the axis lies.
        let signs = [-axis.dot(&plates[0].chart.along), axis.dot(&plates[1].chart.along)];
        let mut slope = DVector::zeros(unknowns.dimension());
        (0..2).for_each(|k| slope[unknowns.plane(joint, k).start] = signs[k]);
        let variance = slope.dot(&(covariance * &slope));
        JointAngle { value_rad: outward[0].angle(&outward[1]), sigma_rad: variance.max(0.0).sqrt() }
    };
    at.joints.iter().enumerate().map(of).collect()
}

/// The range of r and s in which a plate is seen.
fn visible(
    observations: &Observations,
    frames: &[StripeFrame],
    at: &StripeState,
    (joint, number): (usize, usize),
) -> Option<[[f64; 2]; 2]> {
    let chart = &at.joints[joint][number].chart;
    let mut hint = 0;
    let mut places: [Vec<f64>; 2] = Default::default();
    for frame in frames.iter().filter(|frame| frame.joint == joint) {
        let Sight::Stripes(stripes) = &frame.sight else { continue };
        let Some(placement) = placement(observations, frame, at, &mut hint) else { continue };
        for support in stripes[number].iter().flatten() {
            let point: Vector3<f64> = placement.point_in_base(&observations.sheet.point(&support.reported));
            places[0].push(chart.outward.dot(&(point - chart.centre)) / SURFACE_REACH_M);
            places[1].push(chart.along.dot(&(point - chart.centre)) / SURFACE_LENGTH_M);
        }
    }
    let range = |values: &[f64]| {
        let of = |share: f64| quantile(values.iter().copied(), share);
        Some([of(BEYOND)?, of(1.0 - BEYOND)?])
    };
    Some([range(&places[0])?, range(&places[1])?])
}

/// Largest distance of a surface from its best plane over a grid, m.
fn bow_m(plate: &Plate, [reach, length]: [[f64; 2]; 2]) -> f64 {
    let on = |range: [f64; 2], k: usize| range[0] + (range[1] - range[0]) * k as f64 / (GRID - 1) as f64;
    let places: Vec<[f64; 2]> =
        (0..GRID * GRID).map(|k| [on(reach, k % GRID), on(length, k / GRID)]).collect();
    let beta = nalgebra::SVector::from(plate.surface_m);
    let heights =
        DVector::from_iterator(places.len(), places.iter().map(|[r, s]| surface_terms(*r, *s).dot(&beta)));
    let flat = DMatrix::from_fn(places.len(), 3, |row, column| match column {
        0 => 1.0,
        other => places[row][other - 1],
    });
    let fitted = flat.clone().svd(true, true).solve(&heights, 1e-12);
    fitted.map_or(0.0, |fitted| (heights - flat * fitted).amax())
}
