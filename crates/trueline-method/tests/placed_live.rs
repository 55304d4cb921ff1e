//! Points are where the estimate's own interpolation puts them.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use nalgebra::Vector3;
use trueline_dataset::{Measured, Sensor};
use trueline_method::Config;
use trueline_method::evaluate::seam_points;
use trueline_rt::{Carrier, Placer, PlacerCalibration, Points, SensorModel, Settings};
use trueline_sim::{Preset, simulate};

#[test]
fn a_recording_is_placed_as_by_apply() {
    let recording = simulate(&Preset::Good.scenario(), 1).unwrap();
    let known = recording.truth.as_ref().unwrap().parameters;
    let wanted = seam_points::place(&recording, &known, &Config::default()).unwrap();
    let Sensor::CameraLaser { camera, laser_plane_in_camera } = recording.sensor else { panic!("a camera") };
    let calibration = PlacerCalibration {
        sensor: SensorModel::CameraLaser { camera, laser_plane_in_camera },
        shape: recording.setup.shape,
        tool_from_camera: known.tool_from_camera,
        time_offset_s: known.time_offset_s,
        covariance: PlacerCalibration::covariance_of(0.0, 0.0, 0.0),
        reading_sigma_m: 0.0,
        carrier: Carrier::Tool,
        axes: Vec::new(),
    };
    let settings = Settings { poses_kept: recording.robot.len(), ..Settings::default() };
    let mut placer = Placer::new(&calibration, &settings).unwrap();
    for sample in &recording.robot {
        placer.push_pose(sample.stamp_ns, &sample.base_from_tool).unwrap();
    }
    let (mut compared, mut worst_m) = (0, 0.0_f64);
    for point in &wanted.list {
        let feature = &recording.features[point.row as usize];
        let Measured::Pixel(pixel) = feature.measured else { panic!("a pixel") };
        let (mut base, mut sigma) = ([[0.0; 3]; 1], [0.0; 1]);
        if placer.place(feature.stamp_ns, Points::Pixels(&[pixel]), &mut base, &mut sigma).is_ok() {
            worst_m = worst_m.max((Vector3::from(base[0]) - point.point_in_base).norm());
            compared += 1;
        }
    }
    assert!(compared * 100 > wanted.list.len() * 98, "{compared} of {}", wanted.list.len());
    // The estimate's path has straight pieces that bend by 0.5 µm (root mean square) at most: three times that at the worst.
    assert!(worst_m < 2e-6, "{worst_m}");
}
