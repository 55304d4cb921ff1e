//! A wrong held value is named, and nothing else is blamed for it.

use nalgebra::Vector3;
use trueline_dataset::Recording;
use trueline_method::models::{Because, Block, Clock, Role};
use trueline_method::{Calibration, Config, DrawnLine, HeldSigma, Hold, Reason, SensorMode, calibrate};
use trueline_sim::noise::Noise;
use trueline_sim::{Preset, simulate_with_faults};

fn recording(fault: Option<&str>, seed: u64) -> Recording {
    let faults: Vec<_> = fault.map(|fault| fault.parse().unwrap()).into_iter().collect();
    simulate_with_faults(&Preset::Good.scenario(), &faults, seed).unwrap()
}

/// Codes of reasons and warnings, without those about stamps.
fn codes(c: &Calibration) -> (Vec<&'static str>, Vec<&'static str>) {
    let warnings = c.warnings().iter().map(trueline_method::Warning::code);
    (
        c.reasons().iter().map(Reason::code).collect(),
        warnings.filter(|code| !code.contains("stamps")).collect(),
    )
}

/// Half a degree looked like a robot that is off by 0.6 mm, and a quarter of a millimetre like another lens.
#[test]
fn a_held_sensor_that_is_off_is_the_only_thing_to_be_named() {
    let config = Config { sensor: SensorMode::Fixed, ..Config::default() };
    for (fault, seed) in [
        ("plane-tilt-stripe=0.5", 3),
        ("plane-tilt-stripe=0.5", 11),
        ("plane-offset=0.25", 3),
        ("focal=0.5", 5),
    ] {
        let c = calibrate(&recording(Some(fault), seed), None, &config).unwrap();
        assert_eq!(codes(&c), (vec!["sensor-off"], vec![]), "{fault} {seed}");
        assert!(
            c.findings.checks.seam_error.is_none(),
            "a fit that is refused for its sensor claims no accuracy"
        );
    }
}

#[test]
fn a_held_sensor_that_is_right_is_not_named() {
    let config = Config { sensor: SensorMode::Fixed, ..Config::default() };
    for seed in 1..5 {
        let c = calibrate(&recording(None, seed), None, &config).unwrap();
        assert_eq!(codes(&c), (vec![], vec![]), "{seed}");
    }
}

const SIGMA_M: f64 = 0.1e-3;
/// Distance of the two drawn points, m.
const APART_M: f64 = 0.1;

/// The true seam, drawn by two points, each with an error.
fn drawn(recording: &Recording, off_m: [Vector3<f64>; 2]) -> Config {
    let line = recording.truth.as_ref().unwrap().lines[0];
    let amid = recording.robot[recording.robot.len() / 2].base_from_tool.translation.vector;
    let middle = *line.anchored_near(&amid).anchor();
    let ends = [-0.5, 0.5].map(|part| middle + line.direction() * (part * APART_M));
    let points = [ends[0] + off_m[0], ends[1] + off_m[1]];
    Config { drawn_lines: vec![DrawnLine::through(0, points, SIGMA_M).unwrap()], ..Config::default() }
}

#[test]
fn a_line_drawn_in_the_wrong_place_is_named_with_how_far_it_is_off() {
    let scan = recording(None, 3);
    let across = scan.truth.as_ref().unwrap().lines[0].axes().column(1).into_owned();
    for off_m in [1e-3, -5e-3] {
        let c = calibrate(&scan, None, &drawn(&scan, [across * off_m; 2])).unwrap();
        assert_eq!(codes(&c), (vec!["drawn-line-off"], vec![]), "{off_m}");
        let (beside_m, sigma_m) = c.findings.checks.drawn_line_shifts[0].beside_m.unwrap();
        // Two components with their uncertainties: chance exceeds five of them once in a hundred thousand.
        assert!((beside_m - off_m.abs()).abs() < 5.0 * sigma_m && sigma_m < 0.3e-3, "{beside_m} {sigma_m}");
    }
}

#[test]
fn a_line_drawn_across_the_seam_is_named_with_its_turn() {
    let scan = recording(None, 3);
    let line = scan.truth.as_ref().unwrap().lines[0];
    let (along, across) = (line.direction() * (0.5 * APART_M), line.axes().column(1) * (0.5 * APART_M));
    let c = calibrate(&scan, None, &drawn(&scan, [along - across, across - along])).unwrap();
    assert_eq!(codes(&c), (vec!["drawn-line-off"], vec![]));
    let (turned_rad, sigma_rad) = c.findings.checks.drawn_line_shifts[0].turned_rad.unwrap();
    assert!((turned_rad - std::f64::consts::FRAC_PI_2).abs() < 5.0 * sigma_rad, "{turned_rad} {sigma_rad}");
}

/// Drawings as accurate as stated, with scans that show the seam ten times better. None is refused. A worse answer because
/// of the drawing is reported, and no robot or bent seam is blamed for its error.
#[test]
fn a_drawing_with_its_stated_accuracy_is_not_refused() {
    let mut noise = Noise::new(5, 17);
    for seed in 1..9 {
        let scan = recording(None, seed);
        let off = [(); 2].map(|()| Vector3::from_fn(|_, _| noise.normal(SIGMA_M)));
        let c = calibrate(&scan, None, &drawn(&scan, off)).unwrap();
        let (reasons, warnings) = codes(&c);
        let usual = |code: &&str| ["drawn-line-not-needed", "unusual-noise"].contains(code);
        assert!(reasons.is_empty(), "{seed}: {reasons:?}");
        assert!(warnings.contains(&"drawn-line-not-needed") && warnings.iter().all(usual), "{warnings:?}");
    }
}

/// A held value is tested by releasing it: both models are listed, and the one with more freedom fits at least as well.
#[test]
fn models_that_were_fitted_beside_the_answer_are_listed() {
    let scan = recording(Some("plane-tilt-stripe=0.5"), 3);
    let held = calibrate(&scan, None, &Config { sensor: SensorMode::Fixed, ..Config::default() }).unwrap();
    let [asked, others @ ..] = &held.findings.models_tried[..] else { panic!("no model") };
    assert_eq!(
        (asked.because, asked.role(Block::Sensor), asked.clock),
        (Because::Asked, Role::Held, Clock::Even)
    );
    assert!(others.iter().all(|model| !model.because.is_taken()));
    let released = others.iter().find(|model| model.role(Block::Sensor) == Role::Estimated).unwrap();
    assert_eq!(released.because, Because::TestsWhatIsHeld);
    // Half a degree over 20 s: hundreds of units of the log likelihood.
    assert!(released.log_evidence > asked.log_evidence + 100.0, "{asked:?} {released:?}");
    // A correct sensor that is not held needs no other model.
    let plain = calibrate(&recording(None, 3), None, &Config::default()).unwrap();
    let [only] = &plain.findings.models_tried[..] else { panic!("{:?}", plain.findings.models_tried) };
    let of = [Block::Sensor, Block::TimeOffset, Block::Line].map(|block| only.role(block));
    assert_eq!(of, [Role::Estimated; 3]);
}

/// The truth with a time offset that is off by so much, s, and a sensor that is shifted by so much, m.
fn guess_off(scan: &Recording, late_s: f64, shift_m: f64) -> trueline_dataset::Guess {
    let mut guess = scan.truth.as_ref().unwrap().parameters;
    guess.time_offset_s += late_s;
    guess.tool_from_camera.translation.vector.y += shift_m;
    guess
}

#[test]
fn what_fix_holds_wrongly_is_the_only_thing_to_be_named() {
    let scan = recording(None, 3);
    for (hold, late_s, shift_m) in
        [(Hold::TimeOffset, 2e-3, 0.0), (Hold::TimeOffset, -10e-3, 0.0), (Hold::HandEye, 0.0, 5e-3)]
    {
        let held = Config { hold: vec![hold], ..Config::default() };
        let c = calibrate(&scan, Some(&guess_off(&scan, late_s, shift_m)), &held).unwrap();
        assert_eq!(codes(&c), (vec!["held-off"], vec![]), "{hold:?} {late_s} {shift_m}");
        let right = calibrate(&scan, Some(&guess_off(&scan, 0.0, 0.0)), &held).unwrap();
        assert_eq!(codes(&right).0, Vec::<&str>::new(), "{hold:?}");
    }
    // A stated uncertainty that covers the error: nothing is contradicted.
    let held_sigma = HeldSigma { time_s: Some(1e-3), ..HeldSigma::default() };
    let held = Config { hold: vec![Hold::TimeOffset], held_sigma, ..Config::default() };
    let c = calibrate(&scan, Some(&guess_off(&scan, 2e-3, 0.0)), &held).unwrap();
    assert!(!codes(&c).0.contains(&"held-off"), "{:?}", codes(&c));
}
