//! How long a profile of 2048 points takes: a histogram of single calls with its tail.
#![allow(
    missing_docs,
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a bench fails by panicking and prints"
)]

use std::hint::black_box;
use std::time::Instant;
use trueline_geometry::Pose;
use trueline_rt::{Carrier, Placer, PlacerCalibration, Points, SensorModel, Settings};

const POINTS: usize = 2048;
const CALLS: usize = 20_000;
/// Time between poses, ns.
const PERIOD_NS: i64 = 4_000_000;

fn placer() -> Placer {
    let calibration = PlacerCalibration {
        sensor: SensorModel::Profiler,
        shape: None,
        tool_from_camera: Pose::translation(0.05, 0.0, 0.1),
        time_offset_s: 0.017,
        covariance: PlacerCalibration::covariance_of(1e-4, 1e-3, 1e-4),
        reading_sigma_m: 2e-5,
        carrier: Carrier::Tool,
        axes: Vec::new(),
    };
    Placer::new(&calibration, &Settings::default()).unwrap()
}

/// A pose that goes and shakes by some 10 µm, so that the local fit is at work.
fn pose(k: i64) -> Pose {
    let shake = 1e-5 * ((k * 7919) % 13 - 6) as f64 / 4.0;
    Pose::translation(1e-4 * (k % 10_000) as f64 + shake, shake, 0.3)
}

fn main() {
    let mut placer = placer();
    let readings: Vec<[f64; 2]> = (0..POINTS).map(|k| [1e-5 * k as f64, 0.2]).collect();
    let (mut base, mut sigmas) = (vec![[0.0; 3]; POINTS], vec![0.0; POINTS]);
    let mut k = 0;
    while k < 500 {
        placer.push_pose(k * PERIOD_NS, &pose(k)).unwrap();
        k += 1;
    }
    let mut times_ns = Vec::with_capacity(CALLS);
    for _ in 0..CALLS {
        placer.push_pose(k * PERIOD_NS, &pose(k)).unwrap();
        k += 1;
        let stamp_ns = k * PERIOD_NS + PERIOD_NS / 3;
        let begun = Instant::now();
        placer.place(stamp_ns, Points::Profile(black_box(&readings)), &mut base, &mut sigmas).unwrap();
        times_ns.push(begun.elapsed().as_nanos());
        black_box((&base, &sigmas));
    }
    times_ns.sort_unstable();
    let at_us = |quantile: f64| times_ns[(quantile * (CALLS - 1) as f64) as usize] as f64 * 1e-3;
    println!(
        "a profile of {POINTS} points: 50 % {:.2} µs, 99 % {:.2} µs, 99.9 % {:.2} µs of {CALLS} calls",
        at_us(0.5),
        at_us(0.99),
        at_us(0.999)
    );
}
