//! Tests that a result has one hand-eye transform for one sensor file: the stated one, or the corrected one that was written.

use nalgebra::{DMatrix, DVector, Point3, Vector2, Vector3};
use trueline_dataset::result_file::SensorFileEntry;
use trueline_dataset::{Measured, Recording, Sensor};
use trueline_geometry::{Plane, Pose, se3};
use trueline_method::{Calibration, Config, SensorMode, calibrate};
use trueline_model::LaserSheet;
use trueline_sim::{Disturbance, Preset, random_cell, simulate};

/// The same recording with a laser plane stated a quarter of a millimetre off.
fn stated_wrong(recording: &Recording) -> Recording {
    let mut recording = recording.clone();
    if let Sensor::CameraLaser { laser_plane_in_camera: plane, .. } = &mut recording.sensor {
        *plane = Plane::new(plane.normal().into_inner(), plane.offset() + 0.25e-3).unwrap();
    }
    recording
}

/// A scan of a random cell, with feature noise alone or without noise.
fn scan(seed: u64, noisy: bool) -> Recording {
    let mut scenario = random_cell(&Preset::Good.scenario(), 1, 0.1);
    let Disturbance { feature_noise_px, .. } = scenario.disturbance;
    scenario.disturbance = Disturbance::default();
    if noisy {
        scenario.disturbance.feature_noise_px = feature_noise_px;
    }
    simulate(&scenario, seed).unwrap()
}

fn calibrated(recording: &Recording) -> Calibration {
    calibrate(recording, None, &Config { sensor: SensorMode::Prior, ..Config::noise_only() }).unwrap()
}

/// Places of the scan's pixels by a sensor's file, camera frame, m.
fn points(sensor: &Sensor, recording: &Recording) -> Vec<Vector3<f64>> {
    let Sensor::CameraLaser { camera, laser_plane_in_camera } = sensor else { panic!("a camera") };
    let sheet = LaserSheet::from_plane(*laser_plane_in_camera);
    let lift = |pixel: [f64; 2]| sheet.intersect(&camera.ray(&Vector2::from(pixel)).unwrap().0).unwrap().0;
    let pixel = |measured| if let Measured::Pixel(pixel) = measured { pixel } else { panic!("pixels") };
    recording.features.iter().map(|feature| lift(pixel(feature.measured))).collect()
}

fn rms_m(tool_from_camera: &Pose, points: &[Vector3<f64>], wanted: &[Vector3<f64>]) -> f64 {
    let squares = points.iter().zip(wanted).map(|(point, wanted)| {
        (tool_from_camera * Point3::from(*point)).coords.metric_distance(wanted).powi(2)
    });
    (squares.sum::<f64>() / points.len() as f64).sqrt()
}

#[test]
fn the_stated_files_transform_leaves_the_predicted_rms_and_is_the_best() {
    let recording = scan(1, false);
    let truth = recording.truth.as_ref().unwrap().parameters.tool_from_camera;
    let there: Vec<Vector3<f64>> = points(&recording.sensor, &recording)
        .iter()
        .map(|point| (truth * Point3::from(*point)).coords)
        .collect();
    let wrong = stated_wrong(&recording);
    let c = calibrated(&wrong);
    let stated = c.findings.unknowns.stated.clone().unwrap();
    let (pose, as_stated) = (c.tool_from_camera().unwrap().tool_from_camera, points(&wrong.sensor, &wrong));
    let left_m = rms_m(&pose, &as_stated, &there);
    // The scan's points are not the grid of the field: they are denser in its middle, where the remainder is smaller.
    assert!((0.4..1.1).contains(&(left_m / stated.remains_m)), "{left_m} {}", stated.remains_m);
    // The transform of the corrected file, used with the stated one, is several times worse.
    let file = SensorFileEntry { corrected: true, ..SensorFileEntry::default() };
    let corrected = c.for_corrected_sensor(file).unwrap();
    let mixed_m = rms_m(corrected.file_tool_from_camera(), &as_stated, &there);
    assert!(mixed_m > 3.0 * left_m, "{mixed_m} {left_m}");
}

#[test]
fn the_written_files_transform_leaves_nothing() {
    let recording = scan(1, false);
    let truth = recording.truth.as_ref().unwrap().parameters.tool_from_camera;
    let there: Vec<Vector3<f64>> = points(&recording.sensor, &recording)
        .iter()
        .map(|point| (truth * Point3::from(*point)).coords)
        .collect();
    let c = calibrated(&stated_wrong(&recording));
    let corrected = c.findings.unknowns.corrected.clone().unwrap();
    let file = SensorFileEntry { corrected: true, ..SensorFileEntry::default() };
    let c = c.for_corrected_sensor(file).unwrap();
    let left_m = rms_m(c.file_tool_from_camera(), &points(&corrected.sensor, &recording), &there);
    // The two free numbers of the seven change the lens distortion slightly.
    assert!(left_m < 3e-6, "{left_m}");
}

/// eᵀ C⁻¹ e of the hand-eye transform relative to that of the noise-free scan.
fn normalised(c: &Calibration, without_noise: &Calibration) -> f64 {
    let (turn, shift) =
        se3::difference_decoupled(c.file_tool_from_camera(), without_noise.file_tool_from_camera());
    let error = DVector::from_iterator(6, turn.iter().chain(shift.iter()).copied());
    let covariance = DMatrix::from_fn(6, 6, |i, j| c.covariance(1 + i, 1 + j).unwrap());
    error.dot(&covariance.cholesky().unwrap().solve(&error))
}

#[test]
fn the_uncertainty_is_that_of_the_files_transform() {
    const SCANS: u64 = 20;
    let file = || SensorFileEntry { corrected: true, ..SensorFileEntry::default() };
    let exact = calibrated(&stated_wrong(&scan(1, false)));
    let exact_corrected = exact.clone().for_corrected_sensor(file()).unwrap();
    let mut sums = [0.0; 2];
    for seed in 0..SCANS {
        let c = calibrated(&stated_wrong(&scan(seed, true)));
        // For one file the transform is more certain than together with a shape.
        let found = c.best_fit_covariance().view((1, 1), (3, 3)).trace();
        let of_file: f64 = (1..4).map(|k| c.sigma(k).unwrap().powi(2)).sum();
        assert!(of_file < found, "{of_file} {found}");
        sums[0] += normalised(&c, &exact) / (6.0 * SCANS as f64);
        let corrected = c.for_corrected_sensor(file()).unwrap();
        sums[1] += normalised(&corrected, &exact_corrected) / (6.0 * SCANS as f64);
    }
    println!("{sums:.2?}");
    // χ² with 120 degrees of freedom, normalised: ± 0.13, four times.
    assert!(sums.iter().all(|mean| (0.5..1.5).contains(mean)), "{sums:?}");
}

#[test]
fn a_laser_plane_behind_the_camera_or_through_it_is_named() {
    let scan = scan(3, true);
    let with_offset = |factor: f64| {
        let mut recording = scan.clone();
        if let Sensor::CameraLaser { laser_plane_in_camera: plane, .. } = &mut recording.sensor {
            *plane = Plane::new(plane.normal().into_inner(), plane.offset() * factor).unwrap();
        }
        calibrate(&recording, None, &Config::default()).unwrap_err()
    };
    let behind = with_offset(-1.0);
    assert!(matches!(behind, trueline_method::Error::LaserPlaneBehind { .. }), "{behind}");
    // Zero, and metres that were taken for millimetres.
    for factor in [0.0, 1e-3] {
        let in_lens = with_offset(factor);
        assert!(matches!(in_lens, trueline_method::Error::LaserPlaneInLens { .. }), "{factor}: {in_lens}");
    }
}
