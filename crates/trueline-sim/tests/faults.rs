//! Each fault has its stated effect at its place, and no other.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

use nalgebra::{Point3, Vector3};
use trueline_dataset::{Measured, Recording, Sensor};
use trueline_geometry::Line;
use trueline_sim::faults::FAULT_NAMES;
use trueline_sim::{Between, Disturbance, Fault, Preset, Scenario, simulate, simulate_with_faults};

fn quiet(preset: Preset) -> Scenario {
    let mut scenario = preset.scenario();
    scenario.disturbance = Disturbance::default();
    scenario.timing.duration_s = 8.0;
    scenario.timing.robot_period_s = 0.0008;
    scenario
}

fn with(fault: &str) -> Recording {
    simulate_with_faults(&quiet(Preset::Quick), &[fault.parse().unwrap()], 3).unwrap()
}

fn without() -> Recording {
    simulate(&quiet(Preset::Quick), 3).unwrap()
}

fn camera(recording: &Recording) -> (trueline_model::Camera, trueline_geometry::Plane) {
    match &recording.sensor {
        Sensor::CameraLaser { camera, laser_plane_in_camera } => (*camera, *laser_plane_in_camera),
        other => panic!("{other:?}"),
    }
}

/// Points in base of all features, by the stated sensor, the true hand-eye transform and the reported poses.
fn points_in_base(recording: &Recording) -> Vec<Vector3<f64>> {
    let (camera, plane) = camera(recording);
    let truth = recording.truth.as_ref().unwrap();
    let times: Vec<f64> = recording.robot.iter().map(|s| s.stamp_ns as f64 * 1e-9).collect();
    let point = |f: &trueline_dataset::Feature| {
        let Measured::Pixel([u, v]) = f.measured else { panic!() };
        let ray = camera.ray(&nalgebra::Vector2::new(u, v)).ok()?.0;
        let point = ray * (plane.offset() / plane.normal().dot(&ray));
        let time_s = f.stamp_ns as f64 * 1e-9 - truth.parameters.time_offset_s;
        let after = times.partition_point(|t| *t < time_s);
        let (before, next) = (recording.robot.get(after.checked_sub(1)?)?, recording.robot.get(after)?);
        let part = (time_s - times[after - 1]) / (times[after] - times[after - 1]);
        let pose = before.base_from_tool.lerp_slerp(&next.base_from_tool, part);
        Some((pose * truth.parameters.tool_from_camera * Point3::from(point)).coords)
    };
    recording.features.iter().filter_map(point).collect()
}

/// Largest distance of the features from the true line, m.
fn worst_m(recording: &Recording) -> f64 {
    let line: Line = recording.truth.as_ref().unwrap().lines[0];
    points_in_base(recording).iter().map(|p| line.distance(p)).fold(0.0, f64::max)
}

#[test]
fn without_faults_every_feature_is_on_the_line() {
    // Samples 0.8 ms apart of a path of 0.5 Hz and 20 mm: the chord is 2e-8 m off; stamps are whole nanoseconds.
    assert!(worst_m(&without()) < 1e-7);
    let same = simulate_with_faults(&quiet(Preset::Quick), &[], 3).unwrap();
    assert_eq!(same.features, without().features);
    assert_eq!(same.robot, without().robot);
}

#[test]
fn every_fault_has_a_name_that_reads_back_and_changes_the_recording() {
    let reference = without();
    let profiles = simulate(&quiet(Preset::Profiler), 3).unwrap();
    for kind in &FAULT_NAMES {
        let fault: Fault = kind.name.parse().unwrap();
        assert_eq!(Some(fault), kind.of(kind.defaults));
        let of_profiler = kind.name.starts_with("profile-");
        let preset = if of_profiler { Preset::Profiler } else { Preset::Quick };
        let spoilt = simulate_with_faults(&quiet(preset), &[fault], 3).unwrap();
        let reference = if of_profiler { &profiles } else { &reference };
        let same = spoilt.sensor == reference.sensor
            && spoilt.features == reference.features
            && spoilt.robot == reference.robot;
        assert!(!same, "{} changes nothing", kind.name);
        assert_eq!(spoilt.truth, reference.truth, "{}", kind.name);
    }
    for wrong in ["plane", "plane-offset=x", "plane-offset=1,2", "bursts=1", "wobble=nan"] {
        assert!(wrong.parse::<Fault>().is_err(), "{wrong}");
    }
}

#[test]
fn a_stated_sensor_is_off_by_what_was_asked() {
    let (true_camera, true_plane) = camera(&without());
    let (_, plane) = camera(&with("plane-offset=0.25"));
    assert!((plane.offset() - true_plane.offset() - 0.25e-3).abs() < 1e-12);
    assert!(plane.normal().angle(true_plane.normal()) < 1e-7);
    for about in ["stripe", "range"] {
        let (_, plane) = camera(&with(&format!("plane-tilt-{about}=0.5")));
        assert!((plane.normal().angle(true_plane.normal()).to_degrees() - 0.5).abs() < 1e-6, "{about}");
        // The middle of the field of view stays on the plane.
        let middle = Vector3::new(0.0, 0.0, true_plane.offset() / true_plane.normal().z);
        assert!(plane.signed_distance(&middle).abs() < 1e-12);
    }
    let (stated, _) = camera(&with("focal=0.5"));
    assert!((stated.focal.x / true_camera.focal.x - 1.005).abs() < 1e-12);
    assert!((camera(&with("principal-point-v=20")).0.centre.y - true_camera.centre.y - 20.0).abs() < 1e-9);
}

#[test]
fn a_bow_leaves_the_line_by_its_sagitta_at_the_ends_and_not_in_the_middle() {
    for name in ["bow-across", "bow-height"] {
        let recording = with(&format!("{name}=0.5"));
        let line = recording.truth.as_ref().unwrap().lines[0];
        let half_m = 0.15;
        for point in points_in_base(&recording) {
            let along = line.direction().dot(&(point - line.anchor()));
            // A circle's sagitta differs from the parabola's by (s/ℓ)⁴·sagitta³/ℓ²: 1e-8 m here.
            let expected = 0.5e-3 * (along / half_m).powi(2);
            assert!((line.distance(&point) - expected).abs() < 2e-7, "{name} at {along}");
        }
    }
}

#[test]
fn wobble_and_correlated_noise_have_their_size_and_correlation() {
    let mut scenario = quiet(Preset::Quick);
    scenario.timing.duration_s = 60.0;
    let offsets = |fault: &str| -> Vec<f64> {
        let recording = simulate_with_faults(&scenario, &[fault.parse().unwrap()], 5).unwrap();
        let line = recording.truth.as_ref().unwrap().lines[0];
        let across = scenario.cell.approach.cross(&line.direction()).normalize();
        points_in_base(&recording).iter().map(|p| (p - line.anchor()).dot(&across)).collect()
    };
    let figures = |x: &[f64]| {
        let variance = x.iter().map(|v| v * v).sum::<f64>() / x.len() as f64;
        let lag = x.windows(2).map(|w| w[0] * w[1]).sum::<f64>() / (x.len() - 1) as f64;
        (variance.sqrt(), lag / variance)
    };
    // 1980 frames with lag-1 correlation 0.63: σ to 1/√(2·1980/2.3) = 2.4 %, ρ to √((1 − ρ²)/n) = 0.018; four of these.
    let (sigma, rho) = figures(&offsets("correlated-noise=0.2"));
    assert!((sigma / 0.2e-3 - 1.0).abs() < 0.1, "{sigma}");
    assert!((rho - 0.63).abs() < 0.07, "{rho}");
    // 5 mm/s at 33 Hz are 0.15 mm a frame: ρ = exp(−0.15/0.5) = 0.74 for a correlation length of 0.5 mm.
    let (sigma, rho) = figures(&offsets("wobble=0.1,0.5"));
    assert!((sigma / 0.1e-3 - 1.0).abs() < 0.12, "{sigma}");
    assert!((rho - 0.74).abs() < 0.07, "{rho}");
}

#[test]
fn robot_errors_have_their_size() {
    // A field's waves are few: its RMS over one path scatters by a third.
    let field = worst_m(&with("robot-field=0.2,500"));
    assert!(field > 0.05e-3 && field < 1.2e-3, "{field}");
    let backlash = worst_m(&with("backlash=0.1"));
    assert!(backlash > 0.04e-3 && backlash < 0.1e-3, "{backlash}");
    // 10 mm at 0.47 Hz accelerate by 0.09 m/s².
    let flex = worst_m(&with("flex=0.2"));
    assert!(flex > 0.01e-3 && flex < 0.05e-3, "{flex}");
    assert!(worst_m(&with("robot-arm=0.3")) > 0.05e-3);
    assert!(worst_m(&with("attitude-lag=2")) > 0.01e-3);
}

/// A lag whose movement is slow is a delay by the time constant.
#[test]
fn a_command_lag_delays_by_its_time_constant() {
    let lagging = {
        let mut recording = with("command-lag=20");
        recording.truth.as_mut().unwrap().parameters.time_offset_s += 0.020;
        worst_m(&recording)
    };
    // Of 10 mm at 0.47 Hz: (ωτ)²/2 · 10 mm = 0.017 mm, and as much of the other movements.
    assert!(lagging < 0.1e-3, "{lagging}");
    assert!(worst_m(&with("command-lag=20")) > 0.3e-3);
}

#[test]
fn biases_follow_their_tilt() {
    let reference = without();
    let biased = with("bias-work-angle=0.2");
    let shift = |k: usize| match (biased.features[k].measured, reference.features[k].measured) {
        (Measured::Pixel(b), Measured::Pixel(r)) => b[1] - r[1],
        _ => panic!(),
    };
    // Work angles of the preset: 10° ± 15°, so up to 25° and half a pixel; the other tilts change the rotation vector a
    // little.
    let (least, most) =
        (0..reference.features.len()).map(shift).fold((9.0_f64, -9.0_f64), |(a, b), x| (a.min(x), b.max(x)));
    assert!((most - 0.5).abs() < 0.1 && (least + 0.1).abs() < 0.1, "{least} {most}");
}

#[test]
fn a_rolling_shutter_delays_rows_and_not_the_middle_one() {
    let (reference, rolling) = (without(), with("rolling-shutter=10"));
    let (camera, _) = camera(&reference);
    for (r, s) in reference.features.iter().zip(&rolling.features) {
        let (Measured::Pixel(a), Measured::Pixel(b)) = (r.measured, s.measured) else { panic!() };
        let moved = (a[0] - b[0]).hypot(a[1] - b[1]);
        let delay_s = 0.010 * ((b[1] + 0.5) / f64::from(camera.size[1]) - 0.5);
        // The seam moves by less than 2000 px/s in this scan.
        assert!(moved <= 2000.0 * delay_s.abs() + 1e-9, "{moved} px in {delay_s} s");
    }
    assert!(worst_m(&rolling) > 0.01e-3);
}

#[test]
fn streams_are_spoilt_as_asked() {
    let reference = without();
    assert!(with("image-grain=10").features.iter().all(|f| f.stamp_ns % 10_000_000 == 0));
    assert!(with("robot-grain=4").robot.iter().all(|s| s.stamp_ns % 4_000_000 == 0));
    let delay = |fault: &str, k: usize| with(fault).features[k].stamp_ns - reference.features[k].stamp_ns;
    let last = reference.features.len() - 1;
    assert!((delay("offset-drift=2", last) - delay("offset-drift=2", 0) - 2_000_000).abs() < 20_000);
    assert_eq!((delay("offset-step=1", 0), delay("offset-step=1", last)), (0, 1_000_000));
    let period_ns = 1_000_000_000.0 / 33.0;
    assert!((delay("frame-slip=1", last) as f64 - period_ns).abs() < 2.0);
    let late = with("late-arrival=5").features;
    assert!(late.windows(2).all(|w| w[0].stamp_ns <= w[1].stamp_ns));
    assert!(late.iter().zip(&reference.features).all(|(l, r)| l.stamp_ns >= r.stamp_ns));
    let lost = with("uncounted-losses=20").features;
    assert!(lost.len() < reference.features.len());
    assert!(lost.windows(2).all(|w| w[1].frame.unwrap() == w[0].frame.unwrap() + 1));
    let doubled = with("doubled-frames=20").features;
    let repeats = doubled.windows(2).filter(|w| w[0].measured == w[1].measured).count() as f64;
    // Binomial: 0.2 of 263, four standard deviations of 6.5.
    assert!((repeats - 0.2 * doubled.len() as f64).abs() < 26.0, "{repeats}");
}

#[test]
fn the_path_is_followed_in_base_or_in_the_sensor() {
    use trueline_sim::{Progress, TrackedIn};
    let mut scenario = quiet(Preset::Quick);
    scenario.timing.between = Between::Smooth;
    for tracked_in in [TrackedIn::Sensor, TrackedIn::Base] {
        for (progress, passes) in
            [(Progress::Even, 1), (Progress::Eased, 1), (Progress::Eased, 2), (Progress::Even, 3)]
        {
            scenario.scan.tracked_in = tracked_in;
            (scenario.scan.progress, scenario.scan.passes) = (progress, passes);
            let recording = simulate(&scenario, 1).unwrap();
            // Acceleration doubles where passes turn around sharply; see above.
            assert!(worst_m(&recording) < 1e-4, "{tracked_in:?} {progress:?} {passes}");
            let line = recording.truth.as_ref().unwrap().lines[0];
            let along: Vec<f64> = points_in_base(&recording)
                .iter()
                .map(|p| line.direction().dot(&(p - line.anchor())))
                .collect();
            let runs_back = along.windows(30).any(|w| w[29] < w[0] - 0.005);
            assert_eq!(runs_back, passes > 1, "{progress:?} {passes}");
        }
    }
}
