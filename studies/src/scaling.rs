//! Time and memory of a solve over scans of 10³ to 10⁷ features, as a table:
//! `cargo run --release -p trueline-studies -- scaling [LARGEST]`.
//!
//! The memory is that of building and solving the problem, without the observations and the trajectory (Linux only).
#![allow(clippy::unwrap_used, reason = "a study fails by panicking")]

#[path = "../../crates/trueline-method/tests/it/large_scan/mod.rs"]
mod large_scan;

use crate::arguments::number;
use large_scan::{NOISE, of_features};
use nalgebra::DVector;
use std::time::Instant;
use trueline_lsq::{LeastSquares, Loss, NormalEquations, SolveOptions, solve};
use trueline_method::ResidualKind;
use trueline_method::problem::line_problem::{Criterion, LineProblem};

pub(crate) fn run(arguments: &[String]) -> Result<(), String> {
    let largest: usize = number(arguments, 0, 10_000_000)?;
    println!(
        "| features | one linearisation | per feature | solve, steps | per feature and step | memory beyond the input |"
    );
    println!("|---|---|---|---|---|---|");
    let mut count = 1000;
    while count <= largest {
        row(count);
        count *= 10;
    }
    Ok(())
}

fn row(count: usize) {
    let (observed, at) = of_features(count);
    let before_kb = memory_kb("VmRSS:");
    // Forgets the peak of building the scan.
    let _ = std::fs::write("/proc/self/clear_refs", "5");
    let criterion = Criterion { residual: ResidualKind::Sheet, loss: Loss::Squared };
    let problem = LineProblem::new(&observed, &observed.list, criterion, &NOISE, &at);
    let off = DVector::from_fn(at.dimension(), |k, _| if k == 0 { 3e-3 } else { 1e-2 / (k as f64 + 1.0) });
    let began = Instant::now();
    let solution = solve(&problem, at.retract(&off), &[], &SolveOptions::default()).unwrap();
    let solve_s = began.elapsed().as_secs_f64();
    let memory_mb = memory_kb("VmHWM:").zip(before_kb).map(|(peak, before)| (peak - before) as f64 / 1024.0);
    let mut equations = NormalEquations::zeros(problem.dimension());
    let repeats = (1_000_000 / count).max(3);
    let mut linearize_s = f64::INFINITY;
    for _ in 0..repeats {
        equations.clear();
        let began = Instant::now();
        problem.linearize(&at, &mut equations);
        linearize_s = linearize_s.min(began.elapsed().as_secs_f64());
    }
    let (n, steps) = (count as f64, solution.iterations.len());
    println!(
        "| {count} | {:.3} ms | {:.0} ns | {:.2} ms, {steps} | {:.0} ns | {} |",
        linearize_s * 1e3,
        linearize_s / n * 1e9,
        solve_s * 1e3,
        solve_s / n / steps as f64 * 1e9,
        memory_mb.map_or_else(|| "–".to_owned(), |mb| format!("{mb:.0} MB"))
    );
}

fn memory_kb(name: &str) -> Option<i64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    status.lines().find(|line| line.starts_with(name))?.split_whitespace().nth(1)?.parse().ok()
}
