//! Tests stripes unlike the simulator's: repeated poses, frames without a seam point, false stripes.

use std::collections::BTreeMap;
use trueline_dataset::{Recording, RobotSample};
use trueline_method::error::no_plates::NoPlates;
use trueline_method::input::skip::Skip;
use trueline_method::stripe::outcome::{Because, StripeEstimate};
use trueline_method::{Calibration, Config, Error, Measurements, Stamps, Status, calibrate};
use trueline_sim::{PlatePair, Plates, Preset, scan_plates};

fn calibrated(recording: &Recording, config: &Config) -> Calibration {
    let truth = recording.truth.as_ref().unwrap().parameters;
    calibrate(recording, Some(&truth), config).unwrap()
}

fn stripes(calibration: &Calibration) -> &StripeEstimate {
    calibration.findings.stripes.as_ref().unwrap().estimate.as_ref().unwrap()
}

/// eᵀ C⁻¹ e of time offset, rotation and translation.
fn normalised(recording: &Recording, calibration: &Calibration) -> f64 {
    let off = calibration.best_fit().minus(&recording.truth.as_ref().unwrap().parameters);
    let covariance = calibration.best_fit_covariance().fixed_view::<7, 7>(0, 0).into_owned();
    off.dot(&covariance.cholesky().unwrap().solve(&off))
}

/// A robot that updates its pose every 12 ms and is polled every 4 ms has its true noise, for positions and attitudes alike.
#[test]
fn poses_that_repeat_have_the_noise_of_those_that_are_new() {
    let mut scenario = Preset::Good.scenario();
    scenario.timing.robot_period_s = 0.012;
    scenario.disturbance.robot_rotation_noise_rad = 0.03_f64.to_radians();
    let recording = scan_plates(&scenario, &Plates::default(), 3).unwrap();
    let polled: Vec<RobotSample> = (recording.robot.iter())
        .flat_map(|sample| {
            [0, 4_000_000, 8_000_000]
                .map(|later_ns| RobotSample { stamp_ns: sample.stamp_ns + later_ns, ..*sample })
        })
        .collect();
    let polled = Recording { robot: polled, ..recording.clone() };
    let config = Config { measurements: Measurements::Stripe, ..Config::noise_only() };
    let [new, polled] = [&recording, &polled].map(|recording| calibrated(recording, &config));
    let [of_new, of_polled] = [&new, &polled].map(|calibration| stripes(calibration).noise_factor);
    println!("noise factor {of_new:.3}, polled {of_polled:.3}");
    // Both are measured on 600 frames, to some percent.
    assert!((of_polled / of_new - 1.0).abs() < 0.1, "{of_new} {of_polled}");
    for k in 1..4 {
        let ratio = polled.sigma(k).unwrap() / new.sigma(k).unwrap();
        assert!((0.85..1.2).contains(&ratio), "{k}: {ratio}");
    }
}

/// Every other frame without a seam point: its stripes get the clock tick nearest to their stamp.
#[test]
fn stripes_without_a_seam_point_are_dejittered_as_the_others_are() {
    let mut scenario = Preset::Good.scenario();
    scenario.disturbance.frame_jitter_s = 3e-3;
    let recording = scan_plates(&scenario, &Plates::default(), 1).unwrap();
    let half = recording.features.iter().enumerate().filter(|(k, _)| k % 2 == 0).map(|(_, f)| *f);
    let half = Recording { features: half.collect(), ..recording.clone() };
    let config =
        Config { measurements: Measurements::Stripe, stamps: Stamps::Regular, ..Config::noise_only() };
    let [whole, halved] = [&recording, &half].map(|recording| calibrated(recording, &config));
    let [of_whole, of_half] = [&whole, &halved].map(|calibration| stripes(calibration).noise_factor);
    println!("noise factor {of_whole:.3}, half of the seam points {of_half:.3}");
    assert!((of_half / of_whole - 1.0).abs() < 0.1, "{of_whole} {of_half}");
    assert_eq!(stripes(&halved).counts.rejected_stripes, stripes(&whole).counts.rejected_stripes);
    // χ²₇ exceeds 24.3 once in a thousand.
    assert!(normalised(&half, &halved) < 24.3, "{}", normalised(&half, &halved));
}

/// Seam points only in the first third of a scan: the images' clock uses all images, and is not extrapolated from these.
#[test]
fn the_clock_of_pictures_is_that_of_all_stripes() {
    let scenario = Preset::Quick.scenario();
    let config =
        Config { measurements: Measurements::Stripe, stamps: Stamps::Regular, ..Config::noise_only() };
    let mut sum = 0.0;
    for seed in [1, 4, 7, 9] {
        let recording = scan_plates(&scenario, &Plates::default(), seed).unwrap();
        let first = recording.features.len() * 3 / 10;
        let part = Recording { features: recording.features[..first].to_vec(), ..recording.clone() };
        let [whole, part] = [&recording, &part].map(|recording| calibrated(recording, &config));
        let truth_s = recording.truth.as_ref().unwrap().parameters.time_offset_s;
        let off = |c: &Calibration| (c.best_fit().time_offset_s - truth_s) / c.sigma(0).unwrap();
        println!(
            "seed {seed}: time offset off by {:.2}, of all seam points {:.2} of its ±",
            off(&part),
            off(&whole)
        );
        sum += off(&part).powi(2);
    }
    // χ²₄ exceeds 18.5 once in a thousand.
    assert!(sum < 18.5, "{sum}");
}

/// Two false stripes among 659 give one plate no second one.
#[test]
fn few_false_stripes_are_no_plate() {
    let plates = Plates { pair: PlatePair::Edge, ..Plates::default() };
    let recording = scan_plates(&Preset::Good.scenario(), &plates, 2).unwrap();
    let mut doubted = recording.clone();
    for k in [100, 400] {
        let mut other = recording.stripes[k];
        other.plate ^= 1;
        doubted.stripes.push(other);
    }
    doubted.stripes.sort_by_key(|stripe| stripe.stamp_ns);
    let config = Config { measurements: Measurements::Auto, ..Config::noise_only() };
    let [one, other] = [&recording, &doubted].map(|recording| calibrated(recording, &config));
    for calibration in [&one, &other] {
        let outcome = calibration.findings.stripes.as_ref().unwrap();
        assert_eq!((outcome.used, outcome.because), (Measurements::Stripe, Because::Agreement));
        assert_eq!(calibration.status(), Status::Accepted, "{:?}", calibration.reasons());
    }
    let skipped = &other.findings.stripes.as_ref().unwrap().skipped;
    assert_eq!(skipped, &BTreeMap::from([(Skip::RarePlate, 2)]));
    assert_eq!(one.best_fit().guess().tool_from_camera, other.best_fit().guess().tool_from_camera);
}

/// The message for a single stripe does not say that it lies outside the picture.
#[test]
fn a_stripe_that_is_alone_is_not_said_to_lie_outside_the_picture() {
    let mut recording = scan_plates(&Preset::Good.scenario(), &Plates::default(), 2).unwrap();
    recording.stripes.truncate(1);
    let truth = recording.truth.as_ref().unwrap().parameters;
    let config = Config { measurements: Measurements::Stripe, ..Config::noise_only() };
    let refused = calibrate(&recording, Some(&truth), &config).unwrap_err();
    let Error::NoPlates { why } = refused else { panic!("{refused}") };
    assert_eq!(why, NoPlates::Missing { line: 0, unusable: 0 });
}
