//! Whether the uncertainty of a calibration from pose sightings is honest: many cells of the simulator, none with a guess.
//!
//! `cargo run --release -p trueline-studies -- sightings [CELLS [CASE [FIRST SEED]]]` prints a row for each case: the normalised squared
//! error of time offset and hand-eye transform (1 is honest), the part of the 95 % intervals that hold the truth, and the
//! size of the errors.
#![allow(clippy::unwrap_used, reason = "a study fails by panicking")]

#[path = "../../crates/trueline-sensor/tests/it/sighted/mod.rs"]
mod sighted;

use crate::arguments::{number, word};
use nalgebra::{DMatrix, SMatrix};
use sighted::{Robot, at_stops, calibrated, off};
use trueline_dataset::sensor_setup::Mounted;
use trueline_sensor::board_hand_eye::PoseFit;
use trueline_sensor::board_hand_eye::joint::SIZE;
use trueline_sensor::board_hand_eye::poses::PoseOptions;
use trueline_sim::{PoseMotion, SightingNoise, SightingScan};

/// Unknowns of time offset and hand-eye transform.
const OF_INTEREST: usize = 7;
/// Half a 95 % interval in standard deviations.
const HALF_95: f64 = 1.96;
/// Cells of each case, unless stated.
const CELLS: u64 = 200;

/// A case: its scan, and how the robot errs at stops beside what the scan has. Its accuracy is stated then.
type Case = (&'static str, fn(u64) -> SightingScan, Option<Robot>);

/// Noise of a tracker, per axis, m and rad.
const TRACKER: [f64; 2] = [0.03e-3, 1e-4];

fn tracked(seed: u64) -> SightingScan {
    let [shift_m, turn_rad] = TRACKER;
    SightingScan { noise: SightingNoise::even(shift_m, turn_rad), ..SightingScan::at_stops(seed) }
}

fn stated(seed: u64) -> SightingScan {
    SightingScan { states_noise: true, ..tracked(seed) }
}

const CASES: [Case; 15] = [
    ("moving", |seed| SightingScan { time_offset_s: offset_s(seed), ..SightingScan::usual(seed) }, None),
    (
        "30 % outliers",
        |seed| SightingScan { time_offset_s: offset_s(seed), outliers: 0.3, ..SightingScan::usual(seed) },
        None,
    ),
    (
        "stated noise",
        |seed| SightingScan {
            time_offset_s: offset_s(seed),
            noise: SightingNoise::even(0.3e-3, 2e-3),
            states_noise: true,
            ..SightingScan::usual(seed)
        },
        None,
    ),
    (
        "beside the robot",
        |seed| SightingScan {
            time_offset_s: offset_s(seed),
            mounted: Mounted::Fixed,
            ..SightingScan::usual(seed)
        },
        None,
    ),
    (
        "40 sightings",
        |seed| SightingScan {
            time_offset_s: offset_s(seed),
            count: 40,
            period_s: 0.5,
            ..SightingScan::usual(seed)
        },
        None,
    ),
    (
        "one clock, 15 Hz both",
        |seed| SightingScan { time_offset_s: 0.0, robot_period_s: 1.0 / 60.0, ..SightingScan::usual(seed) },
        None,
    ),
    ("24 stops", SightingScan::at_stops, None),
    ("24 stops, 30 % out", |seed| SightingScan { outliers: 0.3, ..SightingScan::at_stops(seed) }, None),
    ("one axis", |seed| SightingScan { motion: PoseMotion::OneAxis, ..SightingScan::usual(seed) }, None),
    ("24 stops, restless robot", SightingScan::at_stops, Some(Robot::Restless)),
    ("24 stops, slow errors", SightingScan::at_stops, Some(Robot::Slow)),
    ("24 stops, tracker, restless robot", tracked, Some(Robot::Restless)),
    ("24 stops, tracker, slow errors", tracked, Some(Robot::Slow)),
    ("24 stops, stated tracker, restless robot", stated, Some(Robot::Restless)),
    ("24 stops, stated tracker, slow errors", stated, Some(Robot::Slow)),
];

/// Anywhere within a second, by a seed.
fn offset_s(seed: u64) -> f64 {
    (seed as f64 * 0.618_034).fract() * 2.0 - 1.0
}

pub(crate) fn run(arguments: &[String]) -> Result<(), String> {
    let cells: u64 = number(arguments, 0, CELLS)?;
    let first: u64 = number(arguments, 2, 0)?;
    println!("| case | cells | NEES | in 95 % | t_d ms | rotation ° | translation mm | hidden | failed |");
    println!("|---|---|---|---|---|---|---|---|---|");
    for (name, scan, robot) in CASES.into_iter().filter(|case| case.0.contains(word(arguments, 1))) {
        let mut sums = Sums::default();
        (first..first + cells).for_each(|seed| sums.add(&scan(seed), robot));
        println!("| {name} | {cells} | {}", sums.row());
    }
    Ok(())
}

/// The answer and its covariance.
fn answer(scan: &SightingScan, robot: Option<Robot>) -> Option<(PoseFit, SMatrix<f64, SIZE, SIZE>)> {
    let Some(robot) = robot else {
        let fit = calibrated(scan, &PoseOptions::default()).ok()?;
        let covariance = fit.covariance;
        return Some((fit, covariance));
    };
    let found = at_stops(scan, robot).ok()?;
    Some((found.fit, found.covariance))
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
    fn add(&mut self, scan: &SightingScan, robot: Option<Robot>) {
        let Some((fit, all)) = answer(scan, robot) else {
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
        let covariance = DMatrix::from_fn(size, size, |i, j| all[(first + i, first + j)]);
        let error = off.rows(first, size).into_owned();
        self.squares += error.dot(&(covariance.try_inverse().unwrap() * &error)) / size as f64;
        self.counted += 1.0;
        for k in first..OF_INTEREST {
            self.inside += usize::from(off[k].abs() < HALF_95 * all[(k, k)].sqrt());
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
