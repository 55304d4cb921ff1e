//! Tests whole stripes: cells with known truth, plates that are not flat, outliers, and directions that no target determines.

use nalgebra::{DVector, Vector2, Vector3};
use std::collections::BTreeMap;
use trueline_dataset::join::join;
use trueline_dataset::picture_rows::PicturesDisagree;
use trueline_dataset::{Measured, Recording, Sensor};
use trueline_geometry::{se3, so3};
use trueline_lsq::Loss;
use trueline_method::assess::observability::Group;
use trueline_method::error::no_plates::NoPlates;
use trueline_method::input::skip::Skip;
use trueline_method::stripe::outcome::{Because, StripeEstimate};
use trueline_method::{Calibration, Config, Error, Measurements, SensorMode, Status, calibrate};
use trueline_sim::{PlateForm, PlatePair, Plates, Preset, Scenario, random_cell, scan_plates};

fn scenario(preset: Preset, duration_s: f64) -> Scenario {
    let mut scenario = preset.scenario();
    scenario.timing.duration_s = duration_s;
    scenario
}

fn with(measurements: Measurements, sensor: SensorMode) -> Config {
    Config { measurements, sensor, ..Config::noise_only() }
}

fn calibrated(recording: &Recording, config: &Config) -> Calibration {
    let truth = recording.truth.as_ref().unwrap().parameters;
    calibrate(recording, Some(&truth), config).unwrap()
}

fn stripes(calibration: &Calibration) -> &StripeEstimate {
    calibration.findings.stripes.as_ref().unwrap().estimate.as_ref().unwrap()
}

/// Error of time offset, rotation and translation, and eᵀ C⁻¹ e.
fn error(recording: &Recording, calibration: &Calibration) -> (DVector<f64>, f64) {
    let truth = recording.truth.as_ref().unwrap().parameters;
    let off = calibration.best_fit().minus(&truth);
    let off = DVector::from_column_slice(off.as_slice());
    let covariance = calibration.best_fit_covariance().view((0, 0), (7, 7)).into_owned();
    let normalised = off.dot(&covariance.cholesky().unwrap().solve(&off));
    (off, normalised)
}

#[test]
fn on_the_papers_scan_stripes_know_the_rotation_ten_times_better_and_are_right() {
    let scenario = scenario(Preset::Paper, 20.0);
    let mut sum = 0.0;
    for seed in 1..=4 {
        let recording = scan_plates(&scenario, &Plates::default(), seed).unwrap();
        let seam = calibrated(&recording, &with(Measurements::Seam, SensorMode::Fixed));
        let stripe = calibrated(&recording, &with(Measurements::Auto, SensorMode::Fixed));
        let outcome = stripe.findings.stripes.as_ref().unwrap();
        assert_eq!((outcome.used, outcome.because), (Measurements::Stripe, Because::Agreement));
        assert_eq!(stripe.status(), Status::Accepted, "{:?}", stripe.reasons());
        let rotation = |c: &Calibration| (1..4).map(|k| c.sigma(k).unwrap().powi(2)).sum::<f64>().sqrt();
        assert!(rotation(&stripe) < 0.2 * rotation(&seam), "{} {}", rotation(&stripe), rotation(&seam));
        let (off, normalised) = error(&recording, &stripe);
        println!(
            "seed {seed}: {normalised:.1} rot said {:.5}° seam-only {:.5}° off {off:?} nf {}",
            rotation(&stripe).to_degrees(),
            rotation(&seam).to_degrees(),
            stripes(&stripe).noise_factor
        );
        sum += normalised;
    }
    // χ²₂₈ is 28 ± 7.5; one in a thousand is below 9.7 or above 56.9.
    assert!((9.0..58.0).contains(&sum), "{sum}");
}

/// A derivative at the robot's reported pose shares its error with the residual. On a scan of constant stand-off, with depth
/// shown only by its tilts, the mean shape is then off by 1.4 of its ± (which is too small as well), in every scan the same
/// way.
#[test]
fn errors_of_the_robot_do_not_draw_a_free_sensors_shape_aside() {
    const SCANS: u64 = 12;
    let mut scenario = scenario(Preset::Paper, 60.0);
    scenario.disturbance.robot_position_noise_m = 0.1e-3;
    let mut mean = [0.0; 5];
    for seed in 1..=SCANS {
        let recording = scan_plates(&scenario, &Plates::default(), seed).unwrap();
        let free = calibrated(&recording, &with(Measurements::Stripe, SensorMode::Free));
        let (at, covariance) = (free.best_fit(), free.best_fit_covariance());
        let shape = at.shape.unwrap().h;
        let sigmas = at.unknowns().shape().map(|k| covariance[(k, k)].sqrt());
        sigmas.enumerate().for_each(|(k, sigma)| mean[k] += shape[k] / sigma / SCANS as f64);
    }
    println!("mean of h over its ±: {mean:.2?}");
    // The mean of 12 normal numbers has a standard deviation of 0.29. The limit is 3.5 of that for each of five.
    assert!(mean.iter().all(|of_sigma| of_sigma.abs() < 1.0), "{mean:?}");
}

#[test]
fn bowed_plates_do_not_move_the_answer_and_are_said_to_be_bowed() {
    let scenario = scenario(Preset::Paper, 20.0);
    for term in 0..7 {
        let plates =
            Plates { forms: [PlateForm::of_term(term, 2e-4), PlateForm::default()], ..Plates::default() };
        let recording = scan_plates(&scenario, &plates, 5).unwrap();
        let stripe = calibrated(&recording, &with(Measurements::Stripe, SensorMode::Fixed));
        let (_, normalised) = error(&recording, &stripe);
        let bows = stripes(&stripe).planes.iter().map(|plane| plane.bow_m * 1e3).collect::<Vec<_>>();
        println!("term {term}: {normalised:.1}, bows {bows:?} mm");
        // χ²₇ exceeds 24.3 once in a thousand.
        assert!(normalised < 24.3, "term {term}: {normalised}");
    }
}

#[test]
fn constant_attitude_hides_the_translation_from_plates_as_well() {
    let scenario = scenario(Preset::ConstantAttitude, 10.0);
    let recording = scan_plates(&scenario, &Plates::default(), 1).unwrap();
    let stripe = calibrated(&recording, &with(Measurements::Stripe, SensorMode::Fixed));
    let observability = &stripe.findings.unknowns.observability;
    println!("{observability:?}");
    assert!(
        observability.unobservable.iter().any(|u| u.group == Group::Translation && u.directions.len() == 3)
    );
    assert_eq!((observability.rank, observability.size), (10, 13));
    assert!((4..7).all(|k| stripe.sigma(k).is_none()));
    assert_eq!(stripe.status(), Status::NotAccepted);
}

/// Tilts of 5° are motion, and so are the lively scan's to a quarter. Nothing is unobservable, even with ten times the noise of the robot's
/// attitudes.
#[test]
fn tilts_above_the_noise_are_seen() {
    for (preset, duration_s, part) in [(Preset::Paper, 20.0, 1.0), (Preset::Quick, 10.0, 0.25)] {
        for seed in 1..=5 {
            let mut scenario = random_cell(&scenario(preset, duration_s), seed, 0.1);
            for tilt in &mut scenario.scan.tilts {
                tilt.amplitude *= part;
            }
            scenario.disturbance.robot_rotation_noise_rad *= f64::from(1 + 9 * (seed % 2) as u32);
            let recording = scan_plates(&scenario, &Plates::default(), seed).unwrap();
            let stripe = calibrated(&recording, &with(Measurements::Stripe, SensorMode::Fixed));
            let observability = &stripe.findings.unknowns.observability;
            assert_eq!((observability.rank, observability.size), (13, 13), "{preset:?}, cell {seed}");
        }
    }
}

/// Fillets and plates that are nearly in one plane, with stripes that differ less in the picture than on the laser sheet,
/// and an outside corner.
#[test]
fn a_recording_of_stripes_alone_calibrates_from_nothing() {
    for (preset, opening_deg) in [(Preset::Quick, 90.0), (Preset::Good, 170.0), (Preset::Good, 270.0)] {
        let plates = Plates { opening_rad: f64::to_radians(opening_deg), ..Plates::default() };
        let mut recording = scan_plates(&scenario(preset, 10.0), &plates, 3).unwrap();
        recording.features.clear();
        let config = with(Measurements::Auto, SensorMode::Prior);
        let stripe = calibrate(&recording, None, &config).unwrap();
        let (_, normalised) = error(&recording, &stripe);
        assert_eq!(stripe.findings.stripes.as_ref().unwrap().used, Measurements::Stripe);
        assert!(normalised < 24.3, "{opening_deg}: {normalised}");
        let truth = recording.truth.as_ref().unwrap();
        let (turn, _) = se3::difference_decoupled(
            &stripe.best_fit().tool_from_camera,
            &truth.parameters.tool_from_camera,
        );
        assert!(turn.norm() < 1e-3, "{opening_deg}: {turn}");
        let [angle] = stripes(&stripe).angles[..] else { panic!("one joint") };
        let off = angle.value_rad.to_degrees() - opening_deg;
        assert!(off.abs() < 4.0 * angle.sigma_rad.to_degrees(), "{opening_deg}: {off} of {angle:?}");
    }
}

#[test]
fn stripes_that_are_off_are_left_out_and_frames_without_both_give_their_seam_point() {
    let mut scenario = scenario(Preset::Quick, 10.0);
    scenario.disturbance.outlier_fraction = 0.15;
    let mut recording = scan_plates(&scenario, &Plates::default(), 4).unwrap();
    let stamps: Vec<i64> = recording.features.iter().map(|f| f.stamp_ns).collect();
    // Every fourth frame loses its right plate.
    recording
        .stripes
        .retain(|s| s.plate == 0 || stamps.iter().position(|t| *t == s.stamp_ns).unwrap() % 4 != 0);
    for measurements in [Measurements::Stripe, Measurements::Both] {
        let stripe = calibrated(&recording, &with(measurements, SensorMode::Fixed));
        let (_, normalised) = error(&recording, &stripe);
        let outcome = stripe.findings.stripes.as_ref().unwrap();
        let share = stripes(&stripe).counts.outliers().share();
        println!("{measurements:?}: {normalised:.1}, rejected {share:.3}");
        assert_eq!(outcome.used, measurements);
        assert!(normalised < 24.3, "{measurements:?}: {normalised}");
        assert!((0.08..0.20).contains(&share), "{share}");
    }
    let auto = calibrated(&recording, &with(Measurements::Auto, SensorMode::Fixed));
    assert_eq!(auto.findings.stripes.as_ref().unwrap().because, Because::TooFewFrames);
}

#[test]
fn stripes_that_contradict_the_seam_points_are_not_used_by_default() {
    let scenario = scenario(Preset::Quick, 10.0);
    let mut recording = scan_plates(&scenario, &Plates::default(), 6).unwrap();
    for feature in &mut recording.features {
        if let Measured::Pixel([u, _]) = &mut feature.measured {
            *u += 3.0;
        }
    }
    let auto = calibrated(&recording, &with(Measurements::Auto, SensorMode::Fixed));
    let outcome = auto.findings.stripes.as_ref().unwrap();
    assert_eq!((outcome.used, outcome.because), (Measurements::Seam, Because::Disagreement));
    assert!(
        auto.reasons().iter().any(|reason| reason.code() == "stripes-contradict"),
        "{:?}",
        auto.reasons()
    );
    let estimate = stripes(&auto);
    let offsets = [&estimate.stripe, &estimate.seam].map(|answer| answer.parameters.time_offset_s);
    assert_eq!(estimate.apart.time_offset_s, offsets[0] - offsets[1]);
    // Three pixels at about 130 mm; a part of them looks like a turn.
    let Sensor::CameraLaser { camera, .. } = &recording.sensor else { panic!() };
    let aside_m = 3.0 * 0.13 / camera.focal.x;
    let point_m = estimate.apart.point_m;
    assert!((0.8..1.2).contains(&(point_m / aside_m)), "{point_m} of {aside_m}");
    // If the user selects one of them, the distance of the other is still reported.
    let asked = calibrated(&recording, &with(Measurements::Stripe, SensorMode::Fixed));
    assert_eq!(asked.status(), Status::Accepted, "{:?}", asked.reasons());
    assert!(asked.warnings().iter().any(|warning| warning.code() == "stripes-disagree"));
}

/// A camera's seam points are the crossing of straight lines. With bowed plates it is off the seam, by many of its ± if a
/// scan knows it well. The stripes show the forms, so that both answers do not contradict each other, and theirs is taken.
#[test]
fn seam_points_beside_the_seam_of_bowed_plates_do_not_overrule_the_stripes() {
    let form = PlateForm { across: 2e-4, along: 2e-4, ..PlateForm::default() };
    let plates = Plates { forms: [form; 2], ..Plates::default() };
    for seed in 0..4 {
        let recording = scan_plates(&Preset::Good.scenario(), &plates, seed).unwrap();
        let auto = calibrated(&recording, &with(Measurements::Auto, SensorMode::Fixed));
        let outcome = auto.findings.stripes.as_ref().unwrap();
        assert_eq!((outcome.used, outcome.because), (Measurements::Stripe, Because::Agreement), "{seed}");
        // By seam points the error is 0.012 mm and 5 to 8 sigma, by stripes up to three sigma of each number.
        let truth = recording.truth.as_ref().unwrap().parameters;
        let off = auto.best_fit().minus(&truth);
        let covariance = auto.best_fit_covariance();
        for k in 0..7 {
            assert!(off[k].abs() < 4.0 * covariance[(k, k)].sqrt(), "{seed}, {k}");
        }
    }
    // Seam points three pixels aside are no form of plates.
    let mut recording = scan_plates(&Preset::Good.scenario(), &plates, 0).unwrap();
    for feature in &mut recording.features {
        if let Measured::Pixel([u, _]) = &mut feature.measured {
            *u += 3.0;
        }
    }
    let auto = calibrated(&recording, &with(Measurements::Auto, SensorMode::Fixed));
    assert_eq!(auto.findings.stripes.unwrap().because, Because::Disagreement);
}

/// Stripes of a bad image agree with any answer. They are not used then.
#[test]
fn clearly_less_certain_stripes_are_not_used_by_default() {
    let scenario = scenario(Preset::Quick, 10.0);
    let plates = Plates { column_sigma_px: 40.0, ..Plates::default() };
    let noisy = scan_plates(&scenario, &plates, 6).unwrap();
    // The seam points come from a good detector.
    let good = scan_plates(&scenario, &Plates::default(), 6).unwrap();
    let recording = Recording { features: good.features, ..noisy };
    // The errors of a usual robot would leave similarly little of both.
    let good_robot = Config { robot_accuracy_m: Some(0.3e-3), ..Config::default() };
    let auto = calibrated(&recording, &good_robot);
    let outcome = auto.findings.stripes.as_ref().unwrap();
    assert_eq!((outcome.used, outcome.because), (Measurements::Seam, Because::KnowsLess));
}

/// For a motion along the line the answers have nothing in common to compare. The seam points' refusal is reported without a panic.
#[test]
fn without_a_common_component_the_seam_points_report_the_refusal() {
    let scenario = scenario(Preset::AlongLine, 10.0);
    let recording = scan_plates(&scenario, &Plates::default(), 6).unwrap();
    let auto = calibrate(&recording, None, &Config::default()).unwrap();
    assert_eq!(auto.status(), Status::NotAccepted);
    assert_eq!(auto.findings.stripes.as_ref().unwrap().used, Measurements::Seam);
}

#[test]
fn impossible_requests_are_refused() {
    let scenario = scenario(Preset::Quick, 5.0);
    let mut recording = scan_plates(&scenario, &Plates::default(), 6).unwrap();
    let stripe = with(Measurements::Stripe, SensorMode::Fixed);
    let papers = Config { residual: trueline_method::ResidualKind::PointToLine, ..stripe.clone() };
    let refused = |recording: &Recording, config: &Config| {
        calibrate(recording, Some(&recording.truth.as_ref().unwrap().parameters), config).unwrap_err()
    };
    assert_eq!(refused(&recording, &papers), Error::StripesNeedSheet);
    let alone = Recording {
        features: Vec::new(),
        stripes: recording.stripes.iter().filter(|stripe| stripe.plate == 0).cloned().collect(),
        ..recording.clone()
    };
    assert_eq!(refused(&alone, &stripe), Error::NoCrossings { crossings: 0, needed: 10 });
    recording.stripes.truncate(1);
    assert!(matches!(refused(&recording, &stripe), Error::NoPlates { .. }));
    recording.stripes.clear();
    assert_eq!(refused(&recording, &stripe), Error::NoStripes);
}

/// The stripes do not need seam points that are too few to calibrate. Their intersections are the start instead.
#[test]
fn too_few_seam_points_do_not_hide_the_stripes() {
    let recording = scan_plates(&scenario(Preset::Quick, 10.0), &Plates::default(), 7).unwrap();
    let config = with(Measurements::Stripe, SensorMode::Fixed);
    let without = calibrated(&Recording { features: Vec::new(), ..recording.clone() }, &config);
    let few = Recording { features: recording.features[..9].to_vec(), ..recording.clone() };
    assert_eq!(calibrated(&few, &config).best_fit(), without.best_fit());
    // Plates that do not intersect leave the few as they are, with a message.
    let stripes = recording.stripes.iter().filter(|stripe| stripe.plate == 0).cloned().collect();
    let refused = calibrate(&Recording { stripes, ..few }, None, &config).unwrap_err();
    assert!(matches!(refused, Error::TooFewImages { images: 9, .. }), "{refused}");
}

/// Left-out stripes are counted and named, like seam points.
#[test]
fn stripes_that_cannot_be_used_are_counted_by_reason() {
    let mut recording = scan_plates(&scenario(Preset::Quick, 10.0), &Plates::default(), 7).unwrap();
    let count = recording.stripes.len();
    for stripe in &mut recording.stripes[count / 2..count / 2 + 5] {
        stripe.points[0] = Measured::Pixel([-50.0, 10.0]);
    }
    // The camera continues for half a second after the robot's stream ends, between two images.
    let end_ns = recording.robot.last().unwrap().stamp_ns - 515_000_000;
    recording.robot.retain(|sample| sample.stamp_ns <= end_ns);
    let late_ns = (recording.truth.as_ref().unwrap().parameters.time_offset_s * 1e9) as i64;
    let known = recording.robot[0].stamp_ns..=recording.robot.last().unwrap().stamp_ns;
    let later =
        recording.stripes.iter().filter(|stripe| !known.contains(&(stripe.stamp_ns - late_ns))).count();
    let found = calibrated(&recording, &with(Measurements::Auto, SensorMode::Fixed));
    let skipped = &found.findings.stripes.as_ref().unwrap().skipped;
    assert!(later > 10, "{later}");
    assert_eq!(skipped, &BTreeMap::from([(Skip::Outside, later), (Skip::NoRay, 5)]));
}

/// Another program stamps the stripes a third of an image period later than the seam points. Their number shows that they belong to one image.
#[test]
fn stripes_and_seam_points_of_one_frame_are_one_picture_whatever_their_stamps() {
    let scenario = scenario(Preset::Quick, 10.0);
    let mut recording = scan_plates(&scenario, &Plates::default(), 7).unwrap();
    let as_recorded = calibrated(&recording, &with(Measurements::Both, SensorMode::Fixed));
    recording.stripes.iter_mut().for_each(|stripe| stripe.stamp_ns += 10_000_000);
    let stamped_apart = calibrated(&recording, &with(Measurements::Both, SensorMode::Fixed));
    let outcome = |c: &Calibration| {
        let stripes = c.findings.stripes.as_ref().unwrap();
        (stripes.frames, stripes.with_both)
    };
    assert_eq!(outcome(&stamped_apart), outcome(&as_recorded));
    let later_s = |c: &Calibration| c.findings.stripes.as_ref().unwrap().stamped_later_s;
    assert_eq!((later_s(&as_recorded), later_s(&stamped_apart)), (0.0, 0.01));
    let is_told = |c: &Calibration| c.warnings().iter().any(|told| told.code() == "stripes-stamped-apart");
    assert!(is_told(&stamped_apart) && !is_told(&as_recorded));
    assert_eq!(stamped_apart.best_fit(), as_recorded.best_fit());
    // Joined recordings have no numbers. Their stripes and seam points are paired before.
    let other = scan_plates(&scenario, &Plates::default(), 8).unwrap();
    let joined = Recording {
        truth: recording.truth.clone(),
        ..join(vec![recording.clone(), other.clone()]).unwrap().recording
    };
    let of_both = outcome(&calibrated(&joined, &with(Measurements::Both, SensorMode::Fixed)));
    let of_other = outcome(&calibrated(&other, &with(Measurements::Both, SensorMode::Fixed)));
    assert_eq!(of_both, (outcome(&as_recorded).0 + of_other.0, outcome(&as_recorded).1 + of_other.1));
    // Half a minute without samples lies between them, in which none are missing.
    let streams = calibrated(&joined, &with(Measurements::Both, SensorMode::Fixed)).findings.streams;
    assert_eq!((streams.robot.missing, streams.robot.silences), (Some(0), 0));
    assert!(streams.robot.longest_gap_s < 0.1 && streams.images.silences == 0);
    // More than an image period later they belong to another image.
    recording.stripes.iter_mut().for_each(|stripe| stripe.stamp_ns += 100_000_000);
    let truth = recording.truth.as_ref().unwrap().parameters;
    let refused = calibrate(&recording, Some(&truth), &with(Measurements::Both, SensorMode::Fixed));
    assert!(matches!(refused.unwrap_err(), Error::PicturesDisagree(PicturesDisagree::Frames { .. })));
    let not_joined = join(vec![other, recording]).unwrap_err().to_string();
    assert!(not_joined.contains("in recording 1 frame "), "{not_joined}");
}

/// Without numbers the stamps decide which rows belong to one image. Different digits give different images, and hide that all frames show both
/// plates.
#[test]
fn stripes_without_numbers_and_with_stamps_of_their_own_are_refused() {
    let scenario = scenario(Preset::Quick, 10.0);
    let mut recording = scan_plates(&scenario, &Plates::default(), 7).unwrap();
    recording.stripes.iter_mut().for_each(|stripe| stripe.frame = None);
    let config = with(Measurements::Auto, SensorMode::Fixed);
    let used = |c: &Calibration| c.findings.stripes.as_ref().unwrap().used;
    assert_eq!(used(&calibrated(&recording, &config)), Measurements::Stripe);
    let as_stamped = recording.clone();
    for later_ns in [1_000, 100_000_000_000] {
        recording.stripes = as_stamped.stripes.clone();
        recording.stripes.iter_mut().for_each(|stripe| stripe.stamp_ns += later_ns);
        let truth = recording.truth.as_ref().unwrap().parameters;
        let refused = calibrate(&recording, Some(&truth), &config).unwrap_err();
        assert!(matches!(refused, Error::PicturesDisagree(PicturesDisagree::Stamps { .. })), "{refused}");
        assert!(refused.hint().contains("`frame`"), "{}", refused.hint());
    }
}

/// `--loss` holds for plates as for seam points: a loss that never rejects leaves no plate out, and lets false stripes pull.
#[test]
fn the_loss_that_is_asked_for_is_that_of_the_stripes() {
    let mut scenario = scenario(Preset::Quick, 10.0);
    scenario.disturbance.outlier_fraction = 0.05;
    let recording = scan_plates(&scenario, &Plates::default(), 7).unwrap();
    let of = |loss: Option<Loss>| {
        let calibration =
            calibrated(&recording, &Config { loss, ..with(Measurements::Stripe, SensorMode::Fixed) });
        (stripes(&calibration).counts.rejected_stripes, error(&recording, &calibration).1)
    };
    let (by_default, huber) = (of(None), of(Some(Loss::Huber { scale: 3.0 })));
    println!("rejected and squared errors: {by_default:?}, {huber:?}");
    assert!(by_default.0 > 0);
    assert_eq!(huber.0, 0);
    // χ² of seven, 1 in 10 000.
    assert!(by_default.1 < 29.9, "{by_default:?}");
}

/// One of two scans shows no plates: its seam points replace them, with their information alone.
#[test]
fn a_joint_without_plates_counts_by_its_seam_points() {
    let scenario = scenario(Preset::Quick, 8.0);
    let [first, mut second] = [8, 9].map(|seed| scan_plates(&scenario, &Plates::default(), seed).unwrap());
    second.stripes.clear();
    let truth = first.truth.clone();
    let mut recording = join(vec![first, second]).unwrap().recording;
    recording.truth = truth;
    let both = calibrated(&recording, &with(Measurements::Both, SensorMode::Fixed));
    assert_eq!(both.findings.stripes.as_ref().unwrap().used, Measurements::Both);
    let (_, normalised) = error(&recording, &both);
    assert!(normalised < 24.3, "{normalised}");
    assert_eq!(stripes(&both).planes.iter().map(|plane| plane.number).collect::<Vec<_>>(), [0, 1]);
    assert_eq!(both.status(), Status::Accepted, "{:?}", both.reasons());
    let line = both.line(1).unwrap().line_in_base;
    let seam = calibrated(&recording, &with(Measurements::Seam, SensorMode::Fixed)).line(1).unwrap();
    let sigma_rad = seam.covariance[(0, 0)].max(seam.covariance[(1, 1)]).sqrt();
    assert!(line.direction().angle(&seam.line_in_base.direction()) < 4.0 * sigma_rad);
    let asked = with(Measurements::Stripe, SensorMode::Fixed);
    let refused = calibrate(&recording, Some(&recording.truth.as_ref().unwrap().parameters), &asked);
    assert!(refused.unwrap_err().to_string().contains("line 1 has no stripes"));
}

#[test]
fn parallel_plates_and_one_alone_are_joints_with_an_edge() {
    let scenario = scenario(Preset::Paper, 20.0);
    // The stripes' gain for the rotation: one stripe and its end show less than two.
    let butt = |mismatch_m| PlatePair::Butt { gap_m: 1.5e-3, mismatch_m };
    for (pair, gain, step_m) in [
        (PlatePair::Lap { step_m: 3e-3 }, 5.0, Some(3e-3)),
        (PlatePair::Edge, 1.5, None),
        (butt(0.0), 5.0, Some(0.0)),
        (butt(0.6e-3), 5.0, Some(0.6e-3)),
    ] {
        let mut sum = 0.0;
        for seed in 1..=4 {
            let plates = Plates { pair, ..Plates::default() };
            let mut recording = scan_plates(&scenario, &plates, seed).unwrap();
            if seed == 2 {
                // Plates may be numbered in any order.
                recording.stripes.iter_mut().for_each(|stripe| stripe.plate ^= 1);
            }
            let seam = calibrated(&recording, &with(Measurements::Seam, SensorMode::Fixed));
            let stripe = calibrated(&recording, &with(Measurements::Auto, SensorMode::Fixed));
            let outcome = stripe.findings.stripes.as_ref().unwrap();
            assert_eq!(
                (outcome.used, outcome.because),
                (Measurements::Stripe, Because::Agreement),
                "{pair:?}"
            );
            assert_eq!(stripe.status(), Status::Accepted, "{:?}", stripe.reasons());
            let rotation = |c: &Calibration| (1..4).map(|k| c.sigma(k).unwrap().powi(2)).sum::<f64>().sqrt();
            assert!(
                rotation(&seam) > gain * rotation(&stripe),
                "{pair:?} {}",
                rotation(&seam) / rotation(&stripe)
            );
            for step in &stripes(&stripe).steps {
                let off = (step.value_m - step_m.unwrap()).abs();
                println!("step {:.4} ± {:.4} mm", step.value_m * 1e3, step.sigma_m * 1e3);
                assert!(off < 4.0 * step.sigma_m && step.sigma_m < 5e-5, "{step:?}");
            }
            assert_eq!(stripes(&stripe).steps.len(), usize::from(step_m.is_some()));
            assert!(stripes(&stripe).angles.is_empty());
            let line = stripe.line(0).unwrap();
            let truth = recording.truth.as_ref().unwrap().lines[0];
            let turn = line.line_in_base.direction().angle(&truth.direction());
            assert!(turn < 4.0 * line.covariance[(0, 0)].max(line.covariance[(1, 1)]).sqrt(), "{turn}");
            let aside_m = truth.distance(line.line_in_base.anchor());
            println!("{pair:?} seed {seed}: {:.4} mm beside the seam", aside_m * 1e3);
            assert!(aside_m < 4.0 * line.covariance[(2, 2)].max(line.covariance[(3, 3)]).sqrt(), "{aside_m}");
            let (_, normalised) = error(&recording, &stripe);
            println!("{pair:?} seed {seed}: {normalised:.1}");
            sum += normalised;
        }
        // χ²₂₈ as above.
        assert!((6.0..58.0).contains(&sum), "{pair:?} {sum}");
    }
}

/// Seam points that a detector reports in the air between the plates of a lap are no edge of either.
#[test]
fn an_edge_that_lies_on_no_plate_is_not_the_plates() {
    let plates = Plates { pair: PlatePair::Lap { step_m: 3e-3 }, ..Plates::default() };
    let mut recording = scan_plates(&scenario(Preset::Quick, 10.0), &plates, 3).unwrap();
    recording.stripes.retain(|stripe| stripe.plate == 1);
    let auto = calibrated(&recording, &with(Measurements::Auto, SensorMode::Fixed));
    let outcome = auto.findings.stripes.as_ref().unwrap();
    assert_eq!(outcome.used, Measurements::Seam);
    assert_eq!(outcome.because, Because::Plates(NoPlates::EdgeElsewhere { line: 0 }));
    // Without features nothing is measured across the seam.
    recording.features.clear();
    assert!(calibrate(&recording, None, &Config::default()).is_err());
}

/// Frames with swapped plate numbers are lost, but not the answer. If half of the frames are swapped, the seam points give the answer.
#[test]
fn plates_that_are_numbered_the_other_way_in_some_frames_do_not_count_there() {
    let scenario = scenario(Preset::Quick, 10.0);
    let right = scan_plates(&scenario, &Plates::default(), 3).unwrap();
    for (every, used) in [(7, Measurements::Stripe), (2, Measurements::Seam)] {
        let mut recording = right.clone();
        let stamps: Vec<i64> = recording.features.iter().map(|f| f.stamp_ns).collect();
        let is_swapped = |stamp_ns: i64| stamps.binary_search(&stamp_ns).unwrap().is_multiple_of(every);
        for stripe in recording.stripes.iter_mut().filter(|stripe| is_swapped(stripe.stamp_ns)) {
            stripe.plate ^= 1;
        }
        let auto = calibrated(&recording, &with(Measurements::Auto, SensorMode::Fixed));
        let outcome = auto.findings.stripes.as_ref().unwrap();
        println!("every {every}: {:?} {:?}", outcome.used, outcome.because);
        assert_eq!(outcome.used, used, "{:?}", outcome.because);
        let (_, normalised) = error(&recording, &auto);
        assert!(normalised < 24.3, "{normalised}");
        if used == Measurements::Stripe {
            let rejected = stripes(&auto).counts.outliers().share();
            assert!((rejected - 1.0 / 7.0).abs() < 0.02, "{rejected}");
        }
    }
}

/// A plate that slips halfway through the scan moves its stripes, with or without the seam points.
#[test]
fn a_plate_that_moves_during_the_scan_does_not_give_a_wrong_answer_in_silence() {
    let scenario = scenario(Preset::Good, 10.0);
    let still = scan_plates(&scenario, &Plates::default(), 5).unwrap();
    let half_ns = still.stripes[still.stripes.len() / 2].stamp_ns;
    for (px, seam_too) in [(1.0, false), (3.0, false), (12.0, false), (3.0, true), (12.0, true)] {
        let mut recording = still.clone();
        let moved = |measured: &mut Measured| {
            if let Measured::Pixel([_, v]) = measured {
                *v += px;
            }
        };
        let after = recording.stripes.iter_mut().filter(|s| s.stamp_ns > half_ns && s.plate == 1);
        after.for_each(|stripe| stripe.points.iter_mut().for_each(moved));
        if seam_too {
            recording.features.clear();
        }
        let auto = calibrated(&recording, &Config { robot_accuracy_m: Some(0.0), ..Config::default() });
        let outcome = auto.findings.stripes.as_ref().unwrap();
        let (_, normalised) = error(&recording, &auto);
        let words: Vec<&str> = auto.warnings().iter().map(|warning| warning.code()).collect();
        println!(
            "{px} px, seam points too {seam_too}: {:?} {:?} apart {:?} {normalised:.1} {words:?} {:?}",
            outcome.used,
            outcome.because,
            outcome.estimate.as_ref().and_then(|e| e.sigmas_apart),
            auto.reasons()
        );
        let is_refused = auto.status() == Status::NotAccepted;
        assert!(normalised < 24.3 || is_refused, "{px} px: {normalised}");
        // A slip of a pixel is a form of its plate. Without seam points the stripes answer, and say that they fit badly.
        let is_told = words.iter().any(|code| ["stripe-noise", "stripes-disagree"].contains(code));
        assert!(is_told || px == 1.0 || outcome.used == Measurements::Seam, "{px} px: {words:?}");
        assert_eq!(outcome.used == Measurements::Stripe, seam_too || px == 1.0, "{px} px");
    }
}

/// A detector whose stripes move down the image, and half as much to the right, with the tilt about the seam.
fn with_bias(recording: &Recording, px_per_10_deg: f64) -> Recording {
    let truth = recording.truth.as_ref().unwrap().parameters;
    let first = recording.robot[0].base_from_tool.rotation;
    // Tilts are relative to the mean attitude, because large rotations do not add.
    let turns =
        recording.robot.iter().map(|sample| so3::log(&(first.inverse() * sample.base_from_tool.rotation)));
    let first = first * so3::exp(&(turns.sum::<Vector3<f64>>() / recording.robot.len() as f64));
    let seam_in_tool = first.inverse() * recording.truth.as_ref().unwrap().lines[0].direction();
    let shift = |stamp_ns: i64| {
        let exposed_ns = stamp_ns - (truth.time_offset_s * 1e9) as i64;
        let k = recording.robot.partition_point(|sample| sample.stamp_ns < exposed_ns);
        let pose = recording.robot[k.min(recording.robot.len() - 1)].base_from_tool;
        let turn = so3::log(&(first.inverse() * pose.rotation)).dot(&seam_in_tool);
        Vector2::new(0.5, 1.0) * (px_per_10_deg * turn.to_degrees() / 10.0)
    };
    let moved = |measured: &mut Measured, by: Vector2<f64>| {
        if let Measured::Pixel([u, v]) = measured {
            (*u, *v) = (*u + by.x, *v + by.y);
        }
    };
    let mut biased = recording.clone();
    biased.features.iter_mut().for_each(|f| moved(&mut f.measured, shift(f.stamp_ns)));
    biased.stripes.iter_mut().for_each(|s| {
        let by = shift(s.stamp_ns);
        s.points.iter_mut().for_each(|point| moved(point, by));
    });
    biased
}

/// A bias of 0.2 px per 10° of tilt, not removed from the stripes, would displace the sensor.
#[test]
fn a_bias_with_the_tilt_is_taken_out_of_the_stripes_as_well() {
    let scenario = scenario(Preset::Good, 20.0);
    let recording = with_bias(&scan_plates(&scenario, &Plates::default(), 5).unwrap(), 0.2);
    let config =
        Config { robot_accuracy_m: Some(0.0), measurements: Measurements::Stripe, ..Config::default() };
    let stripe = calibrated(&recording, &config);
    let bias = stripe.findings.checks.feature_bias.unwrap();
    println!("{bias:?}");
    assert!(bias.is_found, "{:?}", stripe.warnings());
    let (off, normalised) = error(&recording, &stripe);
    let left_m = off.rows(4, 3).norm();
    println!("off by {:.3} mm, {normalised:.1}, apart {:?}", left_m * 1e3, stripes(&stripe).sigmas_apart);
    assert!(left_m < 0.15e-3, "{left_m}");
    assert!(normalised < 24.3, "{normalised}");
    assert!(stripes(&stripe).sigmas_apart.unwrap() < 3.0);
}
