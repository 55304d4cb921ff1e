//! Weaves and S-paths that repeat themselves, and ordinary scans: how many are right, refused, or accepted and wrong.
//!
//! `cargo run --release -p trueline-studies -- weaves [SCANS PER FAMILY]`

use crate::arguments::number;
use nalgebra::DVector;
use std::collections::{BTreeMap, BTreeSet};
use trueline_dataset::{Guess, Recording};
use trueline_method::config::known_of_cell::KnownOfCell;
use trueline_method::config::{ASSUMED_EDGE_RADIUS_M, ASSUMED_WAVINESS_M};
use trueline_method::{Calibration, Config, Reason, Status, calibrate};
use trueline_sim::{Preset, Weave, random_cell, simulate};

/// Results of one family's scans.
#[derive(Default)]
struct Tally {
    right: usize,
    refused: usize,
    wrong: usize,
    reasons: BTreeMap<&'static str, usize>,
    smallest_z: Option<f64>,
}

impl Tally {
    fn add(&mut self, recording: &Recording, config: &Config, guess: Option<&Guess>) {
        let Some(truth) = recording.truth.as_ref().map(|truth| truth.parameters) else { return };
        let Ok(result) = calibrate(recording, guess, config) else {
            self.refused += 1;
            return;
        };
        for code in result.reasons().iter().map(Reason::code).collect::<BTreeSet<_>>() {
            *self.reasons.entry(code).or_default() += 1;
        }
        let z = result
            .findings
            .checks
            .ambiguity
            .runner_up
            .filter(|rival| rival.test.decided())
            .map(|rival| rival.test.z);
        self.smallest_z = self.smallest_z.into_iter().chain(z).reduce(f64::min);
        match (result.status(), is_right(&result, &truth)) {
            (Status::NotAccepted, _) => self.refused += 1,
            (Status::Accepted, true) => self.right += 1,
            (Status::Accepted, false) => self.wrong += 1,
        }
    }

    fn print(&self, name: &str) {
        let reasons: Vec<String> =
            self.reasons.iter().map(|(code, count)| format!("{code} {count}")).collect();
        let z = self.smallest_z.map_or_else(|| "-".to_owned(), |z| format!("{z:.1}"));
        println!(
            "| {name} | {} | {} | {} | {z} | {} |",
            self.right,
            self.refused,
            self.wrong,
            reasons.join(", ")
        );
    }
}

/// Once in a million answers by chance: χ²₇.
const LARGEST_SQUARE: f64 = 40.0;

/// Whether time offset and hand-eye agree with the result, by its own covariance.
fn is_right(result: &Calibration, truth: &Guess) -> bool {
    let error = DVector::from_column_slice(result.best_fit().minus(truth).as_slice());
    let covariance = result.best_fit_covariance().view((0, 0), (7, 7)).into_owned();
    covariance.cholesky().is_some_and(|root| error.dot(&root.solve(&error)) < LARGEST_SQUARE)
}

pub(crate) fn run(arguments: &[String]) -> Result<(), String> {
    let count: u64 = number(arguments, 0, 40)?;
    println!("| path | right | refused | accepted and wrong | smallest z of those decided | refused for |");
    println!("|---|---|---|---|---|---|");
    let free = Config::default();
    let stated =
        Config { known: KnownOfCell { offset_within_s: Some(0.2), looks: None }, ..Config::default() };
    let shop = Config {
        edge_radius_m: Some(ASSUMED_EDGE_RADIUS_M),
        waviness_m: Some(ASSUMED_WAVINESS_M),
        ..Config::default()
    };
    let configs =
        [(&free, "nothing stated"), (&stated, "--offset-within 0.2"), (&shop, "form and edge unknown")];
    for (config, what) in configs {
        for weave in Weave::ALL {
            let mut tally = Tally::default();
            for seed in 0..count {
                let recording = simulate(&weave.scenario(seed), seed);
                recording.iter().for_each(|recording| tally.add(recording, config, None));
            }
            tally.print(&format!("{}, {what}", weave.name()));
        }
    }
    for (preset, duration_s) in
        [(Preset::Quick, 5.0), (Preset::Quick, 20.0), (Preset::Good, 20.0), (Preset::Paper, 60.0)]
    {
        let mut tally = Tally::default();
        for seed in 0..count {
            let mut scenario = random_cell(&preset.scenario(), seed, 0.1);
            scenario.timing.duration_s = duration_s;
            simulate(&scenario, seed).iter().for_each(|recording| tally.add(recording, &free, None));
        }
        tally.print(&format!("preset {}, {duration_s:.0} s", preset.name()));
    }
    Ok(())
}
