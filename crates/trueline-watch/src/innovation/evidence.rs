//! All features of a weld, summed: in stretches of time, so that a change inside the weld can be found.
//!
//! Features of one image share the robot's error and the stamp's; their covariance is that of the image as a whole. Its
//! level is measured on this weld with every unknown free, so that a change of the calibration is no noise; where
//! neighbouring residuals are alike, the information is less by (1 − ρ)/(1 + ρ).

use super::linearized::{BOW, LOCAL, Linearized, SEAM, Seam, linearized};
use super::seam_fit::{LEAST_FEATURES, SeamFit, bow_sigma_m, in_chart};
use super::weld_error::WeldError;
use super::weld_statistic::WeldStatistic;
use crate::parameters::{CALIBRATION, UNITS};
use crate::quadratic::Quadratic;
use crate::reference::{Part, Reference};
use nalgebra::{DMatrix, DVector, Vector2, Vector4};
use trueline_lsq::Loss;
use trueline_method::evaluate::placed_features::PlacedFeatures;
use trueline_method::solve::noise_scale::noise_factor;

/// A stretch of a weld.
#[derive(Clone, Debug)]
pub struct Chunk {
    /// When it begins, s after the first robot sample.
    pub from_s: f64,
    /// Evidence about θ, the seams and their bows (κ₂, κ₃ of each seam, last), SI.
    pub evidence: Quadratic,
}

/// What a weld says, whole and in stretches.
#[derive(Clone, Debug)]
pub struct Evidence {
    /// The whole.
    pub statistic: WeldStatistic,
    /// The stretches in order of time.
    pub chunks: Vec<Chunk>,
    /// What is known of the bows of its seams, which is in none of the stretches.
    pub bow_prior: Quadratic,
}

/// Stretches of a weld: a change inside is dated to a sixteenth of it.
pub(crate) const CHUNKS: usize = 16;
/// Beyond this correlation residuals are no noise at all.
const MOST_CORRELATION: f64 = 0.95;

/// One feature ready to be summed.
struct Row {
    stamp_s: f64,
    frame: u32,
    line: usize,
    linearized: Linearized,
    weight: f64,
}

/// Sums a weld at the stored calibration and its own fitted seams, in the chart of its part.
///
/// # Errors
/// A seam of which too little is left.
pub fn collected(
    of: &PlacedFeatures,
    fits: &[SeamFit],
    part: &Part,
    reference: &Reference,
) -> Result<Evidence, WeldError> {
    let charted: Vec<(Seam, Vector4<f64>)> =
        fits.iter().zip(&part.lines).map(|(fit, line)| in_chart(&fit.seam, line)).collect();
    let seams: Vec<Seam> = charted.iter().map(|(seam, _)| *seam).collect();
    let mut rows: Vec<Row> = of
        .list
        .iter()
        .filter_map(|feature| {
            let line = feature.line as usize;
            let linearized = linearized(of, feature, seams.get(line)?, reference.shape_origin_m)?;
            Some(Row { stamp_s: feature.stamp_s, frame: feature.frame, line, linearized, weight: 1.0 })
        })
        .collect();
    let factors: Vec<f64> = fits.iter().map(|fit| fit.noise_factor.max(1e-6)).collect();
    let level = level(&mut rows, &seams, &factors);
    for line in 0..seams.len() {
        let usable = rows.iter().filter(|row| row.line == line && row.weight > 0.0).count();
        if usable < LEAST_FEATURES {
            return Err(WeldError::TooFewFeatures { line: line as u32, usable, needed: LEAST_FEATURES });
        }
    }
    let shift = shift(&charted, seams.len());
    let share = information_share(level.correlation, rows.len()) / level.factor.powi(2);
    let chunks = chunks(&rows, seams.len(), share, &shift);
    let bow_prior = bow_prior(&seams);
    let mut whole = bow_prior.clone();
    chunks.iter().for_each(|chunk| whole.add(&chunk.evidence));
    let used = rows.iter().filter(|row| row.weight > 0.0).count();
    let statistic = WeldStatistic {
        evidence: whole.marginal(CALIBRATION + 4 * seams.len()),
        used,
        outliers: rows.len() - used,
        noise_factor: level.factor,
        correlation: level.correlation,
    };
    Ok(Evidence { statistic, chunks, bow_prior })
}

/// What is known of the bows before any feature.
fn bow_prior(seams: &[Seam]) -> Quadratic {
    let mut prior = Quadratic::nothing(size(seams.len()));
    for (k, seam) in seams.iter().enumerate() {
        for column in bow(k, seams.len())..bow(k, seams.len()) + 2 {
            prior.matrix[(column, column)] = bow_sigma_m(seam.half_length_m).powi(-2);
        }
    }
    prior
}

const fn size(seams: usize) -> usize {
    CALIBRATION + 6 * seams
}

const fn bow(seam: usize, seams: usize) -> usize {
    CALIBRATION + 4 * seams + 2 * seam
}

/// Where a local column of a seam's feature lies among all.
const fn place(local: usize, seam: usize, seams: usize) -> usize {
    if local < SEAM {
        local
    } else if local < BOW {
        CALIBRATION + 4 * seam + local - SEAM
    } else {
        bow(seam, seams) + local - BOW
    }
}

/// The seams' places in the part's chart: evidence is counted from there and not from the fitted seams.
fn shift(charted: &[(Seam, Vector4<f64>)], seams: usize) -> DVector<f64> {
    let mut shift = DVector::zeros(size(seams));
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
fn level(rows: &mut [Row], seams: &[Seam], factors: &[f64]) -> Level {
    let loss = Loss::Tukey { scale: 8.0 };
    let first = factors.iter().copied().fold(0.0, f64::max);
    let mut level = Level { factor: first, correlation: 0.0 };
    for _ in 0..3 {
        let mut all = bow_prior(seams);
        // θ is as good as free: a hundred units are 10 ms, 5°, 10 mm.
        for (k, unit) in UNITS.iter().take(CALIBRATION).enumerate() {
            all.matrix[(k, k)] += (100.0 * unit).powi(-2);
        }
        all.add(&summed(rows, seams.len(), level.factor.powi(-2)));
        let estimate = all.matrix.clone().cholesky().map(|root| root.solve(&all.vector));
        let whitened: Vec<Option<Vector2<f64>>> =
            rows.iter().map(|row| left_over(row, seams.len(), estimate.as_ref())).collect();
        let squared: Vec<f64> = whitened.iter().flatten().map(Vector2::norm_squared).collect();
        level.factor = noise_factor(&squared).max(1e-3);
        for (row, left) in rows.iter_mut().zip(&whitened) {
            row.weight = left.map_or(0.0, |r| loss.weight(r.norm_squared() / level.factor.powi(2)));
        }
        level.correlation = correlation(rows, &whitened);
    }
    level
}

/// A feature's whitened residual at the estimate of everything.
fn left_over(row: &Row, seams: usize, estimate: Option<&DVector<f64>>) -> Option<Vector2<f64>> {
    let one = &row.linearized;
    let mut residual = one.residual;
    if let Some(x) = estimate {
        for local in 0..LOCAL {
            residual += one.jacobian.column(local) * x[place(local, row.line, seams)];
        }
    }
    Some(one.total_covariance().cholesky()?.l().try_inverse()? * residual)
}

/// Correlation of a seam's residuals from one feature to its next; outliers are no neighbours.
fn correlation(rows: &[Row], whitened: &[Option<Vector2<f64>>]) -> f64 {
    let (mut product, mut power) = (0.0, 0.0);
    let mut before: Vec<Option<Vector2<f64>>> = Vec::new();
    for (row, left) in rows.iter().zip(whitened) {
        let Some(left) = left.filter(|_| row.weight > 0.5) else { continue };
        if before.len() <= row.line {
            before.resize(row.line + 1, None);
        }
        if let Some(last) = before[row.line].replace(left) {
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

fn chunks(rows: &[Row], seams: usize, share: f64, shift: &DVector<f64>) -> Vec<Chunk> {
    let first = rows.first().map_or(0.0, |row| row.stamp_s);
    let last = rows.last().map_or(0.0, |row| row.stamp_s);
    let length = (last - first).max(1e-9) / CHUNKS as f64;
    (0..CHUNKS)
        .map(|k| {
            let from_s = first + k as f64 * length;
            let begin = rows.partition_point(|row| k > 0 && row.stamp_s < from_s);
            let end = rows.partition_point(|row| k + 1 == CHUNKS || row.stamp_s < from_s + length);
            let mut evidence = summed(&rows[begin.min(end)..end], seams, share);
            let moved = &evidence.matrix * shift;
            evidence.vector += moved;
            Chunk { from_s, evidence }
        })
        .collect()
}

/// Sums features image by image, times a share.
fn summed(rows: &[Row], seams: usize, share: f64) -> Quadratic {
    let mut sum = Quadratic::nothing(size(seams));
    for image in rows.chunk_by(|a, b| a.frame == b.frame) {
        let used: Vec<&Row> = image.iter().filter(|row| row.weight > 0.0).collect();
        if !used.is_empty() {
            add_image(&mut sum, &used, seams);
        }
    }
    sum.matrix *= share;
    sum.vector *= share;
    sum
}

fn add_image(sum: &mut Quadratic, rows: &[&Row], seams: usize) {
    let n = 2 * rows.len();
    let mut covariance = DMatrix::zeros(n, n);
    let mut shared = DMatrix::zeros(n, 4);
    let mut jacobian = DMatrix::zeros(n, size(seams));
    let mut residual = DVector::zeros(n);
    for (k, row) in rows.iter().enumerate() {
        let one = &row.linearized;
        covariance.view_mut((2 * k, 2 * k), (2, 2)).copy_from(&(one.covariance / row.weight));
        // A feature of little weight is one of large errors, whoever made them.
        shared.view_mut((2 * k, 0), (2, 4)).copy_from(&(one.shared / row.weight.sqrt()));
        residual.rows_mut(2 * k, 2).copy_from(&one.residual);
        for local in 0..LOCAL {
            jacobian
                .view_mut((2 * k, place(local, row.line, seams)), (2, 1))
                .copy_from(&one.jacobian.column(local));
        }
    }
    covariance += &shared * shared.transpose();
    let Some(root) = covariance.cholesky() else { return };
    let weighted = root.solve(&jacobian);
    sum.matrix += jacobian.transpose() * &weighted;
    // r = J (stored − true) + noise, and θ is true − stored.
    sum.vector -= weighted.transpose() * residual;
}
