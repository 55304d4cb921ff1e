//! Rate of false alarms of the detector: the probability of an alarm without a change, by importance sampling.
//!
//! After a long history the statistic of a window is |Σ u/√k|² with u ~ N(0, I) a piece's score about one kind of change,
//! whitened. An alarm is far too rare to wait for. So productions are drawn with a random change in a random window of a
//! random kind, u ~ N(0, (1 + g) I) there. Each is weighed by the ratio of its likelihood without the change to that under
//! the mixture of all windows and kinds. The estimate is unbiased for any g. Plain draws are counted at a lower threshold
//! as well, where both ways can be compared.
//!
//! `cargo run --release -p trueline-studies -- false_alarms [DRAWS]`
#![allow(clippy::unwrap_used, reason = "a study fails by panicking")]

use crate::arguments::number;
use nalgebra::{DMatrix, DVector};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use trueline_sim::production::{Layout, piece};
use trueline_watch::detect::change::VISIBLE;
use trueline_watch::detect::history::ALARM_P_LOG10;
use trueline_watch::detect::tail::log10_probability;
use trueline_watch::detect::windows::WINDOWS;
use trueline_watch::innovation::{Weld, shape_origin_m};
use trueline_watch::parameters::Kind;
use trueline_watch::{Part, PieceInformation, Reference, Scatter};

/// Pieces after which an alarm counts.
const ENDS: usize = 128;
/// Pieces before them, for the longest window.
const BEFORE: usize = 256;

/// A kind: its whitened scores from those of a piece, and the piece's score from a whitened change.
struct Scores {
    whiten: DMatrix<f64>,
    change: DMatrix<f64>,
}

struct Production {
    root: DMatrix<f64>,
    kinds: Vec<Scores>,
}

impl Production {
    fn of(layout: Layout) -> Self {
        let production = layout.production();
        let first = piece(&production, 0, 1);
        let guess = first.truth.as_ref().unwrap().parameters;
        let reference = Reference::of_value(guess, shape_origin_m(&first, &guess).unwrap());
        let weld = Weld::of(&first, &reference).unwrap();
        let part = Part { lines: weld.seams() };
        let statistic = weld.evidence(&part, &reference).unwrap().statistic;
        let map = part.seams_from_placement();
        let scatter = production.scatter;
        let place = DVector::from_fn(6, |k, _| {
            if k < 3 { scatter.translation_m.powi(2) } else { scatter.rotation_rad.powi(2) }
        });
        // The scatter of the fixture, and of each seam.
        let mut covariance = &map * DMatrix::from_diagonal(&place) * map.transpose();
        for k in 0..covariance.nrows() {
            covariance[(k, k)] += if k % 4 >= 2 { scatter.seam_m.powi(2) } else { 1e-10 };
        }
        let known = Scatter { covariance, pieces: 1_000_000, dispersion: [1.0; 4] };
        let information = PieceInformation::of(&statistic, 0, &part, Some(&known)).evidence.matrix;
        let eigen = information.clone().symmetric_eigen();
        let root =
            &eigen.eigenvectors * DMatrix::from_diagonal(&eigen.eigenvalues.map(|v| v.max(0.0).sqrt()));
        let kinds = Kind::ALL.iter().map(|kind| scores(&information, *kind)).collect();
        Self { root, kinds }
    }

    /// Whitened scores of every piece and kind; a change of one kind inside of one window, or none.
    fn draw(
        &self,
        changed: Option<(usize, usize, usize, f64)>,
        random: &mut ChaCha8Rng,
    ) -> Vec<Vec<DVector<f64>>> {
        let mut normal = |_: usize, _: usize| -> f64 { StandardNormal.sample(&mut *random) };
        let shift = changed.map(|(kind, end, length, gain)| {
            let change = &self.kinds[kind].change;
            let whitened = DVector::from_fn(change.ncols(), &mut normal) * (gain / length as f64).sqrt();
            (end - length..end, change * whitened)
        });
        (0..BEFORE + ENDS)
            .map(|k| {
                let mut score = &self.root * DVector::from_fn(self.root.ncols(), &mut normal);
                if let Some((window, shift)) = &shift
                    && window.contains(&k)
                {
                    score += shift;
                }
                self.kinds.iter().map(|kind| &kind.whiten * &score).collect()
            })
            .collect()
    }

    /// Sum of squares of every window of every kind.
    fn statistics(&self, pieces: &[Vec<DVector<f64>>]) -> Vec<(usize, f64)> {
        let mut found = Vec::new();
        for kind in 0..self.kinds.len() {
            let mut sums = vec![DVector::zeros(self.kinds[kind].whiten.nrows())];
            for piece in pieces {
                sums.push(sums.last().unwrap() + &piece[kind]);
            }
            for end in BEFORE + 1..=pieces.len() {
                for length in WINDOWS {
                    found.push((kind, (&sums[end] - &sums[end - length]).norm_squared() / length as f64));
                }
            }
        }
        found
    }
}

fn scores(information: &DMatrix<f64>, kind: Kind) -> Scores {
    let columns: Vec<usize> = kind.columns().collect();
    let rows = information.select_rows(&columns);
    let eigen = rows.select_columns(&columns).symmetric_eigen();
    let shown: Vec<usize> = (0..columns.len()).filter(|k| eigen.eigenvalues[*k] > VISIBLE).collect();
    let select = DMatrix::from_fn(columns.len(), information.nrows(), |i, j| f64::from(columns[i] == j));
    let unit = DMatrix::from_fn(shown.len(), columns.len(), |i, j| {
        eigen.eigenvectors[(j, shown[i])] / eigen.eigenvalues[shown[i]].sqrt()
    });
    let whiten = &unit * select;
    Scores { change: information * whiten.transpose(), whiten }
}

pub(crate) fn run(arguments: &[String]) -> Result<(), String> {
    let draws: usize = number(arguments, 0, 2000)?;
    let production = Production::of(Layout::BoxAngles);
    let dimensions: Vec<usize> = production.kinds.iter().map(|kind| kind.whiten.nrows()).collect();
    println!("dimensions by kind: {dimensions:?}");
    let mut random = ChaCha8Rng::seed_from_u64(1);
    // Places of the mixture's windows: their mean square is then that of an alarm.
    let gain = |kind: usize| (24.0 + 2.0 * dimensions[kind] as f64) / dimensions[kind] as f64;
    for threshold in [-3.5, ALARM_P_LOG10] {
        let (mut sum, mut squares) = (0.0, 0.0);
        for _ in 0..draws {
            let kind = random.random_range(0..dimensions.len());
            let length = WINDOWS[random.random_range(0..WINDOWS.len())];
            let end = BEFORE + 1 + random.random_range(0..ENDS);
            let pieces = production.draw(Some((kind, end, length, gain(kind))), &mut random);
            let statistics = production.statistics(&pieces);
            let alarm =
                statistics.iter().any(|(k, q)| log10_probability(*q, dimensions[*k], 1e7) <= threshold);
            if alarm {
                let ratio = |(k, q): &(usize, f64)| {
                    let g = gain(*k);
                    (-0.5 * dimensions[*k] as f64 * g.ln_1p() + 0.5 * q * g / (1.0 + g)).exp()
                };
                let mixture = statistics.iter().map(ratio).sum::<f64>() / statistics.len() as f64;
                sum += mixture.recip();
                squares += mixture.powi(-2);
            }
        }
        let n = draws as f64;
        let (mean, variance) = (sum / n, squares / n - (sum / n).powi(2));
        println!(
            "threshold {threshold}: {:.2e} ± {:.1e} alarms a piece (an alarm within {ENDS} pieces, over {ENDS})",
            mean / ENDS as f64,
            (variance / n).sqrt() / ENDS as f64
        );
    }
    let plain = (0..draws).filter(|_| {
        let pieces = production.draw(None, &mut random);
        let statistics = production.statistics(&pieces);
        statistics.iter().any(|(k, q)| log10_probability(*q, dimensions[*k], 1e7) <= -3.5)
    });
    let share = plain.count() as f64 / draws as f64;
    let sigma = (share * (1.0 - share) / draws as f64).sqrt();
    println!("plain draws at -3.5: {:.2e} ± {:.1e} alarms a piece", share / ENDS as f64, sigma / ENDS as f64);
    Ok(())
}
