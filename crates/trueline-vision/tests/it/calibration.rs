//! A scan of every target, from rendered pictures to the calibration: within four of its own sigmas.

use nalgebra::Vector2;
use trueline_dataset::{Error, FrameStamp, GrayImage, Guess, PictureSource};
use trueline_geometry::so3;
use trueline_method::stripe::outcome::Because;
use trueline_method::{Calibration, Config, Measurements, Status, calibrate};
use trueline_sim::{
    Between, Disturbance, Joint as Scene, Look, PictureScan, PlateForm, PlatePair, Plates, Preset,
    ProfileLook, Scenario, SensorModel, random_cell, scan_profiles, simulate,
};
use trueline_vision::profile::{self, ProfileJoint};
use trueline_vision::{Detector, Joint, find_seams};

/// Pictures in memory.
struct Pictures(Vec<(FrameStamp, GrayImage)>);

impl PictureSource for Pictures {
    fn count(&self) -> usize {
        self.0.len()
    }

    fn stamp(&self, number: usize) -> FrameStamp {
        self.0[number].0
    }

    fn name(&self, number: usize) -> String {
        format!("picture {number}")
    }

    fn read(&self, number: usize, _: &mut Vec<u8>) -> Result<GrayImage, Error> {
        Ok(self.0[number].1.clone())
    }
}

/// A camera of half as many pixels each way, and a picture every quarter of a second.
fn scenario() -> Scenario {
    let mut scenario = Preset::Good.scenario();
    if let SensorModel::CameraLaser { camera, .. } = &mut scenario.cell.sensor {
        camera.size = camera.size.map(|n| n / 2);
        camera.focal *= 0.5;
        camera.centre = 0.5 * camera.centre - Vector2::repeat(0.25);
    }
    scenario.timing.frame_period_s = 0.25;
    scenario
}

fn pictures(scenario: &Scenario, scene: Scene, look: Look, seed: u64) -> Pictures {
    let scan = PictureScan::new(scenario, scene, look, seed).unwrap();
    let mut renderer = scan.renderer();
    let draw = |exposed: &trueline_sim::Exposed| {
        let stamp = FrameStamp { stamp_ns: exposed.stamp_ns, frame: exposed.frame, device_ns: None };
        (stamp, scan.draw(&mut renderer, exposed).image)
    };
    Pictures(scan.exposures().iter().map(draw).collect())
}

/// The errors of offset, rotation and translation, each in its own sigma.
fn z(result: &Calibration, truth: &Guess) -> Vec<f64> {
    let offset = result.time_offset().unwrap();
    let hand_eye = result.tool_from_camera().unwrap();
    let (found, true_one) = (hand_eye.tool_from_camera, truth.tool_from_camera);
    let turned = so3::log(&(found.rotation * true_one.rotation.inverse()));
    let moved = found.translation.vector - true_one.translation.vector;
    let mut z = vec![(offset.value_s - truth.time_offset_s) / offset.sigma_s.unwrap()];
    let variances = hand_eye.covariance.diagonal();
    let errors = turned.iter().chain(moved.iter()).zip(variances.iter());
    z.extend(errors.map(|(error, variance)| error / variance.sqrt()));
    z
}

/// With noise alone in their ±, and beside the seam points of the same pictures.
#[test]
fn whole_stripes_of_pictures_with_speckle_and_mirrors_calibrate_within_four_sigma_and_agree() {
    let scenario = scenario();
    let corner = Scene::Corner { opening_rad: std::f64::consts::FRAC_PI_2 };
    for (scene, look, seed) in [
        (Scene::fillet(), Look::speckled(), 1),
        (Scene::fillet(), Look::shiny(), 2),
        (corner, Look::speckled(), 3),
        (Scene::Lap { step_m: 3e-3 }, Look::speckled(), 4),
        (Scene::Lap { step_m: 3e-3 }, Look::shiny(), 5),
        (Scene::Edge, Look::speckled(), 6),
        (Scene::Butt { gap_m: 1.5e-3, mismatch_m: 0.0 }, Look::speckled(), 7),
    ] {
        let mut data = simulate(&scenario, seed).unwrap();
        let detector = Detector::for_sensor(&data.sensor).unwrap();
        let scan = find_seams(&pictures(&scenario, scene, look, seed), &detector, None, &()).unwrap();
        (data.features, data.stripes) = (scan.features(), scan.stripes());
        let truth = data.truth.take().unwrap().parameters;
        for measurements in [Measurements::Stripe, Measurements::Both] {
            if scene == Scene::Edge && measurements == Measurements::Both {
                // Of one plate alone, all of a frame is its stripe and its edge.
                continue;
            }
            let config = Config { measurements, ..Config::noise_only() };
            let result = calibrate(&data, None, &config).unwrap();
            let z = z(&result, &truth);
            println!("{scene:?} {measurements:?}: {:?}, z {z:.1?}", result.status());
            assert!(z.iter().all(|z| z.abs() < 4.0), "{scene:?}: z {z:.2?}");
            let stripes = result.findings.stripes.as_ref().unwrap();
            let apart = stripes.estimate.as_ref().unwrap().sigmas_apart.unwrap();
            println!(
                "    {} of {} frames with all plates, {apart:.1} apart",
                stripes.with_both, stripes.frames
            );
            assert!(apart < 3.0, "{scene:?}: {apart}");
        }
    }
}

/// Bowed fillets with default options, and with noise alone in the ±, which hides nothing: the stripes are the answer
/// because they agree with the seam points, at the crossing of the bowed faces. Crossings of straight lines through faces of
/// 0.1 mm of bow lie 0.1 mm beside it in every profile, were up to 14 sigma off, and were taken because the stripes did not
/// agree.
#[test]
fn profiles_of_bowed_plates_calibrate_within_four_sigma_as_a_user_calibrates_them() {
    let [square, cube, all] = [[1.0, 0.0], [0.0, 1.0], [1.0, 1.0]];
    for (bow_m, [of_square, of_cube], seed) in [
        (0.0, all, 1),
        (2e-5, square, 2),
        (1e-4, square, 4),
        (2e-4, square, 5),
        (2e-5, all, 7),
        (1e-4, all, 8),
        (2e-4, all, 8),
        (-2e-4, all, 6),
        (2e-4, cube, 5),
        (-2e-4, cube, 9),
    ] {
        // Along the seam they are straight: a bent seam is no line for seam points. This profiler sees 60 mm of a plate, where a bow of 0.2 mm is one of
        // 1.2 mm by the square and of 2.8 mm by the cube.
        let across = bow_m * of_square;
        let cubic = [bow_m * of_cube, 0.0, 0.0, 0.0];
        let form = PlateForm { across, twist: across, cubic, ..PlateForm::default() };
        let plates = Plates { forms: [form; 2], ..Plates::default() };
        let cell = random_cell(&Preset::Profiler.scenario(), seed, 1.0);
        let (mut data, profiles) = scan_profiles(&cell, &plates, &ProfileLook::default(), seed).unwrap();
        let found = profile::seams(&profiles, None).found;
        (data.features, data.stripes) = (found.features, found.stripes);
        let truth = data.truth.take().unwrap().parameters;
        for config in [Config::default(), Config::noise_only()] {
            let result = calibrate(&data, None, &config).unwrap();
            let stripes = result.findings.stripes.as_ref().unwrap();
            assert_eq!((stripes.used, stripes.because), (Measurements::Stripe, Because::Agreement));
            let z_of_stripes = z(&result, &truth);
            let seam = Config { measurements: Measurements::Seam, ..config };
            let z_of_seam = z(&calibrate(&data, None, &seam).unwrap(), &truth);
            println!("{:.0} µm: z {z_of_stripes:.1?}, by seam points {z_of_seam:.1?}", bow_m * 1e6);
            assert!(z_of_stripes.iter().chain(&z_of_seam).all(|z| z.abs() < 4.0), "{bow_m}");
        }
    }
}

/// Exact profiles from nothing: the search must not narrow on a tenth of a micrometre, of which a thousand are no part of the view.
#[test]
fn noise_free_scans_of_profiles_are_recovered_exactly() {
    for seed in [1, 9, 12] {
        let mut cell = random_cell(&Preset::Profiler.scenario(), seed, 1.0);
        cell.disturbance = Disturbance::default();
        cell.timing.between = Between::Straight;
        let look = ProfileLook::default().without_noise();
        let (mut data, profiles) = scan_profiles(&cell, &Plates::default(), &look, seed).unwrap();
        let found = profile::seams(&profiles, None).found;
        (data.features, data.stripes) = (found.features, found.stripes);
        let truth = data.truth.take().unwrap().parameters;
        let result = calibrate(&data, None, &Config::noise_only()).unwrap();
        assert_eq!(result.status(), Status::Accepted, "seed {seed}: {:?}", result.reasons());
        let (offset, hand_eye) = (result.time_offset().unwrap(), result.tool_from_camera().unwrap());
        let apart = truth.tool_from_camera.inverse() * hand_eye.tool_from_camera;
        // Rounding of a second, and of 0.5 m, in sums of some hundred frames.
        assert!((offset.value_s - truth.time_offset_s).abs() < 1e-11, "seed {seed}: {offset:?}");
        assert!(apart.translation.vector.norm() < 1e-10 && apart.rotation.angle() < 1e-10, "{apart:?}");
    }
}

/// With drop-outs, more of them at edges, columns that see an edge in part, reflections, and a gap with something visible
/// through it: the joint is recognised in the profiles.
#[test]
fn a_scan_of_profiles_of_an_edge_and_of_a_gap_calibrates_within_four_sigma() {
    let rounded = ProfileLook { rounded_m: 3e-4, ..ProfileLook::default() };
    for (pair, joint, look) in [
        (PlatePair::Edge, ProfileJoint::Edge, ProfileLook::default()),
        (PlatePair::Edge, ProfileJoint::Edge, rounded),
        (PlatePair::Butt { gap_m: 1.5e-3, mismatch_m: 0.0 }, ProfileJoint::Butt, ProfileLook::default()),
        (PlatePair::Butt { gap_m: 2.5e-3, mismatch_m: 0.3e-3 }, ProfileJoint::Butt, rounded),
    ] {
        let plates = Plates { pair, ..Plates::default() };
        let (mut data, profiles) = scan_profiles(&Preset::Profiler.scenario(), &plates, &look, 7).unwrap();
        let seams = profile::seams(&profiles, None);
        println!("{pair:?}: {} of {}, {:?}", seams.found.features.len(), profiles.len(), seams.reasons());
        assert_eq!(seams.joint, joint);
        assert!(seams.found.features.len() * 10 > profiles.len() * 8, "{:?}", seams.reasons());
        (data.features, data.stripes) = (seams.found.features, seams.found.stripes);
        let truth = data.truth.take().unwrap().parameters;
        for measurements in [Measurements::Seam, Measurements::Auto] {
            let config = Config { measurements, ..Config::noise_only() };
            let result = calibrate(&data, None, &config).unwrap();
            let z = z(&result, &truth);
            println!("    {measurements:?} {:?}, z {z:.1?}", result.status());
            if measurements == Measurements::Auto {
                assert_eq!(result.findings.stripes.as_ref().unwrap().used, Measurements::Stripe, "{pair:?}");
            }
            assert!(z.iter().all(|z| z.abs() < 4.0), "{pair:?}: z {z:.2?}");
        }
    }
}

#[test]
fn a_scan_of_each_target_calibrates_to_within_four_sigma() {
    let scenario = scenario();
    let square = std::f64::consts::FRAC_PI_2;
    for (seed, (scene, joint)) in [
        (Scene::fillet(), Joint::Fillet),
        (Scene::Lap { step_m: 3e-3 }, Joint::Lap),
        (Scene::Corner { opening_rad: square }, Joint::Corner),
        (Scene::Edge, Joint::Edge),
        (Scene::Step { height_m: 5e-3, lean_rad: 0.8 }, Joint::Step),
        (Scene::Groove { width_m: 14e-3, root_m: 4e-3, depth_m: 6e-3 }, Joint::Groove),
        (Scene::VGroove { depth_m: 5e-3, opening_rad: square }, Joint::VGroove),
        (Scene::VBlock { depth_m: 0.1, opening_rad: square, slot_m: 10e-3 }, Joint::VBlock),
    ]
    .into_iter()
    .enumerate()
    {
        let mut data = simulate(&scenario, seed as u64).unwrap();
        let detector = Detector::for_sensor(&data.sensor).unwrap();
        let scan =
            find_seams(&pictures(&scenario, scene, Look::speckled(), seed as u64), &detector, None, &());
        let scan = scan.unwrap();
        let found = scan.detections().count();
        println!("{joint:?}: {found} of {} pictures, as {:?}", scan.frames.len(), scan.joint);
        assert_eq!(scan.joint, joint, "{scene:?}");
        assert!(found * 5 >= scan.frames.len() * 3, "{joint:?}: {found} of {}", scan.frames.len());
        data.features = scan.features();
        let truth = data.truth.take().unwrap().parameters;
        let result = calibrate(&data, None, &Config::default()).unwrap();
        let z = z(&result, &truth);
        println!("    {:?}, z {z:.1?}", result.status());
        assert!(z.iter().all(|z| z.abs() < 4.0), "{joint:?}: z {z:.2?}");
    }
}
