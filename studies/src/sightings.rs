//! Whether the uncertainty of a calibration from pose sightings is honest: many cells of the simulator, none with a guess.
//!
//! `cargo run --release -p trueline-studies -- sightings [CELLS [CASE]]` prints a row for each case: the normalised squared
//! error of time offset and hand-eye transform (1 is honest), the part of the 95 % intervals that hold the truth, and the
//! size of the errors.
#![allow(clippy::unwrap_used, reason = "a study fails by panicking")]

#[path = "../../crates/trueline-sensor/tests/sighted/mod.rs"]
mod sighted;

use crate::arguments::number;
use nalgebra::DMatrix;
use sighted::{calibrated, off, sigma_of};
use trueline_dataset::sensor_setup::Mounted;
use trueline_sensor::board_hand_eye::poses::PoseOptions;
use trueline_sim::{PoseMotion, SightingNoise, SightingScan};

/// Unknowns of time offset and hand-eye transform.
const OF_INTEREST: usize = 7;
/// Half a 95 % interval in standard deviations.
const HALF_95: f64 = 1.96;
/// Cells of each case, unless stated.
const CELLS: u64 = 200;

type Case = (&'static str, fn(u64) -> SightingScan);

const CASES: [Case; 9] = [
    ("moving", |seed| SightingScan { time_offset_s: offset_s(seed), ..SightingScan::usual(seed) }),
    ("30 % outliers", |seed| SightingScan {
        time_offset_s: offset_s(seed),
        outliers: 0.3,
        ..SightingScan::usual(seed)
    }),
    ("stated noise", |seed| SightingScan {
        time_offset_s: offset_s(seed),
        noise: SightingNoise::even(0.3e-3, 2e-3),
        states_noise: true,
        ..SightingScan::usual(seed)
    }),
    ("beside the robot", |seed| SightingScan {
        time_offset_s: offset_s(seed),
        mounted: Mounted::Fixed,
        ..SightingScan::usual(seed)
    }),
    ("40 sightings", |seed| SightingScan {
        time_offset_s: offset_s(seed),
        count: 40,
        period_s: 0.5,
        ..SightingScan::usual(seed)
    }),
    ("one clock, 15 Hz both", |seed| SightingScan {
        time_offset_s: 0.0,
        robot_period_s: 1.0 / 60.0,
        ..SightingScan::usual(seed)
    }),
    ("24 stops", SightingScan::at_stops),
    ("24 stops, 30 % out", |seed| SightingScan { outliers: 0.3, ..SightingScan::at_stops(seed) }),
    ("one axis", |seed| SightingScan { motion: PoseMotion::OneAxis, ..SightingScan::usual(seed) }),
];

/// Anywhere within a second, by a seed.
fn offset_s(seed: u64) -> f64 {
    (seed as f64 * 0.618_034).fract() * 2.0 - 1.0
}

pub(crate) fn run(arguments: &[String]) -> Result<(), String> {
    let cells: u64 = number(arguments, 0, CELLS)?;
    let only = arguments.get(1);
    println!("| case | cells | NEES | in 95 % | t_d ms | rotation ° | translation mm | hidden | failed |");
    println!("|---|---|---|---|---|---|---|---|---|");
    for (name, scan) in CASES.into_iter().filter(|(name, _)| only.is_none_or(|only| only == name)) {
        let mut sums = Sums::default();
        (0..cells).for_each(|seed| sums.add(&scan(seed)));
        println!("| {name} | {cells} | {}", sums.row());
    }
    Ok(())
}

#[derive(Default)]
struct Sums {
    squares: f64,
    counted: f64,
    inside: usize,
    intervals: usize,
    time_ms2: f64,
    turn_deg2: f64,
    shift_mm2: f64,
    hidden: usize,
    failed: usize,
}

impl Sums {
    fn add(&mut self, scan: &SightingScan) {
        let Ok(fit) = calibrated(scan, &PoseOptions::default()) else {
            self.failed += 1;
            return;
        };
        if !fit.hidden.is_empty() {
            self.hidden += 1;
            return;
        }
        let off = off(&fit, &scan.cast().truth);
        let first = usize::from(scan.at_stops);
        let size = OF_INTEREST - first;
        let covariance = DMatrix::from_fn(size, size, |i, j| fit.covariance[(first + i, first + j)]);
        let error = off.rows(first, size).into_owned();
        self.squares += error.dot(&(covariance.try_inverse().unwrap() * &error)) / size as f64;
        self.counted += 1.0;
        for k in first..OF_INTEREST {
            self.inside += usize::from(off[k].abs() < HALF_95 * sigma_of(&fit, k));
            self.intervals += 1;
        }
        self.time_ms2 += (off[0] * 1e3).powi(2);
        self.turn_deg2 += off.fixed_rows::<3>(1).map(f64::to_degrees).norm_squared();
        self.shift_mm2 += (off.fixed_rows::<3>(4) * 1e3).norm_squared();
    }

    fn row(&self) -> String {
        let rms = |sum: f64| (sum / self.counted).sqrt();
        format!(
            "{:.3} | {:.1} % | {:.4} | {:.4} | {:.4} | {} | {} |",
            self.squares / self.counted,
            100.0 * self.inside as f64 / self.intervals.max(1) as f64,
            rms(self.time_ms2),
            rms(self.turn_deg2),
            rms(self.shift_mm2),
            self.hidden,
            self.failed
        )
    }
}
