//! How long a profile of 2048 points takes: a histogram of single calls with its tail. Calls during which the kernel gave the processor to
//! another program are counted apart, where the kernel tells (Linux): they show that program, not this one. Arithmetic of the same length
//! shows the machine's own tail.
#![allow(
    missing_docs,
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a bench fails by panicking and prints"
)]

use nalgebra::Vector3;
use std::fs::File;
use std::hint::black_box;
use std::io::{Read, Seek};
use std::time::Instant;
use trueline_geometry::{Axis, AxisKind, Pose};
use trueline_rt::{
    AxisCarries, Carrier, ExternalAxis, Placer, PlacerCalibration, Points, SensorModel, Settings,
};

const POINTS: usize = 2048;
const CALLS: usize = 20_000;
/// Time between poses, ns.
const PERIOD_NS: i64 = 4_000_000;

/// Upper ends of the histogram's bins, µs.
const BINS_US: [f64; 10] = [2.0, 3.0, 4.0, 5.0, 7.0, 10.0, 15.0, 20.0, 50.0, f64::INFINITY];

/// A table under the part, and a track under the robot.
fn axes() -> Vec<ExternalAxis> {
    let covariance = ExternalAxis::covariance_of(1e-4, 1e-4, 0.0, 1e-4);
    let axis = |kind, carries, direction| {
        let axis = Axis::new(kind, direction, Vector3::new(0.8, 0.1, 0.0));
        ExternalAxis { axis, carries, in_pose: None, covariance }
    };
    vec![
        axis(AxisKind::Rotary, AxisCarries::Part, Vector3::z_axis()),
        axis(AxisKind::Linear, AxisCarries::Robot, Vector3::x_axis()),
    ]
}

fn placer(axes: Vec<ExternalAxis>) -> Placer {
    let calibration = PlacerCalibration {
        sensor: SensorModel::Profiler,
        shape: None,
        tool_from_camera: Pose::translation(0.05, 0.0, 0.1),
        time_offset_s: 0.017,
        covariance: PlacerCalibration::covariance_of(1e-4, 1e-3, 1e-4),
        reading_sigma_m: 2e-5,
        carrier: Carrier::Tool,
        axes,
    };
    Placer::new(&calibration, &Settings::default()).unwrap()
}

/// A pose that goes and shakes by some 10 µm, so that the local fit is at work.
fn pose(k: i64) -> Pose {
    let shake = 1e-5 * ((k * 7919) % 13 - 6) as f64 / 4.0;
    Pose::translation(0.5 * (2e-4 * k as f64).sin() + shake, shake, 0.3)
}

fn main() {
    run("a profile of 2048 points", Vec::new());
    run("a profile of 2048 points, with a table and a track", axes());
    control();
}

/// Steps of the control's arithmetic: about as long as a profile.
const CONTROL_STEPS: u64 = 48_000;

/// The tail of this machine: arithmetic that touches no memory and takes as long each time. What it takes longer is the machine's.
fn control() {
    let (mut times_ns, mut turns) = (Vec::with_capacity(CALLS), Turns::new());
    let mut interrupted = 0;
    for k in 0..CALLS as u64 {
        let turn = turns.count();
        let begun = Instant::now();
        black_box(
            (0..CONTROL_STEPS)
                .fold(k, |sum, step| sum.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(step)),
        );
        let time_ns = begun.elapsed().as_nanos();
        if turns.count() == turn {
            times_ns.push(time_ns);
        } else {
            interrupted += 1;
        }
    }
    tell("arithmetic of the same length instead", &mut times_ns, interrupted);
}

fn run(what: &str, axes: Vec<ExternalAxis>) {
    let axis_count = axes.len();
    let mut placer = placer(axes);
    let readings: Vec<[f64; 2]> = (0..POINTS).map(|k| [1e-5 * k as f64, 0.2]).collect();
    let (mut base, mut sigmas) = (vec![[0.0; 3]; POINTS], vec![0.0; POINTS]);
    let hear = |placer: &mut Placer, k: i64| {
        placer.push_pose(k * PERIOD_NS, &pose(k)).unwrap();
        for axis in 0..axis_count {
            placer.push_axis(axis, k * PERIOD_NS, 1e-3 * (0.01 * k as f64).sin()).unwrap();
        }
    };
    (0..500).for_each(|k| hear(&mut placer, k));
    let (mut times_ns, mut turns) = (Vec::with_capacity(CALLS), Turns::new());
    let mut interrupted = 0;
    for k in (500..).take(CALLS) {
        hear(&mut placer, k);
        let turn = turns.count();
        let stamp_ns = (k + 1) * PERIOD_NS + PERIOD_NS / 3;
        let begun = Instant::now();
        placer.place(stamp_ns, Points::Profile(black_box(&readings)), &mut base, &mut sigmas).unwrap();
        let time_ns = begun.elapsed().as_nanos();
        black_box((&base, &sigmas));
        if turns.count() == turn {
            times_ns.push(time_ns);
        } else {
            interrupted += 1;
        }
    }
    tell(what, &mut times_ns, interrupted);
}

/// How often this thread got the processor: the third number of its `schedstat`.
struct Turns(Option<File>);

impl Turns {
    fn new() -> Self {
        Self(File::open("/proc/thread-self/schedstat").ok())
    }

    /// `None` where the kernel does not tell.
    fn count(&mut self) -> Option<u64> {
        let (file, mut text) = (self.0.as_mut()?, String::new());
        file.rewind().and_then(|()| file.read_to_string(&mut text)).ok()?;
        text.split_whitespace().nth(2)?.parse().ok()
    }
}

fn tell(what: &str, times_ns: &mut [u128], interrupted: usize) {
    times_ns.sort_unstable();
    let calls = times_ns.len();
    let at_us = |quantile: f64| times_ns[(quantile * (calls - 1) as f64) as usize] as f64 * 1e-3;
    println!(
        "{what}: 1 % {:.2} µs, 50 % {:.2} µs, 99 % {:.2} µs, 99.9 % {:.2} µs of {calls} calls; {interrupted} more were interrupted",
        at_us(0.01),
        at_us(0.5),
        at_us(0.99),
        at_us(0.999)
    );
    let mut from = 0;
    for bin_us in BINS_US {
        let to = times_ns.partition_point(|time_ns| *time_ns as f64 * 1e-3 <= bin_us);
        println!("  up to {bin_us:>4} µs: {:>6}", to - from);
        from = to;
    }
}
