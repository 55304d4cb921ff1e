//! The camera's clock on the PC's.
#![cfg(feature = "gige")]
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

mod simulated;

use simulated::{open, patient, start, take};
use std::time::Duration;
use trueline_camera::device::{ClockStep, DeviceClock, DeviceHandle, DeviceSettings};
use trueline_camera::{GigeCamera, LatchMap, LatchSample};
use trueline_live::HostClock;

const EPOCH_NS: i64 = 987_654_321_000_000;

fn drifting(test: u8, step: Option<ClockStep>) -> DeviceSettings {
    let clock = DeviceClock { epoch_ns: EPOCH_NS, drift_ppm: 50.0, step };
    DeviceSettings { clock, ..patient(test) }
}

fn latches(camera: &mut GigeCamera, count: usize, every: Duration) -> Vec<LatchSample> {
    let sample = |_| {
        std::thread::sleep(every);
        camera.latch().unwrap().unwrap()
    };
    (0..count).map(sample).collect()
}

/// By how much the map is off at a time, ns.
fn error_ns(map: &LatchMap, device: &DeviceHandle, steady_ns: i64) -> i64 {
    map.host_ns(device.device_ns(steady_ns)) - steady_ns
}

#[test]
fn a_drifting_clock_is_mapped_within_what_the_exchange_allows() {
    let host = HostClock::start();
    let settings = drifting(1, None);
    let device = start(&settings, host);
    let mut camera = open(&settings, host);
    let samples = latches(&mut camera, 120, Duration::from_millis(25));
    for sample in &samples {
        let bounds = device.device_ns(sample.before_ns)..=device.device_ns(sample.after_ns);
        assert!(bounds.contains(&sample.device_ns), "the latch lies between question and answer: {sample:?}");
    }
    let map = LatchMap::of(&samples).unwrap();
    let mut round_trips_ns: Vec<i64> = samples.iter().map(|s| s.after_ns - s.before_ns).collect();
    round_trips_ns.sort_unstable();
    // The map is made of the quickest quarter. Each of these may be off by half its round trip. The offset may be off by as
    // much, and the rate by twice as much over the three seconds, so twice as much at the ends.
    let allowed_s = round_trips_ns[29] as f64 * 0.5e-9;
    let middle_ns = samples[60].before_ns;
    for (at_ns, times) in [(samples[0].before_ns, 3.0), (middle_ns, 2.0), (samples[119].after_ns, 3.0)] {
        let error_ns = error_ns(&map, &device, at_ns);
        assert!(
            (error_ns.abs() as f64) < times * allowed_s * 1e9 + 2000.0,
            "{error_ns} ns, {allowed_s} s, {map:?}"
        );
    }
    assert!(map.sigma_s < 5e-3, "{map:?}");
    assert!((map.drift_ppm - 50.0).abs() < 2.0 * allowed_s / 3.0 * 1e6 + 1.0, "{allowed_s} s, {map:?}");
    assert!(map.contradiction_s <= map.sigma_s, "{map:?}");
}

#[test]
fn stamps_of_pictures_are_mapped_to_the_start_of_their_exposure() {
    let host = HostClock::start();
    let settings = drifting(2, None);
    let device = start(&settings, host);
    let mut camera = open(&settings, host);
    let samples = latches(&mut camera, 40, Duration::from_millis(10));
    let frames = take(&mut camera, 5);
    let map = LatchMap::of(&samples).unwrap();
    let sent = device.sent();
    let (frame, truth) = frames
        .iter()
        .find_map(|f| Some((f, sent.iter().find(|sent| Some(sent.device_ns) == f.device_ns)?)))
        .unwrap();
    let off_ns = map.host_ns(frame.device_ns.unwrap()) - truth.exposure_start_ns;
    assert!(off_ns.abs() < 5_000_000, "{off_ns} ns");
    assert!(truth.device_ns > EPOCH_NS);
}

#[test]
fn a_clock_that_is_set_shows_in_stamps_and_in_the_map() {
    let host = HostClock::start();
    let step = ClockStep { after_s: 0.8, by_ns: 250_000_000 };
    let settings = drifting(3, Some(step));
    let device = start(&settings, host);
    let mut camera = open(&settings, host);
    let before = latches(&mut camera, 30, Duration::from_millis(5));
    let frames = take(&mut camera, 60);
    device.step_clock(-1_000_000_000);
    let later = take(&mut camera, 30);
    let after = latches(&mut camera, 30, Duration::from_millis(5));
    let jump = |frames: &[trueline_camera::CameraFrame], by_ns: i64| {
        frames.windows(2).any(|pair| {
            let apart_ns = pair[1].device_ns.unwrap() - pair[0].device_ns.unwrap();
            let expected_ns = (pair[1].frame - pair[0].frame) as i64 * 20_000_000;
            (apart_ns - expected_ns - by_ns).abs() < 1000
        })
    };
    assert!(jump(&frames, step.by_ns), "{:?}", frames.len());
    assert!(jump(&later, -1_000_000_000));
    assert!(LatchMap::of(&before).unwrap().contradiction_s < 1e-3);
    let both = [before, after].concat();
    assert!(LatchMap::of(&both).unwrap().contradiction_s > 5e-3);
}
