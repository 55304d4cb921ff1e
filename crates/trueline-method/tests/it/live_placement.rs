//! Tests seam points of a stream against the simulator's, and against the same scan placed as a whole.

use nalgebra::Vector3;
use trueline_dataset::{Guess, Measured, Sensor};
use trueline_method::evaluate::live_placement::{LivePlacement, Placement};
use trueline_sim::{Disturbance, Preset, simulate};

#[test]
fn a_stream_in_the_order_of_its_arrival_is_placed_on_the_line() {
    for preset in [Preset::Quick, Preset::Profiler] {
        let mut scenario = preset.scenario();
        scenario.disturbance = Disturbance::default();
        let recording = simulate(&scenario, 11).unwrap();
        let truth = recording.truth.unwrap();
        let by = Guess { ..truth.parameters };
        let mut live = LivePlacement::new(recording.sensor.clone(), by);
        let mut features = recording.features.iter().peekable();
        let mut placed = 0;
        for sample in recording.robot {
            assert!(live.add_pose(sample) && !live.add_pose(sample));
            // Points that can be placed are placed at once, the others when their pose has come.
            while let Some(feature) = features.peek() {
                match live.place(feature.stamp_ns, feature.measured) {
                    Placement::At(point) => {
                        let off_m = truth.lines[feature.line as usize].distance(&point);
                        // Between samples 4 ms apart, at accelerations of up to 20 m/s²: 20 · (4 ms)² / 8 = 40 µm.
                        assert!(off_m < 40e-6, "{off_m}");
                        placed += 1;
                    }
                    Placement::TooEarly => break,
                    Placement::NoPose => {}
                    Placement::NoPoint(reason) => panic!("{reason:?}"),
                }
                features.next();
            }
        }
        assert!(placed * 10 > recording.features.len() * 8, "{placed} of {}", recording.features.len());
    }
}

#[test]
fn nothing_is_extrapolated() {
    let mut recording = simulate(&Preset::Profiler.scenario(), 1).unwrap();
    let by = Guess { time_offset_s: 0.0, ..recording.truth.unwrap().parameters };
    let mut live = LivePlacement::new(Sensor::Profiler, by);
    let measured = Measured::Profile([0.0, 0.3]);
    let first_ns = recording.robot[0].stamp_ns;
    assert_eq!(live.place(first_ns, measured), Placement::TooEarly);
    recording.robot.drain(10..60);
    for sample in &recording.robot[..30] {
        live.add_pose(*sample);
    }
    assert_eq!(live.place(first_ns - 1, measured), Placement::NoPose);
    assert!(matches!(live.place(first_ns, measured), Placement::At(_)));
    let gap_ns = recording.robot[9].stamp_ns + 1_000_000;
    assert_eq!(live.place(gap_ns, measured), Placement::NoPose);
    assert_eq!(live.place(recording.robot[29].stamp_ns + 1, measured), Placement::TooEarly);
    // A pixel is no measurement of a profiler.
    assert!(matches!(live.place(first_ns, Measured::Pixel([1.0, 2.0])), Placement::NoPoint(_)));
    // After more than five seconds the first poses are discarded.
    for sample in &recording.robot[30..] {
        live.add_pose(*sample);
    }
    assert_eq!(live.place(first_ns, measured), Placement::NoPose);
    let _: Vector3<f64> = match live.place(recording.robot[recording.robot.len() - 5].stamp_ns, measured) {
        Placement::At(point) => point,
        other => panic!("{other:?}"),
    };
}
