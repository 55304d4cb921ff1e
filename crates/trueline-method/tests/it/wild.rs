//! Tests corrupted recordings: the correct answer with an honest sigma, or a refusal that reports the cause.

use trueline_dataset::{Guess, Recording};
use trueline_geometry::se3;
use trueline_method::assess::outlier_segments::Cause;
use trueline_method::verdict::{Quantity, StreamName};
use trueline_method::{Calibration, Config, Hold, Reason, Requirement, Stamps, Status, Warning, calibrate};
use trueline_sim::faults::Event;
use trueline_sim::{Fault, Preset, Scenario, random_cell, simulate, simulate_with_faults};

fn calibrated(recording: &Recording) -> Calibration {
    calibrate(recording, None, &Config::default()).unwrap()
}

fn stepped(calibration: &Calibration) -> bool {
    let is_step = |r: &Reason| matches!(r, Reason::OtherTimeOffset { .. } | Reason::ClockStep { .. });
    calibration.reasons().iter().any(is_step)
}

fn cell(preset: Preset, seed: u64) -> Scenario {
    random_cell(&preset.scenario(), seed, 1.0)
}

/// Largest error of the seven sensor unknowns in standard deviations.
fn largest_error(calibration: &Calibration, truth: &Guess) -> f64 {
    let (turn, shift) =
        se3::difference_decoupled(calibration.file_tool_from_camera(), &truth.tool_from_camera);
    let offset = calibration.best_fit().time_offset_s - truth.time_offset_s;
    let errors = [offset, turn.x, turn.y, turn.z, shift.x, shift.y, shift.z];
    let sigmas = (0..7).map(|k| calibration.sigma(k).unwrap());
    errors.iter().zip(sigmas).map(|(e, s)| (e / s).abs()).fold(0.0, f64::max)
}

/// Seven unknowns of a dozen scans: the largest of 84 normal numbers exceeds 5 once in 20,000 times.
const SIGMAS: f64 = 5.0;

fn assert_right(recording: &Recording, what: &str) -> Calibration {
    let calibration = calibrated(recording);
    assert_eq!(calibration.status(), Status::Accepted, "{what}: {:?}", calibration.reasons());
    let largest = largest_error(&calibration, &recording.truth.as_ref().unwrap().parameters);
    assert!(largest < SIGMAS, "{what}: {largest}");
    calibration
}

/// A scan in a random cell with an event.
fn spoilt(event: Event, seed: u64) -> Recording {
    simulate_with_faults(&cell(Preset::Quick, seed), &[Fault::Event(event)], seed).unwrap()
}

#[test]
fn mendable_events_are_mended() {
    for event in [Event::Bursts, Event::SecondLine, Event::RobotGaps, Event::DuplicateRows] {
        for seed in 0..4 {
            assert_right(&spoilt(event, seed), &format!("{event:?} {seed}"));
        }
    }
}

#[test]
fn bursts_and_a_second_line_are_named_with_their_time() {
    let bursts = assert_right(&spoilt(Event::Bursts, 1), "bursts");
    assert_eq!(bursts.findings.checks.outlier_segments.len(), 3);
    assert!(bursts.findings.checks.outlier_segments.iter().all(|d| (18..=22).contains(&d.features)));
    let astray = assert_right(&spoilt(Event::SecondLine, 2), "second line");
    let [only] = astray.findings.checks.outlier_segments[..] else {
        panic!("{:?}", astray.findings.checks.outlier_segments)
    };
    // The edge is 5 mm away. A line through 165 points of 0.04 mm noise, including tilts, is accurate to 0.05.
    let Cause::OtherLine(beside_m) = only.cause else { panic!("{only:?}") };
    assert!((beside_m - 0.005).abs() < 5e-5, "{beside_m}");
    assert!(
        astray.warnings().iter().any(|w| matches!(w, Warning::OtherLine { .. })),
        "{:?}",
        astray.warnings()
    );
}

#[test]
fn a_clock_that_steps_is_refused_and_the_step_named() {
    for (event, step_s) in [(Event::RobotClockStep, -0.080), (Event::LateImages, 0.045)] {
        for seed in 0..3 {
            let calibration = calibrated(&spoilt(event, seed));
            assert_eq!(calibration.status(), Status::NotAccepted, "{event:?} {seed}");
            let found = calibration.findings.checks.outlier_segments.iter().find_map(|d| match d.cause {
                Cause::ClockStep(found_s) => Some(found_s),
                _ => None,
            });
            // Both parts' offsets are known to some 0.1 ms before any refinement.
            let found = found.unwrap_or_else(|| panic!("{:?}", calibration.reasons()));
            assert!((found - step_s).abs() < 1e-3, "{event:?} {seed}: {found}");
            assert!(stepped(&calibration), "{:?}", calibration.reasons());
        }
    }
}

#[test]
fn a_small_step_is_found_where_it_is() {
    let mut recording = simulate(&Preset::Quick.scenario(), 3).unwrap();
    let at_ns = recording.robot[2500].stamp_ns;
    for feature in recording.features.iter_mut().filter(|f| f.stamp_ns >= at_ns) {
        feature.stamp_ns += 1_000_000;
    }
    let calibration =
        calibrate(&recording, None, &Config { stamps: Stamps::Raw, ..Config::default() }).unwrap();
    assert_eq!(calibration.status(), Status::NotAccepted);
    let step = calibration.findings.clock.step.unwrap();
    assert!((step.step_s - 1e-3).abs() < 4.0 * step.sigma_s, "{step:?}");
    // A tenth of the scan: the step is visible only where the seam moves across.
    assert!((step.at_s - 10.0).abs() < 2.0, "{step:?}");
}

#[test]
fn a_drift_is_taken_out_and_reported() {
    let mut scenario = Preset::Quick.scenario();
    scenario.disturbance.clock_drift_ppm = 150.0;
    let recording = simulate(&scenario, 4).unwrap();
    let calibration = calibrated(&recording);
    assert_eq!(calibration.status(), Status::Accepted, "{:?}", calibration.reasons());
    let drift = calibration.findings.clock.drift.unwrap();
    assert!((drift.ppm - 150.0).abs() < 4.0 * drift.sigma_ppm, "{drift:?}");
    // The offset holds in the middle. There it is the start's plus the drift until then.
    let truth = recording.truth.unwrap().parameters;
    let then = Guess { time_offset_s: truth.time_offset_s + 150e-6 * (drift.about_s - 0.01773), ..truth };
    assert!(largest_error(&calibration, &then) < SIGMAS);
    assert!(
        calibration.warnings().iter().any(|w| matches!(w, Warning::ClockDrift { .. })),
        "{:?}",
        calibration.warnings()
    );
}

#[test]
fn a_steady_scan_shows_neither_step_nor_drift_nor_disagreement() {
    for seed in 10..16 {
        let recording = simulate(&cell(Preset::TwoLines, seed), seed).unwrap();
        let calibration = assert_right(&recording, "steady");
        assert!(calibration.warnings().is_empty(), "{:?}", calibration.warnings());
        assert!(calibration.findings.checks.outlier_segments.is_empty());
    }
}

/// A bent edge is no straight line, so the parts of the scan disagree.
#[test]
fn parts_that_disagree_are_a_warning_with_a_number() {
    let mut recording = simulate(&Preset::Quick.scenario(), 5).unwrap();
    let count = recording.robot.len();
    // The robot sags by 0.3 mm over the last third.
    for (k, sample) in recording.robot.iter_mut().enumerate().skip(2 * count / 3) {
        let part = (k - 2 * count / 3) as f64 / count as f64;
        sample.base_from_tool.translation.z -= 0.9e-3 * part;
    }
    let calibration = calibrated(&recording);
    let disagrees = |w: &Warning| {
        matches!(w, Warning::CrossValidationShift { .. } | Warning::CrossValidationMisfit { .. })
    };
    assert!(calibration.warnings().iter().any(disagrees), "{:?}", calibration.warnings());
    let held_out = calibration.findings.checks.held_out.unwrap();
    assert!(held_out.rms_m > 1.05 * held_out.fitted_rms_m);
}

#[test]
fn unobservable_directions_can_be_held_at_a_guess() {
    let recording = simulate(&Preset::ConstantAttitude.scenario(), 6).unwrap();
    let truth = recording.truth.as_ref().unwrap().parameters;
    let mut guess = truth;
    guess.tool_from_camera.translation.vector += nalgebra::Vector3::new(1e-3, -2e-3, 0.5e-3);
    let config = Config { accept_partial: true, ..Config::default() };
    let calibration = calibrate(&recording, Some(&guess), &config).unwrap();
    assert_eq!(calibration.status(), Status::Accepted, "{:?}", calibration.reasons());
    assert!(calibration.findings.unknowns.held_at_guess);
    assert_eq!(calibration.findings.unknowns.observability.rank, 8);
    // Held to a nanometre each.
    let off = calibration.best_fit().tool_from_camera.translation.vector
        - guess.tool_from_camera.translation.vector;
    assert!(off.norm() < 1e-8, "{off}");
    assert!((4..7).all(|k| calibration.sigma(k).is_none() && calibration.is_known(k)));
    assert!(calibration.warnings().iter().any(|w| matches!(w, Warning::HeldAtGuess { .. })));
    let offset = (calibration.best_fit().time_offset_s - truth.time_offset_s) / calibration.sigma(0).unwrap();
    assert!(offset.abs() < SIGMAS, "{offset}");
    // Without a guess there is no value to hold.
    assert!(calibrate(&recording, None, &config).is_err());
}

#[test]
fn accuracy_that_is_asked_for_is_reached_or_refused() {
    let recording = simulate(&Preset::Weak.scenario(), 7).unwrap();
    let asked =
        |require: Requirement| calibrate(&recording, None, &Config { require, ..Config::default() }).unwrap();
    let strict = asked(Requirement { translation_m: Some(1e-4), ..Requirement::default() });
    assert_eq!(strict.status(), Status::NotAccepted);
    assert!(
        matches!(strict.reasons()[0], Reason::RequirementMissed { quantity: Quantity::Translation, .. }),
        "{:?}",
        strict.reasons()
    );
    let easy = Requirement {
        time_s: Some(1e-3),
        rotation_rad: Some(0.1),
        translation_m: Some(0.01),
        ..Requirement::default()
    };
    assert_eq!(asked(easy).status(), Status::Accepted);
    let held = Config { hold: vec![Hold::HandEye], require: easy, ..Config::default() };
    let truth = recording.truth.as_ref().unwrap().parameters;
    assert_eq!(calibrate(&recording, Some(&truth), &held).unwrap().status(), Status::NotAccepted);
}

#[test]
fn outliers_and_drops_at_once() {
    for seed in 20..24 {
        let mut scenario = cell(Preset::Quick, seed);
        scenario.disturbance.outlier_fraction = 0.4;
        scenario.disturbance.drop_fraction = 0.1;
        let recording = simulate(&scenario, seed).unwrap();
        let calibration = assert_right(&recording, "40 % outliers");
        assert_eq!(calibration.findings.fit.feature_stamps_ns.len(), calibration.findings.fit.features.len());
    }
}

/// Some controllers give 20 Hz: between two samples the path bends by tenths of a millimetre.
#[test]
fn slow_robot_streams() {
    for (period_s, preset) in
        [(0.012, Preset::Quick), (0.024, Preset::Paper), (0.05, Preset::Quick), (0.1, Preset::Quick)]
    {
        let mut scenario = cell(preset, 7);
        scenario.timing.robot_period_s = period_s;
        let recording = simulate(&scenario, 7).unwrap();
        assert_right(&recording, &format!("{period_s} s"));
    }
}

/// A controller with a new pose at every third poll.
#[test]
fn poses_that_only_repeat_are_left_out() {
    let mut recording = simulate(&cell(Preset::Quick, 8), 8).unwrap();
    for k in 0..recording.robot.len() {
        recording.robot[k].base_from_tool = recording.robot[k - k % 3].base_from_tool;
    }
    let calibration = assert_right(&recording, "held poses");
    assert!(
        calibration.warnings().iter().any(|w| matches!(w, Warning::RepeatedPoses { .. })),
        "{:?}",
        calibration.warnings()
    );
}

/// Four in ten samples are lost, one or two in succession.
#[test]
fn a_lossy_robot_stream_is_right_and_said_to_be_one() {
    let missing = |calibration: &Calibration| {
        calibration.warnings().iter().find_map(|w| match w {
            Warning::RobotSamplesMissing { missing, of } => Some((*missing, *of)),
            _ => None,
        })
    };
    let mut recording = simulate(&cell(Preset::Quick, 8), 8).unwrap();
    assert_eq!(missing(&assert_right(&recording, "whole stream")), None);
    let all = recording.robot.len();
    let mut row = 0_usize;
    recording.robot.retain(|_| {
        row += 1;
        // Missing frames are counted between the first and the last.
        row == 1 || row == all || (row as f64 * 0.618_033_988_75).fract() > 0.4
    });
    let lost = all - recording.robot.len();
    assert_eq!(missing(&assert_right(&recording, "lossy stream")), Some((lost, all)));
}

/// Out of step with the poll a new pose is half a poll old on average. The opposite sign would be off by a whole one.
#[test]
fn poses_that_repeat_out_of_step() {
    let mut scenario = cell(Preset::Quick, 16);
    scenario.timing.robot_period_s = 0.001;
    let mut recording = simulate(&scenario, 16).unwrap();
    let every_7 = recording.robot.clone();
    for (k, sample) in recording.robot.iter_mut().enumerate() {
        sample.base_from_tool = every_7[k - k % 7].base_from_tool;
    }
    let polled = recording.robot.iter().step_by(4).copied().collect();
    recording.robot = polled;
    let calibration = assert_right(&recording, "out of step");
    // The mean of 0, 1, 2 and 3 ms is 1.5, and the estimate is 2.
    let off =
        calibration.best_fit().time_offset_s - recording.truth.as_ref().unwrap().parameters.time_offset_s;
    assert!(off.abs() < 0.8e-3, "{off}");
}

/// Clocks of two computers: the offset is far outside the initial search range.
#[test]
fn offsets_of_seconds() {
    for offset_s in [2.5, -4.0] {
        let mut scenario = Preset::Quick.scenario();
        scenario.timing.time_offset_s = offset_s;
        assert_right(&simulate(&scenario, 9).unwrap(), &format!("{offset_s} s"));
    }
}

#[test]
fn coarse_stamps() {
    let floor = |ns: &mut i64, grain: i64| *ns -= ns.rem_euclid(grain);
    let mut recording = simulate(&cell(Preset::Quick, 10), 10).unwrap();
    recording.features.iter_mut().for_each(|f| floor(&mut f.stamp_ns, 10_000_000));
    let images = assert_right(&recording, "images of 10 ms");
    assert!((images.findings.streams.images.grain_s.unwrap() - 0.010).abs() < 1e-12);
    let mut recording = simulate(&cell(Preset::Quick, 10), 10).unwrap();
    recording.robot.iter_mut().for_each(|s| floor(&mut s.stamp_ns, 10_000_000));
    let robot = calibrated(&recording);
    assert_eq!(robot.status(), Status::NotAccepted);
    assert!(matches!(robot.reasons()[0], Reason::CoarseRobotStamps { .. }), "{:?}", robot.reasons());
}

/// Stamps of arrival that are late by milliseconds hide their truncation to whole milliseconds. Yet the earliest of them,
/// which determine the time offset, are early by up to a millisecond.
#[test]
fn stamps_that_arrive_late_hide_no_grain() {
    let late: Vec<_> =
        ["late-arrival=2", "image-grain=1"].iter().map(|fault| fault.parse().unwrap()).collect();
    for seed in 1..4 {
        let recording = trueline_sim::simulate_with_faults(&Preset::Good.scenario(), &late, seed).unwrap();
        let c = assert_right(&recording, "late by 2 ms, in whole milliseconds");
        assert!((c.findings.streams.images.grain_s.unwrap() - 0.001).abs() < 1e-12);
        let only = trueline_sim::simulate_with_faults(&Preset::Good.scenario(), &late[..1], seed).unwrap();
        assert_eq!(calibrated(&only).findings.streams.images.grain_s, None);
    }
}

/// A grain longer than a period gives equal stamps. Two lines in one image do too, and those are exact.
#[test]
fn equal_stamps_are_a_grain_only_where_the_pictures_differ() {
    let mut recording = simulate(&cell(Preset::Quick, 10), 10).unwrap();
    recording.features.iter_mut().for_each(|f| f.stamp_ns -= f.stamp_ns.rem_euclid(33_000_000));
    let c = calibrated(&recording);
    assert!((c.findings.streams.images.grain_s.unwrap() - 0.033).abs() < 1e-12);
    let mut scenario = cell(Preset::TwoLines, 10);
    scenario.disturbance.frame_jitter_s = 0.0;
    let c = calibrated(&simulate(&scenario, 10).unwrap());
    assert_eq!(c.findings.streams.images.grain_s, None);
}

/// An attitude with noise only is no tilt, however large the noise is.
#[test]
fn noise_of_the_attitude_shows_nothing() {
    for sigma_rad in [1e-4, 5e-4, 2e-3] {
        let mut scenario = Preset::ConstantAttitude.scenario();
        scenario.disturbance.robot_rotation_noise_rad = sigma_rad;
        let recording = simulate(&scenario, 11).unwrap();
        let guess = recording.truth.as_ref().unwrap().parameters;
        let calibration = calibrate(&recording, Some(&guess), &Config::default()).unwrap();
        assert_eq!(calibration.status(), Status::NotAccepted, "{sigma_rad}");
        assert!((4..7).all(|k| calibration.sigma(k).is_none()), "{sigma_rad}");
    }
}

#[test]
fn a_guess_in_the_mirrored_minimum_is_refused() {
    let recording = simulate(&Preset::Weak.scenario(), 2).unwrap();
    let tool_from_camera =
        se3::from_parts(nalgebra::UnitQuaternion::identity(), nalgebra::Vector3::new(0.0, 0.0, 0.1));
    let guess = Guess { time_offset_s: 0.0, tool_from_camera };
    let calibration = calibrate(&recording, Some(&guess), &Config::default()).unwrap();
    let right = largest_error(&calibration, &recording.truth.as_ref().unwrap().parameters) < SIGMAS;
    assert!(right || calibration.status() == Status::NotAccepted);
    assert!(
        right
            || calibration
                .reasons()
                .iter()
                .any(|r| matches!(r, Reason::WrongTimeOffset { .. } | Reason::WorseMinimum { .. })),
        "{:?}",
        calibration.reasons()
    );
}

/// A large drift hides itself by large residuals and must still be found.
#[test]
fn large_drifts_are_taken_out() {
    for ppm in [200.0, 1000.0, 5000.0] {
        let mut scenario = cell(Preset::Quick, 12);
        scenario.disturbance.clock_drift_ppm = ppm;
        let calibration = calibrated(&simulate(&scenario, 12).unwrap());
        assert_eq!(calibration.status(), Status::Accepted, "{ppm}: {:?}", calibration.reasons());
        let drift = calibration.findings.clock.drift.unwrap();
        // To first order in the drift: stamps grow by 1 + ppm.
        let slack = SIGMAS * drift.sigma_ppm + 2.0 * ppm * ppm * 1e-6;
        assert!((drift.ppm - ppm).abs() < slack, "{ppm}: {drift:?}");
    }
}

/// In the middle of the scan a step looks most like a drift.
#[test]
fn a_step_in_the_middle_is_no_drift() {
    let mut recording = simulate(&cell(Preset::Quick, 13), 13).unwrap();
    let middle_ns = recording.features[recording.features.len() / 2].stamp_ns;
    recording.features.iter_mut().filter(|f| f.stamp_ns >= middle_ns).for_each(|f| f.stamp_ns += 2_000_000);
    let raw = Config { stamps: Stamps::Raw, ..Config::default() };
    let calibration = calibrate(&recording, None, &raw).unwrap();
    assert_eq!(calibration.status(), Status::NotAccepted);
    let step = calibration.findings.clock.stepped.unwrap();
    assert!((step.step_s - 2e-3).abs() < SIGMAS * step.sigma_s, "{step:?}");
    // The regular clock of the images shows the step, and dates all of them like the stamps after it.
    let calibration = calibrated(&recording);
    assert_eq!(calibration.status(), Status::Accepted, "{:?}", calibration.reasons());
    assert!(calibration.findings.streams.images.step_taken_out);
    let truth = recording.truth.as_ref().unwrap().parameters;
    let after = Guess { time_offset_s: truth.time_offset_s + 2e-3, ..truth };
    let largest = largest_error(&calibration, &after);
    assert!(largest < SIGMAS, "{largest}");
}

#[test]
fn a_robot_stream_that_freezes_is_named() {
    let mut recording = simulate(&cell(Preset::Quick, 14), 14).unwrap();
    let from = recording.robot.len() * 3 / 4;
    let frozen = recording.robot[from].base_from_tool;
    recording.robot[from..].iter_mut().for_each(|s| s.base_from_tool = frozen);
    let calibration = calibrated(&recording);
    assert_eq!(calibration.status(), Status::NotAccepted);
    assert!(
        calibration.reasons().iter().any(|r| matches!(r, Reason::RobotStreamFroze { .. })),
        "{:?}",
        calibration.reasons()
    );
    recording.robot.iter_mut().for_each(|s| s.base_from_tool = frozen);
    let error = calibrate(&recording, None, &Config::default()).unwrap_err();
    assert!(error.to_string().contains("does not move"), "{error}");
}

#[test]
fn rows_that_repeat_count_once() {
    let recording = simulate(&cell(Preset::Quick, 15), 15).unwrap();
    let mut twice = recording.clone();
    twice.features = recording.features.iter().flat_map(|f| [*f, *f]).collect();
    let (once, twice) = (calibrated(&recording), calibrated(&twice));
    // Only the row numbers differ.
    assert_eq!(once.best_fit(), twice.best_fit());
    assert_eq!(once.best_fit_covariance(), twice.best_fit_covariance());
}

#[test]
fn images_of_one_instant_are_refused() {
    let mut recording = simulate(&cell(Preset::Quick, 17), 17).unwrap();
    let first_ns = recording.features[0].stamp_ns;
    recording.features.iter_mut().for_each(|f| f.stamp_ns = first_ns);
    let error = calibrate(&recording, None, &Config::default()).unwrap_err();
    assert!(error.to_string().contains("1 distinct image time stamp"), "{error}");
}

/// Half of the error in predicting a part of a short scan from the others is their uncertainty, and no disagreement.
#[test]
fn short_scans_do_not_disagree() {
    for seed in 0..8 {
        let mut scenario = cell(Preset::Quick, seed);
        scenario.timing.duration_s = 5.0;
        let calibration = calibrated(&simulate(&scenario, seed).unwrap());
        let disagrees = calibration.warnings().iter().any(|w| {
            matches!(w, Warning::CrossValidationShift { .. } | Warning::CrossValidationMisfit { .. })
        });
        assert!(!disagrees, "{seed}: {:?}", calibration.warnings());
    }
}

/// Half a second in the middle: the robot's stamps or the images' jump forward, and nothing else.
#[test]
fn a_clock_that_steps_amid_the_scan_is_the_one_reason_and_has_a_name() {
    let scan = simulate(&Preset::Good.scenario(), 3).unwrap();
    let middle_ns = scan.robot[scan.robot.len() / 2].stamp_ns;
    let late = |stamp_ns: &mut i64| *stamp_ns += if *stamp_ns > middle_ns { 500_000_000 } else { 0 };
    let (mut robot, mut images) = (scan.clone(), scan);
    robot.robot.iter_mut().for_each(|sample| late(&mut sample.stamp_ns));
    images.features.iter_mut().for_each(|feature| late(&mut feature.stamp_ns));
    for (recording, clock) in [(robot, StreamName::Robot), (images, StreamName::Images)] {
        let c = calibrated(&recording);
        let [Reason::OtherTimeOffset { step_s, clock: named, .. }, ..] = c.reasons() else {
            panic!("{clock:?}: {:?}", c.reasons())
        };
        assert_eq!(*named, Some(clock), "{step_s}");
        assert!((step_s.abs() - 0.5).abs() < 2e-3, "{clock:?}: {step_s}");
        let follows =
            |r: &Reason| matches!(r, Reason::TooManyOutliers { .. } | Reason::AmbiguousTimeOffset { .. });
        assert!(!c.reasons().iter().any(follows), "{:?}", c.reasons());
    }
}
