//! Whole cells of a shop with all errors at once: is a good scan accepted, and is the answer as good as stated?
//!
//! `cargo run --release -p trueline-studies -- shop_cells [CELLS A LEVEL] [LEVEL] [FIRST SEED] [--cells] [--stated]
//! [--strict] [--plates]` prints two tables: accepted cells and their errors, and refused cells and their reasons. With
//! `--cells` a line a cell as well. With `--stated` the radius of the edge and the class of the robot are stated
//! correctly. With `--strict` the seam error is that of another robot. With `--plates` cameras and profilers measure
//! whole stripes.

#[path = "../../../crates/trueline-method/tests/it/shop_judge/mod.rs"]
mod judge;
mod table;

use judge::Judged;
use trueline_method::{Config, Measurements, Use, calibrate};
use trueline_sim::shop::{Level, Shop, ShopCell, ShopTruth};

/// Default number of cells a level.
const CELLS: u64 = 60;

pub(crate) fn run(arguments: &[String]) -> Result<(), String> {
    let (words, numbers): (Vec<String>, Vec<String>) =
        arguments.iter().cloned().partition(|word| word.parse::<u64>().is_err());
    let numbers: Vec<u64> = numbers.iter().filter_map(|word| word.parse().ok()).collect();
    let count = numbers.first().copied().unwrap_or(CELLS);
    let first = numbers.get(1).copied().unwrap_or(1);
    let has = |option: &str| words.iter().any(|word| word == option);
    let (prints_cells, is_stated, is_strict) = (has("--cells"), has("--stated"), has("--strict"));
    let is_wanted = |level: &Level| {
        words.iter().all(|word| word.starts_with('-')) || words.iter().any(|word| word == level.name())
    };
    let mut columns = Vec::new();
    for level in Level::ALL.into_iter().filter(is_wanted) {
        let judged = |seed| {
            let cell = Shop { plates: has("--plates"), ..Shop::new(level, seed) }.cast()?;
            let config = if is_stated { stated(&cell.truth) } else { Config::default() };
            let used_at = Use { by_another_robot: is_strict, ..config.used_at };
            let measurements = if has("--seam") {
                Measurements::Seam
            } else if has("--stripes") {
                Measurements::Stripe
            } else {
                config.measurements
            };
            let judged = judged(&cell, &Config { used_at, measurements, ..config });
            if prints_cells {
                println!("{}-{seed:03} {}", level.name(), judged.in_words());
            }
            Some(judged)
        };
        columns.push((level, (first..first + count).filter_map(judged).collect()));
    }
    table::print(&columns);
    Ok(())
}

/// The accuracy of a robot over the root mean square of its errors: the class of 0.5 mm is that of arms of 0.4 mm.
const CLASS_OVER_RMS: f64 = 1.25;

/// Statements of a user who knows the edge and the robot.
fn stated(truth: &ShopTruth) -> Config {
    let size = |name: &str| {
        truth.errors.iter().find(|(row, _)| row.name == name).map_or(0.0, |(row, size)| size * row.unit.1)
    };
    Config {
        edge_radius_m: Some(size("rounded-edge")),
        robot_accuracy_m: Some(CLASS_OVER_RMS * size("arm-geometry")),
        ..Config::default()
    }
}

/// One cell, calibrated and judged.
fn judged(cell: &ShopCell, config: &Config) -> Judged {
    match &calibrate(&cell.recording, cell.recording.initial.as_ref(), config) {
        Ok(calibration) => judge::judged(cell, calibration),
        Err(error) => Judged::refused(cell, vec![format!("error: {error}")]),
    }
}
