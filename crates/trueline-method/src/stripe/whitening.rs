//! Expected residuals of a frame, and outlier plates.
//!
//! Σ = D + σ_r² G Gᵀ + σ_ω² T Tᵀ + σ_t² ρ̇ ρ̇ᵀ over the residuals of a frame: the own noise of each point, and the shared errors of the robot's
//! position, its attitude and the stamp's jitter. A plate whose stripe is off (a reflection, a tack weld) gets 1/w times its own noise, with w of a
//! redescending loss. Beyond the reach of the loss the plate is left out of the frame.

use crate::input::noise_levels::NoiseLevels;
use crate::input::observations::Observations;
use crate::order_statistics::median;
use crate::solve::noise_scale::noise_factor;
use crate::stripe::blocks::{BLOCKS, add_to_block, block, pair_of_block, rows_of};
use crate::stripe::frame_residual::{
    EDGE_ROW, FrameResidual, ROWS, linearize_frame, placement, residual_of_frame,
};
use crate::stripe::frames::{Sight, StripeFrame};
use crate::stripe::outlier_counts::Rejected;
use crate::stripe::state::StripeState;
use crate::stripe::target::EDGE;
use crate::stripe::weighed_frame::{PoseError, WeighedFrame};
use nalgebra::{Matrix2, SMatrix, SVector, Vector2};
use trueline_lsq::Loss;

/// Standard deviations of the noise that all residuals of a frame share, and the factor on all noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SharedNoise {
    /// Robot position and stamp, and the factor on all noise.
    pub levels: NoiseLevels,
    /// Robot attitude about each axis, rad.
    pub robot_sigma_rad: f64,
}

/// Frames with their weights.
pub struct Weighed {
    /// The frames used.
    pub frames: Vec<WeighedFrame>,
    /// Rejected measurements.
    pub rejected: Rejected,
    /// The estimated noise factor.
    pub factor: f64,
}

/// Median of χ²₁.
const MEDIAN_OF_ONE: f64 = 0.454_94;
/// Least noise as a fraction of the expected noise: a perfect simulation has none.
const LEAST_FACTOR: f64 = 1e-3;

/// Weighs every frame that can be placed at a state: first by the factor on all noise, then plate by plate.
#[must_use]
pub fn weigh(
    observations: &Observations,
    frames: &[StripeFrame],
    at: &StripeState,
    shared: &SharedNoise,
    loss: &Loss,
) -> Weighed {
    let mut rejected = Rejected::default();
    let mut placed: Vec<(&StripeFrame, FrameResidual)> = Vec::with_capacity(frames.len());
    for frame in frames {
        let Some(placement) = placement(observations, frame.stamp_s, at) else { continue };
        match linearize_frame(observations, frame, at, &placement) {
            Some((parts, _)) => placed.push((frame, parts)),
            None => rejected.counts.along_sheet += frame.stripes(),
        }
    }
    let expected = SharedNoise { levels: NoiseLevels { factor: 1.0, ..shared.levels }, ..*shared };
    let squared: Vec<[Option<f64>; BLOCKS]> = placed
        .iter()
        .map(|(frame, parts)| squares(frame, parts, &covariance(frame, parts, &expected, 1.0), 1.0))
        .collect();
    let of_plates: Vec<f64> = squared.iter().flat_map(|[one, other, _]| [*one, *other]).flatten().collect();
    let factor = noise_factor(&of_plates).max(LEAST_FACTOR);
    let rougher = edge_factor(&edges(&placed, &expected), factor);
    let scaled = SharedNoise { levels: NoiseLevels { factor, ..shared.levels }, ..*shared };
    let mut all = Weighed { frames: Vec::with_capacity(placed.len()), rejected, factor };
    for (frame, parts) in &placed {
        let covariance = covariance(frame, parts, &scaled, rougher);
        let squared = squares(frame, parts, &covariance, rougher);
        let weights = squared.map(|squared| squared.map_or(0.0, |squared| loss.weight(squared)));
        let kept: [Option<bool>; BLOCKS] = std::array::from_fn(|k| squared[k].map(|_| weights[k] > 0.0));
        all.rejected.add((frame.joint, frame.stamp_s), &kept[..EDGE], kept[EDGE]);
        let own = [0, 1, 2].map(|block| Some(own(frame, parts, block, rougher)? * factor.powi(2)));
        if let Some((whitener, rows)) = whitener(&own, &covariance, weights) {
            let pose_error = pose_error(observations, frame, (parts, &whitener), at, &scaled);
            let pose_error = pose_error.unwrap_or(PoseError::NONE);
            all.frames.push(WeighedFrame { frame: **frame, whitener, rows, pose_error });
        }
    }
    all
}

/// The residual of an edge point and both parts of its expected variance.
#[derive(Clone, Copy, Debug)]
struct EdgePoint {
    /// Squared, m².
    residual_m2: f64,
    /// Own variance of the point, m².
    own_m2: f64,
    /// Variance from robot and stamp, m².
    shared_m2: f64,
}

fn edges(placed: &[(&StripeFrame, FrameResidual)], expected: &SharedNoise) -> Vec<EdgePoint> {
    let of = |(frame, parts): &(&StripeFrame, FrameResidual)| {
        let own_m2 = own(frame, parts, EDGE, 1.0)?.m11;
        let all_m2 = block(&covariance(frame, parts, expected, 1.0), EDGE).m11;
        let residual_m2 = parts.residual[EDGE_ROW].powi(2);
        Some(EdgePoint { residual_m2, own_m2, shared_m2: all_m2 - own_m2 })
    };
    placed.iter().filter_map(of).collect()
}

/// Maximum steps to the roughness of an edge, which is known to some percent at best.
const ROUGHNESS_STEPS: usize = 50;
const ROUGHNESS_FOUND: f64 = 1e-3;

/// Ratio of an edge's roughness to the stated noise of its points, beyond the common noise factor. Burrs are on edges and not on plates, and do not
/// depend on robot and stamp. At least 1.
fn edge_factor(edges: &[EdgePoint], factor: f64) -> f64 {
    let mut squared = 1.0;
    for _ in 0..ROUGHNESS_STEPS {
        let expected_m2 = |edge: &EdgePoint| edge.own_m2 * squared + edge.shared_m2;
        let median = median(edges.iter().map(|edge| edge.residual_m2 / expected_m2(edge))).unwrap_or(0.0);
        let ratio = median / MEDIAN_OF_ONE / factor.powi(2);
        let before = squared;
        squared = (squared * ratio).max(1.0);
        if (squared / before - 1.0).abs() < ROUGHNESS_FOUND {
            break;
        }
    }
    squared.sqrt()
}

/// Own covariance of the rows of a plate, of the edge point or of the seam point. `None` if it is missing.
fn own(frame: &StripeFrame, parts: &FrameResidual, block: usize, rougher: f64) -> Option<Matrix2<f64>> {
    match (&frame.sight, block) {
        (Sight::Seam(seam), 0) => Some(seam.covariance),
        (Sight::Seam(_), _) => None,
        (Sight::Stripes(_), EDGE) => {
            let point = frame.edge.filter(|_| parts.has_edge)?;
            let across = parts.d_reported.row(EDGE_ROW);
            let variance = (across * point.covariance * across.transpose()).x * rougher.powi(2);
            Some(Matrix2::new(variance, 0.0, 0.0, 0.0))
        }
        (Sight::Stripes(stripes), plate) => stripes[plate]
            .map(|[a, b]| Matrix2::from_diagonal(&Vector2::new(a.sigma_m.powi(2), b.sigma_m.powi(2)))),
    }
}

fn covariance(
    frame: &StripeFrame,
    parts: &FrameResidual,
    shared: &SharedNoise,
    rougher: f64,
) -> SMatrix<f64, ROWS, ROWS> {
    let NoiseLevels { robot_sigma_m, stamp_sigma_s, factor } = shared.levels;
    let rate = parts.d_time_offset;
    let mut all = parts.d_displacement * parts.d_displacement.transpose() * robot_sigma_m.powi(2)
        + parts.d_turn * parts.d_turn.transpose() * shared.robot_sigma_rad.powi(2)
        + rate * rate.transpose() * stamp_sigma_s.powi(2);
    for block in 0..BLOCKS {
        if let Some(own) = own(frame, parts, block, rougher) {
            add_to_block(&mut all, block, &own);
        }
    }
    all * factor.powi(2)
}

/// Expected shared errors of a frame given its residuals: σ² Gᵀ Σ⁻¹ ρ of each. `None` if the frame cannot be placed there.
fn pose_error(
    observations: &Observations,
    frame: &StripeFrame,
    (parts, whitener): (&FrameResidual, &SMatrix<f64, ROWS, ROWS>),
    at: &StripeState,
    shared: &SharedNoise,
) -> Option<PoseError> {
    let NoiseLevels { robot_sigma_m, stamp_sigma_s, factor } = shared.levels;
    let over_covariance = whitener.transpose() * (whitener * parts.residual);
    let variance = |sigma: f64| (factor * sigma).powi(2);
    let mut error = PoseError {
        shift_m: parts.d_displacement.transpose() * over_covariance * variance(robot_sigma_m),
        turn_rad: parts.d_turn.transpose() * over_covariance * variance(shared.robot_sigma_rad),
        late_s: parts.d_time_offset.dot(&over_covariance) * variance(stamp_sigma_s),
        in_residual: SVector::zeros(),
    };
    let placement = error.placement(observations, frame.stamp_s, at)?;
    error.in_residual = parts.residual - residual_of_frame(observations, frame, at, &placement)?;
    Some(error)
}

/// Squared residual of each plate (χ²₂) and of the edge point (χ²₁), relative to its expected variance.
fn squares(
    frame: &StripeFrame,
    parts: &FrameResidual,
    covariance: &SMatrix<f64, ROWS, ROWS>,
    rougher: f64,
) -> [Option<f64>; BLOCKS] {
    [0, 1, 2].map(|number| {
        own(frame, parts, number, rougher)?;
        let residual = pair_of_block(&parts.residual, number);
        Some(residual.dot(&(block(covariance, number).try_inverse()? * residual)))
    })
}

/// W over the rows used, and their number. `None` if there are none.
fn whitener(
    own: &[Option<Matrix2<f64>>; BLOCKS],
    covariance: &SMatrix<f64, ROWS, ROWS>,
    weights: [f64; BLOCKS],
) -> Option<(SMatrix<f64, ROWS, ROWS>, usize)> {
    let mut inflated = *covariance;
    let mut counts = [false; ROWS];
    for (block, weight) in weights.into_iter().enumerate() {
        if let (Some(own), true) = (own[block], weight > 0.0) {
            add_to_block(&mut inflated, block, &(own * (1.0 / weight - 1.0)));
            counts[rows_of(block)].fill(true);
        }
    }
    let left_out = |i: usize, j: usize| !(counts[i] && counts[j]);
    // A dropped row is uncorrelated with the others.
    let kept = SMatrix::<f64, ROWS, ROWS>::from_fn(|i, j| match left_out(i, j) {
        true => f64::from(u8::from(i == j)),
        false => inflated[(i, j)],
    });
    let inverse = kept.cholesky()?.l().solve_lower_triangular(&SMatrix::<f64, ROWS, ROWS>::identity())?;
    let whitener = SMatrix::from_fn(|i: usize, j: usize| if left_out(i, j) { 0.0 } else { inverse[(i, j)] });
    let rows = counts.into_iter().filter(|counts| *counts).count();
    (rows > 0).then_some((whitener, rows))
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, Matrix5, Vector5};

    /// Burrs of twice the stated noise, beside shared noise with a varying share in every frame. The roughness is found whatever the share is.
    #[test]
    fn edges_are_as_rough_as_their_own_part_is() {
        let normal = |k: usize| {
            // Quantiles of χ²₁ in another order, by the square of a normal number's: √2 erf⁻¹ by bisection.
            let wanted = (((k * 611) % 2003) as f64 + 0.5) / 2003.0;
            let (mut low, mut high) = (0.0_f64, 6.0_f64);
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                let steps = 200;
                let width = middle / f64::from(steps);
                let density = |x: f64| (-0.5 * x * x).exp() * (2.0 / std::f64::consts::PI).sqrt();
                let inside: f64 = (0..steps).map(|s| density((f64::from(s) + 0.5) * width) * width).sum();
                if inside < wanted { low = middle } else { high = middle }
            }
            low
        };
        for (roughness, factor) in [(2.0_f64, 1.0_f64), (1.0, 1.0), (3.0, 1.7)] {
            let edges: Vec<EdgePoint> = (0..2003)
                .map(|k| {
                    let (own_m2, shared_m2) = (1.0 + (k % 3) as f64, [0.0, 1.0, 4.0][k % 5 % 3]);
                    let variance = factor.powi(2) * (own_m2 * roughness.powi(2) + shared_m2);
                    EdgePoint { residual_m2: normal(k).powi(2) * variance, own_m2, shared_m2 }
                })
                .collect();
            let found = edge_factor(&edges, factor);
            // The median of 2003 evenly drawn quantiles is known to some thousandths.
            assert!((found / roughness - 1.0).abs() < 0.02, "{roughness} {factor}: {found}");
        }
    }

    /// Whitens the expected covariance of the used rows, with the noise of each block over its weight. The other rows are zero.
    #[test]
    fn rows_that_count_are_whitened_whatever_is_left_out() {
        let (a, b) = (Vector5::new(0.5, 0.4, -0.3, -0.6, 0.4), Vector5::new(0.2, -0.5, 0.1, 0.7, 0.3));
        let mut covariance: Matrix5<f64> = a * a.transpose() + b * b.transpose();
        let own = [
            Some(Matrix2::new(0.5, 0.1, 0.1, 0.6)),
            Some(Matrix2::new(0.9, 0.0, 0.0, 0.2)),
            Some(Matrix2::new(0.7, 0.0, 0.0, 0.0)),
        ];
        (0..BLOCKS).for_each(|k| add_to_block(&mut covariance, k, &own[k].unwrap()));
        let cases = [
            ([1.0, 1.0, 1.0], vec![0, 1, 2, 3, 4]),
            ([0.3, 1.0, 0.0], vec![0, 1, 2, 3]),
            ([0.0, 0.5, 0.8], vec![2, 3, 4]),
            ([0.7, 0.0, 0.1], vec![0, 1, 4]),
            ([0.0, 0.0, 1.0], vec![4]),
        ];
        for (weights, rows) in cases {
            let (whitener, count) = whitener(&own, &covariance, weights).unwrap();
            assert_eq!(count, rows.len());
            let mut inflated = covariance;
            for (k, weight) in weights.iter().enumerate().filter(|(_, weight)| **weight > 0.0) {
                add_to_block(&mut inflated, k, &(own[k].unwrap() * (1.0 / weight - 1.0)));
            }
            let kept = DMatrix::from_fn(count, count, |i, j| inflated[(rows[i], rows[j])]);
            let inverse = kept.try_inverse().unwrap();
            let precision = whitener.transpose() * whitener;
            for (i, j) in (0..ROWS).flat_map(|i| (0..ROWS).map(move |j| (i, j))) {
                let place = |row: usize| rows.iter().position(|r| *r == row);
                let expected = place(i).zip(place(j)).map_or(0.0, |at| inverse[at]);
                // Inverses of a few rows with entries of order one.
                assert!((precision[(i, j)] - expected).abs() < 1e-12, "{weights:?} {i} {j}");
                assert_eq!(whitener[(i, j)] == 0.0, place(i).is_none() || place(j).is_none() || j > i);
            }
        }
        assert!(whitener(&own, &covariance, [0.0; BLOCKS]).is_none());
    }
}
