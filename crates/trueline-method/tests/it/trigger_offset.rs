//! Tests a simulated scan with exposures wired to a robot input: measured and estimated offset agree, and a late input is detected.

use trueline_dataset::Recording;
use trueline_method::evaluate::trigger_offset::{TriggerEdges, measured_offset};
use trueline_method::{Config, calibrate};
use trueline_sim::{Preset, simulate};

const EXPOSURE_S: f64 = 0.006;

/// The edges of an input with this delay, in a scan with a known true offset. Every image was exposed about the time of its
/// stamp minus the offset, and the robot reads its inputs with every sample.
fn wired(recording: &Recording, late_s: f64) -> TriggerEdges {
    let offset_s = recording.truth.as_ref().unwrap().parameters.time_offset_s;
    let robot_ns: Vec<i64> = recording.robot.iter().map(|sample| sample.stamp_ns).collect();
    let between = recording.features.iter().filter_map(|feature| {
        let began_ns = feature.stamp_ns - ((offset_s + 0.5 * EXPOSURE_S - late_s) * 1e9) as i64;
        let after = robot_ns.partition_point(|stamp_ns| *stamp_ns < began_ns);
        Some([*robot_ns.get(after.checked_sub(1)?)?, *robot_ns.get(after)?])
    });
    TriggerEdges { between_ns: between.collect(), exposure_s: EXPOSURE_S }
}

#[test]
fn measured_and_estimated_offset_agree_and_a_late_input_is_named() {
    for seed in [1, 2, 3] {
        let recording = simulate(&Preset::Quick.scenario(), seed).unwrap();
        let truth_s = recording.truth.as_ref().unwrap().parameters.time_offset_s;
        let calibration = calibrate(&recording, None, &Config::default()).unwrap();
        let measured = measured_offset(&recording, &wired(&recording, 0.0), &calibration).unwrap();
        assert!(measured.agrees(), "{measured}");
        assert!(
            (measured.offset_s - truth_s).abs() < 4.0 * measured.sigma_s,
            "{measured}, truth {truth_s} s"
        );
        assert!(measured.to_string().contains("they agree"), "{measured}");
        // 5 ms late: the exposure seems to begin later, and the stamp to be less late.
        let late = measured_offset(&recording, &wired(&recording, 0.005), &calibration).unwrap();
        assert!(!late.agrees() && late.to_string().contains("they contradict each other"), "{late}");
        let shift_s = late.offset_s - measured.offset_s;
        assert!((shift_s + 0.005).abs() < 4.0 * late.sigma_s.hypot(measured.sigma_s), "{shift_s} s");
    }
}

#[test]
fn edges_of_nothing_that_was_seen_measure_nothing() {
    let recording = simulate(&Preset::Quick.scenario(), 1).unwrap();
    let calibration = calibrate(&recording, None, &Config::default()).unwrap();
    let mut few = wired(&recording, 0.0);
    few.between_ns.truncate(9);
    assert_eq!(measured_offset(&recording, &few, &calibration), None);
    assert_eq!(measured_offset(&recording, &TriggerEdges::default(), &calibration), None);
}
