//! Seam points in base as a viewer sees them while a cell is recorded.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

#[path = "../../trueline-mcap/tests/it/viewer/mod.rs"]
mod viewer;

use foxglove::messages::PointCloud;
use nalgebra::{SMatrix, Vector3};
use prost::Message;
use std::net::SocketAddr;
use std::thread;
use std::time::Duration;
use trueline::rt::{Carrier, PlacerCalibration, SensorModel, Settings};
use trueline_cell::{CellListener, LivePlacer, LiveScene};
use trueline_dataset::RobotSample;
use trueline_dataset::Sensor;
use trueline_mcap::live::{LiveView, LogLevel};
use trueline_mcap::{Entry, Listener, RobotEntry, SEAM_TOPIC};
use trueline_sim::{Preset, simulate};
use viewer::Viewer;

/// A pose of the robot as it is recorded.
fn pose(sequence: u32, sample: &RobotSample) -> Entry {
    Entry::Robot(RobotEntry {
        is_egm: false,
        ptp_ns: None,
        datagram: Vec::new(),
        from: SocketAddr::from(([127, 0, 0, 1], 1)),
        steady_ns: sample.stamp_ns,
        kernel_wall_ns: None,
        read_wall_ns: 0,
        sequence,
        device_ns: 0,
        base_from_tool: sample.base_from_tool,
    })
}

/// Root mean square distance of what a viewer saw from the true seam, m, where the time offset is off by so much.
fn distance_m(wrong_by_s: f64) -> f64 {
    let scan = simulate(&Preset::Quick.scenario(), 1).unwrap();
    let truth = scan.truth.as_ref().unwrap();
    let Sensor::CameraLaser { camera, laser_plane_in_camera } = scan.sensor else { panic!() };
    let calibration = PlacerCalibration {
        sensor: SensorModel::CameraLaser { camera, laser_plane_in_camera },
        shape: None,
        tool_from_camera: truth.parameters.tool_from_camera,
        time_offset_s: truth.parameters.time_offset_s + wrong_by_s,
        covariance: SMatrix::zeros(),
        reading_sigma_m: 2e-5,
        carrier: Carrier::Tool,
        axes: Vec::new(),
    };
    let view = LiveView::start(SocketAddr::from(([127, 0, 0, 1], 0)), "a test").unwrap();
    let channels = view.channels();
    let mut viewer = Viewer::connect(view.address());
    viewer.subscribe(&[SEAM_TOPIC, "/log"]);
    while !channels.is_wanted(SEAM_TOPIC) || !channels.is_wanted("/log") {
        thread::sleep(Duration::from_millis(5));
    }
    let line = truth.lines[0];
    let watching = thread::spawn(move || {
        let mut squares = Vec::new();
        loop {
            let (topic, _, bytes) = viewer.message();
            if topic == "/log" {
                break squares;
            }
            let cloud = PointCloud::decode(&bytes[..]).unwrap();
            let numbers: Vec<f64> = cloud
                .data
                .chunks_exact(4)
                .map(|bytes| f64::from(f32::from_le_bytes(bytes.try_into().unwrap())))
                .collect();
            let point = Vector3::new(numbers[0], numbers[1], numbers[2]);
            squares.push(line.distance(&point).powi(2));
        }
    });
    let placer = LivePlacer::new(&calibration, &Settings::default()).unwrap();
    let scene = LiveScene::new(channels.clone()).with_placer(placer, None);
    let mut features = scan.features.iter().peekable();
    for (sequence, sample) in (0..).zip(&scan.robot) {
        while let Some(feature) = features.next_if(|feature| feature.stamp_ns <= sample.stamp_ns) {
            scene.seam(feature);
        }
        scene.entry(&pose(sequence, sample));
    }
    channels.log(0, LogLevel::Info, "the end");
    let squares = watching.join().unwrap();
    assert!(squares.len() >= 50, "{}", squares.len());
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

#[test]
fn seam_points_lie_on_the_seam_at_their_true_exposure_and_nowhere_else() {
    // The noise of the preset's seam points is some 0.05 mm across.
    let right_m = distance_m(0.0);
    let wrong_m = distance_m(0.030);
    assert!(right_m < 3e-4, "{right_m}");
    assert!(wrong_m > 3.0 * right_m, "{wrong_m} beside {right_m}");
}
