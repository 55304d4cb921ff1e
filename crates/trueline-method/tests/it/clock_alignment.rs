//! Tests two streams without a common clock: the shift is found over any range, or an error gives the reason.

use trueline_dataset::{Measured, Recording};
use trueline_method::diagnose::clock_alignment::{AlignmentError, align, aligned};
use trueline_method::{Config, Status, calibrate};
use trueline_sim::{Preset, simulate};

/// A scan whose image stamps are `ahead_ns` ahead of the robot's.
fn apart(preset: Preset, seed: u64, ahead_ns: i64) -> Recording {
    let mut recording = simulate(&preset.scenario(), seed).unwrap();
    recording.features.iter_mut().for_each(|feature| feature.stamp_ns += ahead_ns);
    recording
}

fn check(recording: &Recording, ahead_ns: i64) {
    let found = align(recording, &Config::default(), |_| {}).unwrap();
    let moved = aligned(recording, found.images_ahead_ns);
    let calibration = calibrate(&moved, None, &Config::default()).unwrap();
    assert_eq!(calibration.status(), Status::Accepted, "{:?}", calibration.reasons());
    let truth_s = recording.truth.as_ref().unwrap().parameters.time_offset_s;
    // The removed and the estimated part together are the truth and the shift, in any division.
    let off_s =
        calibration.best_fit().time_offset_s - truth_s + (found.images_ahead_ns - ahead_ns) as f64 * 1e-9;
    let sigma_s = calibration.time_offset().unwrap().sigma_s.unwrap();
    assert!(off_s.abs() < 5.0 * sigma_s, "{off_s} at ± {sigma_s}");
}

#[test]
fn clocks_of_different_origin_are_aligned_whatever_lies_between_them() {
    // A camera's time since its start against the wall clock of 2026, in both directions, and a few seconds.
    check(&apart(Preset::Quick, 3, -1_795_000_000_123_456_789), -1_795_000_000_123_456_789);
    check(&apart(Preset::Profiler, 4, 7_654_321_000), 7_654_321_000);
}

#[test]
fn a_short_recording_of_the_sensor_is_found_in_a_long_one_of_the_robot() {
    let mut recording = apart(Preset::Quick, 5, 100_000_000_000);
    let first_ns = recording.features[0].stamp_ns;
    // From 5 s to 15 s of 20: the robot's log has no images at both ends.
    recording.features.retain(|f| (5_000_000_000..15_000_000_000).contains(&(f.stamp_ns - first_ns)));
    check(&recording, 100_000_000_000);
}

#[test]
fn a_third_of_wild_points_does_not_move_the_shift() {
    let mut recording = apart(Preset::Profiler, 6, -50_000_000_000);
    for (k, feature) in recording.features.iter_mut().enumerate() {
        if k % 3 == 0
            && let Measured::Profile([x, z]) = &mut feature.measured
        {
            // A random place in the sheet, independent of the motion.
            *x += 0.03 * ((k * 7919) as f64).sin();
            *z += 0.03 * ((k * 104_729) as f64).sin();
        }
    }
    let found = align(&recording, &Config::default(), |_| {}).unwrap();
    let truth_ns = -50_000_000_000 + (recording.truth.unwrap().parameters.time_offset_s * 1e9) as i64;
    // Rounded to a millisecond. The estimate itself is within a hundredth of that.
    assert!((found.images_ahead_ns - truth_ns).abs() < 600_000, "{found:?}");
}

#[test]
fn streams_of_different_scans_have_no_shift() {
    let mut recording = apart(Preset::Quick, 7, 40_000_000_000);
    recording.features = simulate(&Preset::Quick.scenario(), 8).unwrap().features;
    // The seam's places in another order: the same images, another motion.
    let measured: Vec<Measured> = recording.features.iter().map(|f| f.measured).collect();
    let count = measured.len();
    for (k, feature) in recording.features.iter_mut().enumerate() {
        feature.measured = measured[(k * 331) % count];
    }
    let refused = align(&recording, &Config::default(), |_| {}).unwrap_err();
    assert!(matches!(refused, AlignmentError::NoneFits { .. }), "{refused}");
    recording.features.truncate(20);
    assert!(matches!(align(&recording, &Config::default(), |_| {}), Err(AlignmentError::TooShort { .. })));
}
