//! All features of a weld, summed: in stretches of time, so that a change inside the weld can be found.
//!
//! Features of one image share the robot's error and the stamp's; their covariance is that of the image as a
//! whole. Its level is measured on this weld with every unknown free, so a change of the calibration is not
//! noise. If neighbouring residuals are correlated by ρ, the information is less by (1 − ρ)/(1 + ρ).

use super::linearized::{Seam, linearized};
use super::plate_rows::plate_rows;
use super::row::{Row, SHARED};
use super::seam_fit::{SeamFit, in_chart};
use super::unknowns::Unknowns;
use super::weld_error::{LEAST_FEATURES, WeldError};
use super::weld_statistic::WeldStatistic;
use crate::parameters::{CALIBRATION, UNITS};
use crate::quadratic::Quadratic;
use crate::reference::{Part, Reference};
use nalgebra::{DMatrix, DVector, Vector2, Vector4};
use std::collections::HashSet;
use trueline_lsq::Loss;
use trueline_method::evaluate::placed_features::PlacedFeatures;
use trueline_method::solve::noise_scale::noise_factor;
use trueline_method::stripe::state::SURFACE_SIGMA_M;
use trueline_model::Plate;

/// A stretch of a weld.
#[derive(Clone, Debug)]
pub struct Chunk {
    /// When it begins, s after the first robot sample.
    pub from_s: f64,
    /// Evidence about θ, the seams, their bows (κ₂, κ₃ of each seam) and, of a weld with whole stripes, their plates, SI.
    pub evidence: Quadratic,
}

/// Evidence of a weld, whole and in stretches.
#[derive(Clone, Debug)]
pub struct Evidence {
    /// The whole.
    pub statistic: WeldStatistic,
    /// The stretches in order of time.
    pub chunks: Vec<Chunk>,
    /// Prior knowledge of the bows of its seams and of its plates, which is in none of the stretches.
    pub bow_prior: Quadratic,
}

/// Stretches of a weld: a change inside is dated to a sixteenth of it.
pub(crate) const CHUNKS: usize = 16;
/// Beyond this correlation residuals are not noise at all.
const MOST_CORRELATION: f64 = 0.95;

/// Sums a weld at the stored calibration and its own fitted seams, in the chart of its part.
///
/// # Errors
/// A seam with too few points left.
pub fn collected(
    of: &PlacedFeatures,
    fits: &[SeamFit],
    part: &Part,
    reference: &Reference,
) -> Result<Evidence, WeldError> {
    let charted: Vec<(Seam, Vector4<f64>)> =
        fits.iter().zip(&part.lines).map(|(fit, line)| in_chart(&fit.seam, line)).collect();
    let seams: Vec<Seam> = charted.iter().map(|(seam, _)| *seam).collect();
    let mut rows = rows(of, &seams, reference);
    let unknowns = Unknowns { seams: seams.len(), plates: rows.iter().any(|row| row.plate.is_some()) };
    let factors: Vec<f64> = fits.iter().map(|fit| fit.noise_factor.max(1e-6)).collect();
    let level = level(&mut rows, &seams, unknowns, &factors);
    for line in 0..seams.len() {
        let usable = rows.iter().filter(|row| row.line == line && row.counts() && row.weight > 0.0).count();
        if usable < LEAST_FEATURES {
            return Err(WeldError::TooFewFeatures { line: line as u32, usable, needed: LEAST_FEATURES });
        }
    }
    let shift = shift(&charted, unknowns);
    let share = information_share(level.correlation, rows.len()) / level.factor.powi(2);
    let chunks = chunks(&rows, unknowns, share, &shift);
    let bow_prior = bow_prior(&seams, unknowns);
    let mut whole = bow_prior.clone();
    chunks.iter().for_each(|chunk| whole.add(&chunk.evidence));
    let counted = rows.iter().filter(|row| row.counts()).count();
    let used = rows.iter().filter(|row| row.counts() && row.weight > 0.0).count();
    let statistic = WeldStatistic {
        evidence: whole.marginal(CALIBRATION + 4 * seams.len()),
        used,
        outliers: counted - used,
        noise_factor: level.factor,
        correlation: level.correlation,
        base_from_part: None,
    };
    Ok(Evidence { statistic, chunks, bow_prior })
}

/// Readings of the seams, by rising stamp. An image that shows both plates of a seam gives their stripes,
/// which contain the seam point. Other images give the seam point.
fn rows(of: &PlacedFeatures, seams: &[Seam], reference: &Reference) -> Vec<Row> {
    let mut rows = plate_rows(of, seams, reference.shape_origin_m);
    let striped: HashSet<(u64, usize)> = rows.iter().map(|row| (row.stamp_s.to_bits(), row.line)).collect();
    rows.extend(of.list.iter().filter_map(|feature| {
        let line = feature.line as usize;
        if striped.contains(&(feature.stamp_s.to_bits(), line)) {
            return None;
        }
        Some(Row::of_feature(feature, &linearized(of, feature, seams.get(line)?, reference.shape_origin_m)?))
    }));
    rows.sort_by(|a, b| a.stamp_s.total_cmp(&b.stamp_s));
    rows
}

/// A roll known to a turn has no information, and yet has an inverse.
const ROLL_SIGMA_RAD: f64 = 1.0;

/// Prior knowledge of bows and plates.
fn bow_prior(seams: &[Seam], unknowns: Unknowns) -> Quadratic {
    let mut prior = Quadratic::nothing(unknowns.size());
    for (k, seam) in seams.iter().enumerate() {
        for (column, bow_m) in (unknowns.bow(k)..).zip(seam.curvature.bow_m) {
            let known = seam.bow_sigma_m.powi(-2);
            prior.matrix[(column, column)] = known;
            prior.vector[column] = -known * bow_m;
        }
    }
    for roll in unknowns.rolls() {
        prior.matrix[(roll, roll)] = ROLL_SIGMA_RAD.powi(-2);
        for surface in roll + 1..=roll + Plate::SURFACE {
            prior.matrix[(surface, surface)] = SURFACE_SIGMA_M.powi(-2);
        }
    }
    prior
}

/// The seams' places in the part's chart: evidence is counted from there and not from the fitted seams.
fn shift(charted: &[(Seam, Vector4<f64>)], unknowns: Unknowns) -> DVector<f64> {
    let mut shift = DVector::zeros(unknowns.size());
    for (k, (_, step)) in charted.iter().enumerate() {
        shift.rows_mut(CALIBRATION + 4 * k, 4).copy_from(step);
    }
    shift
}

struct Level {
    factor: f64,
    correlation: f64,
}

/// The noise of a weld with everything free; sets the weights.
fn level(rows: &mut [Row], seams: &[Seam], unknowns: Unknowns, factors: &[f64]) -> Level {
    let loss = Loss::Tukey { scale: 8.0 };
    let first = factors.iter().copied().fold(0.0, f64::max);
    let mut level = Level { factor: first, correlation: 0.0 };
    for _ in 0..3 {
        let mut all = bow_prior(seams, unknowns);
        // θ is as good as free: a hundred units are 10 ms, 5°, 10 mm.
        for (k, unit) in UNITS.iter().take(CALIBRATION).enumerate() {
            all.matrix[(k, k)] += (100.0 * unit).powi(-2);
        }
        all.add(&summed(rows, unknowns, level.factor.powi(-2)));
        let estimate = all.matrix.clone().cholesky().map(|root| root.solve(&all.vector));
        let whitened: Vec<Option<Vector2<f64>>> =
            rows.iter().map(|row| row.left_over(unknowns, estimate.as_ref())).collect();
        let squared: Vec<f64> = whitened.iter().flatten().map(Vector2::norm_squared).collect();
        level.factor = noise_factor(&squared).max(1e-3);
        for (row, left) in rows.iter_mut().zip(&whitened) {
            row.weight = left.map_or(0.0, |r| loss.weight(r.norm_squared() / level.factor.powi(2)));
        }
        level.correlation = correlation(rows, &whitened);
    }
    level
}

/// Correlation of the residuals of a seam, or of one of its plates, from one image to the next; outliers do not count as
/// neighbours.
fn correlation(rows: &[Row], whitened: &[Option<Vector2<f64>>]) -> f64 {
    let (mut product, mut power) = (0.0, 0.0);
    let mut before: Vec<Option<Vector2<f64>>> = Vec::new();
    for (row, left) in rows.iter().zip(whitened) {
        let Some(left) = left.filter(|_| row.weight > 0.5) else { continue };
        let own = 3 * row.line + row.plate.map_or(0, |plate| 1 + plate);
        if before.len() <= own {
            before.resize(own + 1, None);
        }
        if let Some(last) = before[own].replace(left) {
            product += last.dot(&left);
            power += 0.5 * (last.norm_squared() + left.norm_squared());
        }
    }
    if power > 0.0 { product / power } else { 0.0 }
}

/// How much of the information is left where neighbours are alike: (1 − ρ)/(1 + ρ) of a first-order process. Chance alone
/// makes ρ as large as 2/√(2n).
fn information_share(correlation: f64, features: usize) -> f64 {
    let chance = 2.0 / (2.0 * features as f64).sqrt();
    if correlation <= chance {
        return 1.0;
    }
    let rho = correlation.min(MOST_CORRELATION);
    (1.0 - rho) / (1.0 + rho)
}

fn chunks(rows: &[Row], unknowns: Unknowns, share: f64, shift: &DVector<f64>) -> Vec<Chunk> {
    let first = rows.first().map_or(0.0, |row| row.stamp_s);
    let last = rows.last().map_or(0.0, |row| row.stamp_s);
    let length = (last - first).max(1e-9) / CHUNKS as f64;
    (0..CHUNKS)
        .map(|k| {
            let from_s = first + k as f64 * length;
            let begin = rows.partition_point(|row| k > 0 && row.stamp_s < from_s);
            let end = rows.partition_point(|row| k + 1 == CHUNKS || row.stamp_s < from_s + length);
            let mut evidence = summed(&rows[begin.min(end)..end], unknowns, share);
            let moved = &evidence.matrix * shift;
            evidence.vector += moved;
            Chunk { from_s, evidence }
        })
        .collect()
}

/// Sums rows image by image, times a share.
fn summed(rows: &[Row], unknowns: Unknowns, share: f64) -> Quadratic {
    let mut sum = Quadratic::nothing(unknowns.size());
    for image in rows.chunk_by(|a, b| a.stamp_s.to_bits() == b.stamp_s.to_bits()) {
        let used: Vec<&Row> = image.iter().filter(|row| row.weight > 0.0).collect();
        if !used.is_empty() {
            add_image(&mut sum, &used, unknowns);
        }
    }
    sum.matrix *= share;
    sum.vector *= share;
    sum
}

fn add_image(sum: &mut Quadratic, rows: &[&Row], unknowns: Unknowns) {
    let n = 2 * rows.len();
    let mut covariance = DMatrix::zeros(n, n);
    let mut shared = DMatrix::zeros(n, SHARED);
    let mut jacobian = DMatrix::zeros(n, unknowns.size());
    let mut residual = DVector::zeros(n);
    for (k, row) in rows.iter().enumerate() {
        covariance.view_mut((2 * k, 2 * k), (2, 2)).copy_from(&(row.covariance / row.weight));
        // A row of little weight has large errors, of any source.
        shared.view_mut((2 * k, 0), (2, SHARED)).copy_from(&(row.shared / row.weight.sqrt()));
        residual.rows_mut(2 * k, 2).copy_from(&row.residual);
        for (local, place) in row.columns(unknowns) {
            jacobian.view_mut((2 * k, place), (2, 1)).copy_from(&row.jacobian.column(local));
        }
    }
    covariance += &shared * shared.transpose();
    let Some(root) = covariance.cholesky() else { return };
    let weighted = root.solve(&jacobian);
    sum.matrix += jacobian.transpose() * &weighted;
    // r = J (stored − true) + noise, and θ is true − stored.
    sum.vector -= weighted.transpose() * residual;
}
