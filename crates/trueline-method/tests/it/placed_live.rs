//! Tests that live points agree with the estimate's own interpolation.

use nalgebra::Vector3;
use trueline_dataset::{AxisRecord, Carries, Measured, Recording, Sensor};
use trueline_geometry::AxisKind;
use trueline_method::Config;
use trueline_method::evaluate::seam_points;
use trueline_rt::{
    AxisCarries, Carrier, ExternalAxis, Placer, PlacerCalibration, Points, SensorModel, Settings,
};
use trueline_sim::{
    AxisCourse, Disturbance, Preset, SimulatedAxis, random_cell, simulate, simulate_with_axes,
};

/// The truth of a simulated recording as the calibration of a placer.
fn truth(recording: &Recording) -> PlacerCalibration {
    let known = recording.truth.as_ref().unwrap().parameters;
    let Sensor::CameraLaser { camera, laser_plane_in_camera } = recording.sensor else { panic!("a camera") };
    let axis = |record: &AxisRecord| ExternalAxis {
        axis: record.known.unwrap(),
        carries: match record.carries {
            Carries::Part => AxisCarries::Part,
            Carries::Robot => AxisCarries::Robot,
            Carries::Sensor => AxisCarries::Sensor,
        },
        in_pose: None,
        covariance: ExternalAxis::covariance_of(0.0, 0.0, 0.0, 0.0),
    };
    PlacerCalibration {
        sensor: SensorModel::CameraLaser { camera, laser_plane_in_camera },
        shape: recording.setup.shape,
        tool_from_camera: known.tool_from_camera,
        time_offset_s: known.time_offset_s,
        covariance: PlacerCalibration::covariance_of(0.0, 0.0, 0.0),
        reading_sigma_m: 0.0,
        carrier: Carrier::Tool,
        axes: recording.axes.iter().map(axis).collect(),
    }
}

/// Places all readings after all poses and values have arrived. Returns the largest distance from the places by `apply`, m.
fn furthest_from_apply(recording: &Recording) -> f64 {
    let known = recording.truth.as_ref().unwrap().parameters;
    let wanted = seam_points::place(recording, &known, &Config::default()).unwrap();
    let settings = Settings { poses_kept: recording.robot.len(), ..Settings::default() };
    let mut placer = Placer::new(&truth(recording), &settings).unwrap();
    for sample in &recording.robot {
        placer.push_pose(sample.stamp_ns, &sample.base_from_tool).unwrap();
    }
    for (number, record) in recording.axes.iter().enumerate() {
        for value in &record.values {
            placer.push_axis(number, value.stamp_ns, value.value).unwrap();
        }
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
    worst_m
}

#[test]
fn a_recording_is_placed_as_by_apply() {
    // The estimate's path has straight pieces that bend by at most 0.5 µm (RMS), three times that at worst.
    let worst_m = furthest_from_apply(&simulate(&Preset::Good.scenario(), 1).unwrap());
    assert!(worst_m < 2e-6, "{worst_m}");
}

/// The estimate smooths the path relative to the axes, and a placer that of the robot alone. Without noise they are equal.
#[test]
fn a_recording_with_axes_is_placed_as_by_apply() {
    let mut scenario = random_cell(&Preset::Good.scenario(), 5, 0.3);
    scenario.disturbance = Disturbance::default();
    let swing = || AxisCourse::Swings { by: 0.4, hz: 0.11 };
    let axis =
        |name, kind, carries, seed| SimulatedAxis::somewhere(name, (kind, carries), swing(), &scenario, seed);
    for axes in [
        vec![axis("table", AxisKind::Rotary, Carries::Part, 5)],
        vec![
            axis("track", AxisKind::Linear, Carries::Robot, 6),
            axis("wrist", AxisKind::Rotary, Carries::Sensor, 7),
        ],
    ] {
        let worst_m = furthest_from_apply(&simulate_with_axes(&scenario, &axes, 5).unwrap());
        assert!(worst_m < 4e-6, "{}: {worst_m}", axes[0].name);
    }
}
