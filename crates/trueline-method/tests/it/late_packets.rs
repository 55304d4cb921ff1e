//! Scans with packets that wait in queues: delay does not count as motion, and the time offset is right.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Exp, StandardNormal};
use trueline_dataset::{Recording, RobotSample};
use trueline_method::{Calibration, Config, Reason, Stamps, Status, calibrate};
use trueline_sim::{Preset, Scenario, simulate};

/// Half-normal lateness, s.
const LATE_S: f64 = 0.12e-3;
/// Its median: a late image looks like an offset, a late pose like its opposite, s.
const MEDIAN_S: f64 = 0.6745 * LATE_S;
/// Interval between the packets of a queue, ns.
const QUEUED_NS: i64 = 15_000;

fn scenario() -> Scenario {
    let mut scenario = Preset::Quick.scenario();
    scenario.disturbance.robot_jitter_s = 0.0;
    scenario.disturbance.frame_jitter_s = 0.0;
    scenario
}

/// Delays stamps like a PC that stalls for 15 ms about every 3 s: half-normal, half a per cent by 3 ms, with queues behind each stall.
fn late<'a>(stamps_ns: impl Iterator<Item = &'a mut i64>, seed: u64) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let (packet, stall) = (Exp::new(1.0 / 3e-3).unwrap(), Exp::new(1.0 / 3.0).unwrap());
    let (mut free_ns, mut stalled_until_ns, mut next_stall_ns) = (i64::MIN, i64::MIN, None);
    for stamp_ns in stamps_ns {
        let normal: f64 = StandardNormal.sample(&mut rng);
        let held_s = if rng.random_bool(0.005) { packet.sample(&mut rng) } else { 0.0 };
        let arrives_ns = *stamp_ns + ((LATE_S * normal.abs() + held_s) * 1e9) as i64;
        let stall_ns = *next_stall_ns.get_or_insert(arrives_ns + 1_000_000_000);
        if arrives_ns > stall_ns {
            stalled_until_ns = stall_ns + 15_000_000;
            next_stall_ns = Some(stall_ns + (stall.sample(&mut rng) * 1e9) as i64);
        }
        *stamp_ns = arrives_ns.max(stalled_until_ns).max(free_ns);
        free_ns = *stamp_ns + QUEUED_NS;
    }
}

fn late_scan(seed: u64) -> Recording {
    let mut recording = simulate(&scenario(), seed).unwrap();
    late(recording.robot.iter_mut().map(|sample| &mut sample.stamp_ns), seed);
    late(recording.features.iter_mut().map(|feature| &mut feature.stamp_ns), seed + 100);
    recording
}

fn offset_error_s(calibration: &Calibration, recording: &Recording) -> f64 {
    calibration.best_fit().time_offset_s - recording.truth.as_ref().unwrap().parameters.time_offset_s
}

#[test]
fn queues_of_both_streams_leave_the_time_offset() {
    for seed in 1..=4 {
        let recording = late_scan(seed);
        let calibration = calibrate(&recording, None, &Config::default()).unwrap();
        assert_eq!(calibration.status(), Status::Accepted, "{seed}: {:?}", calibration.reasons());
        let streams = &calibration.findings.streams;
        assert!(streams.robot.dejittered && streams.images.dejittered, "{seed}");
        let [median_s, most_s] = streams.robot.lateness_s.unwrap();
        assert!(
            (median_s / MEDIAN_S - 1.0).abs() < 0.2 && (5e-3..0.05).contains(&most_s),
            "{median_s} {most_s}"
        );
        // Both clocks follow the floor, so that no lateness remains. The limit is four standard deviations.
        let (off_s, sigma_s) = (offset_error_s(&calibration, &recording), calibration.sigma(0).unwrap());
        assert!(off_s.abs() < 4.0 * sigma_s, "{seed}: {off_s} ± {sigma_s}");
    }
}

#[test]
fn queued_packets_are_no_motion_whatever_stamps_are_used() {
    for seed in 1..=2 {
        let recording = late_scan(seed);
        let raw = Config { stamps: Stamps::Raw, ..Config::default() };
        let calibration = calibrate(&recording, None, &raw).unwrap();
        let unobservable = |reason: &Reason| reason.code() == "unobservable";
        assert!(!calibration.reasons().iter().any(unobservable), "{seed}: {:?}", calibration.reasons());
    }
}

/// A controller with a new pose every 4 ms, polled every 2.8 ms: three rows in ten repeat the previous one.
#[test]
fn a_polled_log_with_late_packets_keeps_its_index() {
    const POLL_NS: i64 = 2_800_000;
    for seed in 1..=2 {
        let mut recording = simulate(&scenario(), seed).unwrap();
        let poses = std::mem::take(&mut recording.robot);
        let (first_ns, last_ns) = (poses[0].stamp_ns, poses[poses.len() - 1].stamp_ns);
        let asked = (0..=(last_ns - first_ns) / POLL_NS).map(|k| first_ns + k * POLL_NS);
        let newest = |stamp_ns: i64| {
            let after = poses.partition_point(|pose| pose.stamp_ns <= stamp_ns);
            RobotSample { stamp_ns, ..poses[after - 1] }
        };
        recording.robot = asked.map(newest).collect();
        late(recording.robot.iter_mut().map(|sample| &mut sample.stamp_ns), seed);
        let calibration = calibrate(&recording, None, &Config::default()).unwrap();
        let robot = &calibration.findings.streams.robot;
        assert!((robot.period_s.unwrap() - 2.8e-3).abs() < 1e-8 && robot.missing == Some(0), "{robot:?}");
        // A new pose is 0 to 2.8 ms old at its first poll. Half of that is subtracted, and its spread is in the uncertainty.
        let (off_s, sigma_s) = (offset_error_s(&calibration, &recording), calibration.sigma(0).unwrap());
        assert!(off_s.abs() < 4.0 * sigma_s, "{seed}: {off_s} ± {sigma_s}");
    }
}
