//! A laser plane from points of the stripe on several boards.
//!
//! The points of one board share its errors. The board is not flat, and its pose is not exact, so its whole stripe is
//! offset and tilted. 400 points on a board are therefore no 400 measurements: a board gives two numbers, the offset of
//! its stripe from the plane and the stripe's slope against it. Their spread from board to board is estimated from the
//! residuals, each by its share of freedom, and the covariance follows from that.

use crate::error::Error;
use crate::sheet_tilt;
use nalgebra::{Matrix3, RowVector3, Vector3};
use trueline_geometry::{Plane, fit};

/// Fewest boards: three stripes fix a plane, and one more gives its uncertainty.
pub const FEWEST_BOARDS: usize = 4;

/// A board is doubtful where its offset or slope is this many standard deviations from the plane.
pub const DOUBTFUL: f64 = 3.0;

/// The plane's normal moves by less than this at the end of the fit, rad and m.
const SETTLED: f64 = 1e-14;

/// A laser plane with its uncertainty.
#[derive(Clone, Debug)]
pub struct PlaneFit {
    /// The plane in the camera frame.
    pub plane: Plane,
    /// Covariance of (θ₁, θ₂, offset): tilts of the normal toward the axes of [`sheet_tilt::axes`], rad, and offset, m.
    pub covariance: Matrix3<f64>,
    /// Middle of all points, m.
    pub middle: Vector3<f64>,
    /// Standard deviation of the plane's offset there, m: independent of the tilt's error.
    pub middle_sigma_m: f64,
    /// Root mean square distance of all points from the plane, m.
    pub rms_m: f64,
    /// Spread from board to board of the stripes' offsets, m.
    pub offset_spread_m: f64,
    /// Spread from board to board of the stripes' slopes, rad.
    pub slope_spread_rad: f64,
    /// The boards in their order.
    pub boards: Vec<BoardResidual>,
}

/// How one board's stripe lies against the plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoardResidual {
    /// Mean signed distance of its points from the plane, m.
    pub offset_m: f64,
    /// Slope of its points against the plane, rad.
    pub slope_rad: f64,
    /// Offset and slope over their usual values.
    pub z: [f64; 2],
    /// Length of its stripe, m.
    pub length_m: f64,
}

/// Offset and slope of one board, and how they follow from the plane.
struct Stripe {
    /// Points.
    count: f64,
    /// Σ s², with s the place along the stripe from its middle, m².
    second_moment: f64,
    middle: Vector3<f64>,
    direction: Vector3<f64>,
    length_m: f64,
    /// Variance of one point across its own line, m².
    scatter: f64,
}

impl Stripe {
    fn of(points: &[Vector3<f64>]) -> Option<Self> {
        if points.len() < 2 {
            return None;
        }
        let count = points.len() as f64;
        let middle = points.iter().sum::<Vector3<f64>>() / count;
        let moments =
            points.iter().fold(Matrix3::zeros(), |sum, p| sum + (p - middle) * (p - middle).transpose());
        let eigen = moments.symmetric_eigen();
        let direction: Vector3<f64> = eigen.eigenvectors.column(eigen.eigenvalues.imax()).into();
        let along: Vec<f64> = points.iter().map(|p| direction.dot(&(p - middle))).collect();
        let second_moment: f64 = along.iter().map(|s| s * s).sum();
        let (low, high) = along.iter().fold((0.0, 0.0), |(l, h): (f64, f64), s| (l.min(*s), h.max(*s)));
        let across = (eigen.eigenvalues.sum() - eigen.eigenvalues.max()).max(0.0);
        // Two directions across a line; the plane's normal is about one of them.
        let scatter = 0.5 * across / (count - 2.0).max(1.0);
        (second_moment > 0.0).then_some(Self {
            count,
            second_moment,
            middle,
            direction,
            length_m: high - low,
            scatter,
        })
    }
}

/// One measured number: its derivative by (θ₁, θ₂, offset at the middle), its value, and its part in the fit.
struct Row {
    d_plane: RowVector3<f64>,
    value: f64,
    weight: f64,
    /// Variance that the points' own scatter leaves.
    scatter: f64,
}

/// Fits the plane to all points alike, and its covariance by boards.
///
/// # Errors
/// Too few boards with a stripe, or stripes that lie on one line.
pub fn fit_points(boards: &[Vec<Vector3<f64>>]) -> Result<PlaneFit, Error> {
    let stripes: Option<Vec<Stripe>> = boards.iter().map(|points| Stripe::of(points)).collect();
    let stripes = stripes.filter(|s| s.len() >= FEWEST_BOARDS).ok_or(Error::TooFewBoards {
        found: boards.iter().filter(|points| points.len() >= 2).count(),
        needed: FEWEST_BOARDS,
    })?;
    let all: Vec<Vector3<f64>> = boards.iter().flatten().copied().collect();
    let middle = all.iter().sum::<Vector3<f64>>() / all.len() as f64;
    let mut plane = fit::plane(&all).ok_or(Error::OneLine)?.plane;
    for _ in 0..20 {
        let (_, step) = solve(&rows(&stripes, &plane, &middle)).ok_or(Error::OneLine)?;
        plane = moved_about(&plane, &middle, &step);
        if step.norm() < SETTLED {
            break;
        }
    }
    conclude(plane, middle, &stripes, &all)
}

/// The plane with its normal tilted and its offset at `middle` changed.
fn moved_about(plane: &Plane, middle: &Vector3<f64>, step: &Vector3<f64>) -> Plane {
    let normal = (plane.normal().into_inner() + sheet_tilt::axes(plane) * step.xy()).normalize();
    let distance = plane.signed_distance(middle) - step.z;
    Plane::new(normal, normal.dot(middle) - distance).unwrap_or(*plane)
}

fn rows(stripes: &[Stripe], plane: &Plane, middle: &Vector3<f64>) -> Vec<Row> {
    let (normal, axes) = (plane.normal().into_inner(), sheet_tilt::axes(plane));
    stripes
        .iter()
        .flat_map(|stripe| {
            let offset = (stripe.middle - middle).transpose() * axes;
            let slope = stripe.direction.transpose() * axes;
            [
                Row {
                    d_plane: RowVector3::new(offset[0], offset[1], -1.0),
                    value: plane.signed_distance(&stripe.middle),
                    weight: stripe.count,
                    scatter: stripe.scatter / stripe.count,
                },
                Row {
                    d_plane: RowVector3::new(slope[0], slope[1], 0.0),
                    value: normal.dot(&stripe.direction),
                    weight: stripe.second_moment,
                    scatter: stripe.scatter / stripe.second_moment,
                },
            ]
        })
        .collect()
}

/// Inverse of the normal matrix, and the step; `None` where a direction is not seen.
fn solve(rows: &[Row]) -> Option<(Matrix3<f64>, Vector3<f64>)> {
    let (mut matrix, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for row in rows {
        matrix += row.d_plane.transpose() * row.d_plane * row.weight;
        right -= row.d_plane.transpose() * (row.value * row.weight);
    }
    let scale = matrix.diagonal().map(|d| 1.0 / d.sqrt());
    let scaled = Matrix3::from_fn(|i, j| matrix[(i, j)] * scale[i] * scale[j]);
    let values = scaled.symmetric_eigenvalues();
    if values.min() <= 1e-9 * values.max() {
        return None;
    }
    let inverse = scaled.try_inverse()?;
    let inverse = Matrix3::from_fn(|i, j| inverse[(i, j)] * scale[i] * scale[j]);
    Some((inverse, inverse * right))
}

fn conclude(
    plane: Plane,
    middle: Vector3<f64>,
    stripes: &[Stripe],
    all: &[Vector3<f64>],
) -> Result<PlaneFit, Error> {
    let rows = rows(stripes, &plane, &middle);
    let (inverse, _) = solve(&rows).ok_or(Error::OneLine)?;
    let variances = [spread(&rows, &inverse, 0), spread(&rows, &inverse, 1)];
    // The estimate is a weighted mean of rows with a variance that is now known: A⁻¹ (Σ w² v jᵀj) A⁻¹.
    let mut middle_matrix = Matrix3::zeros();
    for (k, row) in rows.iter().enumerate() {
        let variance = variances[k % 2] + row.scatter;
        middle_matrix += row.d_plane.transpose() * row.d_plane * (row.weight * row.weight * variance);
    }
    let about_middle = inverse * middle_matrix * inverse;
    let z = |k: usize| {
        let row = &rows[k];
        let leverage = (row.weight * row.d_plane * inverse * row.d_plane.transpose())[0];
        let variance = (variances[k % 2] + row.scatter) * (1.0 - leverage).max(1e-6);
        if variance > 0.0 { row.value / variance.sqrt() } else { 0.0 }
    };
    let boards = stripes.iter().enumerate().map(|(k, stripe)| BoardResidual {
        offset_m: rows[2 * k].value,
        slope_rad: rows[2 * k + 1].value,
        z: [z(2 * k), z(2 * k + 1)],
        length_m: stripe.length_m,
    });
    // The offset d = n·middle + (offset at the middle): tilts carry it along.
    let lever = middle.transpose() * sheet_tilt::axes(&plane);
    let d_step = Matrix3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, lever[0], lever[1], 1.0);
    let sum: f64 = all.iter().map(|p| plane.signed_distance(p).powi(2)).sum();
    Ok(PlaneFit {
        plane,
        covariance: d_step * about_middle * d_step.transpose(),
        middle,
        middle_sigma_m: about_middle[(2, 2)].max(0.0).sqrt(),
        rms_m: (sum / all.len() as f64).sqrt(),
        offset_spread_m: variances[0].sqrt(),
        slope_spread_rad: variances[1].sqrt(),
        boards: boards.collect(),
    })
}

/// Variance from board to board of offsets (`kind` 0) or slopes (1): squared residuals by their degrees of freedom,
/// less the part of the points' own scatter.
fn spread(rows: &[Row], inverse: &Matrix3<f64>, kind: usize) -> f64 {
    let of_kind = rows.iter().skip(kind).step_by(2);
    let (mut squares, mut freedom, mut scatter, mut count) = (0.0, 0.0, 0.0, 0.0);
    for row in of_kind {
        let leverage = (row.weight * row.d_plane * inverse * row.d_plane.transpose())[0];
        squares += row.value * row.value;
        freedom += 1.0 - leverage;
        scatter += row.scatter;
        count += 1.0;
    }
    (squares / f64::max(freedom, 1e-6) - scatter / f64::max(count, 1.0)).max(0.0)
}

/// Plane and covariance without each board in turn: the standard deviations of (θ₁, θ₂, offset) by the jackknife, with
/// tilts counted from `plane`.
#[must_use]
pub fn jackknife(boards: &[Vec<Vector3<f64>>], plane: &Plane) -> Option<Vector3<f64>> {
    let axes = sheet_tilt::axes(plane);
    let mut without = Vec::new();
    for k in 0..boards.len() {
        let others: Vec<Vec<Vector3<f64>>> =
            boards.iter().enumerate().filter(|(n, _)| *n != k).map(|(_, b)| b.clone()).collect();
        let fit = fit_points(&others).ok()?;
        let tilt = axes.transpose() * fit.plane.normal().into_inner();
        without.push(Vector3::new(tilt.x, tilt.y, fit.plane.offset()));
    }
    let count = without.len() as f64;
    let mean = without.iter().sum::<Vector3<f64>>() / count;
    let squares = without.iter().fold(Vector3::zeros(), |sum, x| sum + (x - mean).component_mul(&(x - mean)));
    Some((squares * ((count - 1.0) / count)).map(f64::sqrt))
}
