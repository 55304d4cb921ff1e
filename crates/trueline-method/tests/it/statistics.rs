//! The stated ± are true: Monte Carlo over random cells, with any hand-eye, any line, any time offset.
//!
//! `cargo run --release -p trueline-studies -- monte_carlo 2000` does the same with more runs.

use crate::monte_carlo;

use monte_carlo::{Noise, Run, Start, UNKNOWNS, runs, statistics};
use trueline_sim::Preset;

const RUNS: u64 = 72;
/// Tolerance in standard deviations of the statistic itself: one false alarm in 16 000.
const DEVIATIONS: f64 = 4.0;

/// Bias of the mean normalised error squared that is expected. Upwards: a covariance that is estimated from F frames
/// makes it 1 + (7 + 1)/F, with 600 frames and more 1.3 %. Downwards with a noisy robot. The local quadratic leaves
/// noise that is anticorrelated by 8 % between frames 33 ms apart (its weights at 250 Hz are [−36 9 44 69 84 89 84 69
/// 44 9 −36]/429). It averages out faster than independent noise, by up to 16 % of its variance, which is about half
/// of all.
const UPWARDS: f64 = 0.013;
const DOWNWARDS: f64 = 0.08;

fn assert_honest(preset: Preset, noise: Noise) {
    let all = runs(&preset.scenario(), noise, Start::Truth, 0..RUNS);
    let s = statistics(&all);
    let title = preset.name();
    assert_eq!((s.accepted, s.wrong), (s.runs, 0), "{title}");
    let count = s.accepted as f64;
    // χ² with 7 N degrees of freedom, normalised: variance 2/(7 N).
    let slack = DEVIATIONS * (2.0 / (UNKNOWNS as f64 * count)).sqrt();
    let downwards = if noise == Noise::GaussianFeatures { 0.0 } else { DOWNWARDS };
    let mean = s.normalised_per_unknown;
    assert!((1.0 - downwards - slack..1.0 + UPWARDS + slack).contains(&mean), "{title}: {mean}");
    // Binomial, about 0.95, or slightly above if sigma is slightly large.
    let slack = DEVIATIONS * (0.95 * 0.05 / count).sqrt();
    assert!(s.coverage.iter().all(|c| (c - 0.95).abs() < slack + 0.1 * downwards), "{title}: {}", s.coverage);
    if let Some(ratio) = s.spread_over_bound {
        // A standard deviation from N samples is known to 1/√(2 N). The robust loss costs less than 1 %.
        let slack = DEVIATIONS / (2.0 * count).sqrt() + 0.01;
        assert!(ratio.iter().all(|r| (r - 1.0).abs() < slack), "{title}: {ratio}");
    }
}

#[test]
fn gaussian_features_reach_the_cramer_rao_bound() {
    assert_honest(Preset::Quick, Noise::GaussianFeatures);
    assert_honest(Preset::TwoLines, Noise::GaussianFeatures);
}

#[test]
fn one_line() {
    assert_honest(Preset::Quick, Noise::Preset);
}

#[test]
fn two_lines_share_their_frames_noise() {
    assert_honest(Preset::TwoLines, Noise::Preset);
}

#[test]
fn little_tilt() {
    assert_honest(Preset::Weak, Noise::Preset);
}

#[test]
fn profiler() {
    assert_honest(Preset::Profiler, Noise::Preset);
}

/// At least 47 of 48, and no wrong answer is accepted.
#[test]
fn from_nothing() {
    for preset in [Preset::Quick, Preset::Weak] {
        let all = runs(&preset.scenario(), Noise::Preset, Start::Nothing, 0..48);
        let wrong: Vec<&Run> = all.iter().filter(|run| run.is_wrong()).collect();
        assert!(
            wrong.is_empty(),
            "{}: {:?}",
            preset.name(),
            wrong.iter().map(|r| r.seed).collect::<Vec<_>>()
        );
        let accepted = all.iter().filter(|run| run.accepted).count();
        assert!(accepted >= 47, "{}: {accepted}", preset.name());
    }
}
