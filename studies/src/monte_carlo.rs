//! Proves the ± by simulation: `cargo run --release -p trueline-studies -- monte_carlo [RUNS [PRESET …]]`.
//!
//! For each preset, RUNS random cells (any hand-eye, any line, an offset between −1 and +1 s) are scanned and
//! calibrated, first with Gaussian features alone, where the Cramér–Rao bound is known, then with the preset's
//! noise of features, robot and stamps. `--from-truth` starts at the truth, which finds the same optimum sooner.

#[path = "../../crates/trueline-method/tests/it/monte_carlo/mod.rs"]
mod simulated;

use crate::arguments::number;
use simulated::{Noise, Run, Start, Statistics, UNKNOWNS, runs, statistics};
use trueline_sim::Preset;

const NAMES: [&str; UNKNOWNS] = ["t_d", "rot x", "rot y", "rot z", "x", "y", "z"];

pub(crate) fn run(arguments: &[String]) -> Result<(), String> {
    let mut words = arguments.to_vec();
    let start = if words.iter().any(|w| w == "--from-truth") { Start::Truth } else { Start::Nothing };
    words.retain(|w| !w.starts_with("--"));
    let count: u64 = number(&words, 0, 200)?;
    let visible = [Preset::Paper, Preset::Quick, Preset::Weak, Preset::TwoLines, Preset::Profiler];
    let wanted = |p: &&Preset| words.len() < 2 || words[1..].iter().any(|w| w == p.name());
    for preset in visible.iter().filter(wanted) {
        for (noise, name) in [(Noise::GaussianFeatures, "Gaussian features"), (Noise::Preset, "all noise")] {
            let runs = runs(&preset.scenario(), noise, start, 0..count);
            print(&format!("{}, {name}", preset.name()), &runs);
        }
    }
    Ok(())
}

fn print(title: &str, runs: &[Run]) {
    let s: Statistics = statistics(runs);
    println!(
        "{title}: {} runs, {} accepted, {} wrong, {:.3} s each",
        s.runs, s.accepted, s.wrong, s.mean_seconds
    );
    for run in runs.iter().filter(|r| !r.accepted || r.is_wrong()).take(5) {
        println!("  seed {}: {}", run.seed, if run.accepted { "WRONG" } else { &run.said });
    }
    let deviation = (2.0 / (UNKNOWNS * s.accepted) as f64).sqrt();
    println!("  normalised error squared per unknown {:.3} (1 ± {deviation:.3})", s.normalised_per_unknown);
    let row = |label: &str, value: &dyn Fn(usize) -> f64| {
        let cells: Vec<String> = (0..UNKNOWNS).map(|k| format!("{:>8.3}", value(k))).collect();
        println!("  {label:<18}{}", cells.join(""));
    };
    println!("  {:<18}{}", "", NAMES.map(|n| format!("{n:>8}")).join(""));
    row("95 % coverage", &|k| s.coverage[k]);
    if let Some(ratio) = s.spread_over_bound {
        row("spread / bound", &|k| ratio[k]);
    }
}
