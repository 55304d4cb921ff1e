//! Does the doctor leave healthy recordings alone?
//!
//! `cargo run --release -p trueline-studies -- healthy [RECORDINGS PER PRESET]` prints its findings in spite of that.

use crate::arguments::number;
use trueline_method::Config;
use trueline_method::diagnose::doctor::diagnose;
use trueline_sim::{Preset, random_cell, simulate};

pub(crate) fn run(arguments: &[String]) -> Result<(), String> {
    let count: u64 = number(arguments, 0, 20)?;
    for preset in [Preset::Quick, Preset::Good, Preset::Weak, Preset::TwoLines, Preset::Profiler] {
        let (mut examined, mut tried, mut claimed) = (0, 0, 0);
        for seed in 0..count {
            let Some(recording) = simulate(&random_cell(&preset.scenario(), seed, 0.1), seed) else {
                continue;
            };
            let found = diagnose(&recording, &Config::default(), None, |_| {});
            examined += 1;
            tried += usize::from(!found.trials.is_empty());
            claimed += usize::from(!found.findings.is_empty());
            found.findings.iter().for_each(|finding| println!("  seed {seed}: {finding}"));
        }
        println!(
            "preset {}: {examined} healthy recordings, mistakes looked for in {tried}, claimed in {claimed}",
            preset.name()
        );
    }
    Ok(())
}
