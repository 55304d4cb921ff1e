//! A cast recording as the estimator takes it, and how far its answer is off.

use nalgebra::SVector;
use std::collections::BTreeMap;
use std::path::Path;
use trueline_dataset::folder::RobotPoses;
use trueline_dataset::pose_folder::{PoseDataset, PoseTruth};
use trueline_dataset::sensor_setup::Mounted;
use trueline_geometry::{Pose, Trajectory, se3};
use trueline_sensor::Error;
use trueline_sensor::board_files::BoardError;
use trueline_sensor::board_files::pose_scan::{self, PoseScan, SightingOptions};
use trueline_sensor::board_hand_eye::joint::SIZE;
use trueline_sensor::board_hand_eye::poses::{self, PoseOptions};
use trueline_sensor::board_hand_eye::{Carried, ErrorModel, PoseFit, ReportedPose, RobotPath};
use trueline_sim::noise::Noise;
use trueline_sim::{Sighted, SightingScan, SlowErrors};

/// The answer for a scan's shadow; the robot's noise is the simulated one.
pub(crate) fn calibrated(scan: &SightingScan, options: &PoseOptions) -> Result<PoseFit, Error> {
    with_noise(&scan.cast(), scan.robot_noise, options)
}

/// The answer for a cast recording of a usual robot.
#[allow(dead_code, reason = "not every user casts by itself")]
pub(crate) fn calibrated_cast(cast: &Sighted, options: &PoseOptions) -> Result<PoseFit, Error> {
    with_noise(cast, SightingScan::usual(0).robot_noise, options)
}

fn with_noise(
    cast: &Sighted,
    [position_m, rotation_rad]: [f64; 2],
    options: &PoseOptions,
) -> Result<PoseFit, Error> {
    let fixed = cast.setup.mounted == Mounted::Fixed;
    let carries = if fixed { Carried::Target } else { Carried::Camera };
    let noise = ErrorModel { position_m, rotation_rad, stamp_s: 0.0, carries };
    let poses: Vec<Pose> = cast
        .robot
        .iter()
        .map(|sample| if fixed { sample.base_from_tool.inverse() } else { sample.base_from_tool })
        .collect();
    let seconds = |stamp_ns: i64| (stamp_ns - cast.robot[0].stamp_ns) as f64 * 1e-9;
    let reported: Vec<ReportedPose> = cast
        .sightings
        .iter()
        .map(|s| ReportedPose { camera_from_target: s.camera_from_target, sigma: s.sigma })
        .collect();
    if cast.at_stops {
        return poses::calibrate(&reported, RobotPath::Stops(&poses), &noise, options);
    }
    let times = cast.robot.iter().map(|sample| seconds(sample.stamp_ns)).collect();
    let trajectory = Trajectory::new(times, &poses).unwrap();
    let stamps_s: Vec<f64> = cast.sightings.iter().map(|s| seconds(s.stamp_ns)).collect();
    let robot = RobotPath::Moving { trajectory: &trajectory, stamps_s: &stamps_s };
    poses::calibrate(&reported, robot, &noise, options)
}

/// Estimate less truth, in the order of the covariance.
pub(crate) fn off(fit: &PoseFit, truth: &PoseTruth) -> SVector<f64, SIZE> {
    let mut off = SVector::<f64, SIZE>::zeros();
    off[0] = fit.unknowns.time_offset_s - truth.parameters.time_offset_s;
    let pairs = [
        (1, &fit.unknowns.tool_from_camera, &truth.parameters.tool_from_camera),
        (7, &fit.unknowns.base_from_target, &truth.base_from_target),
    ];
    for (first, found, expected) in pairs {
        let (turn, shift) = se3::difference_decoupled(found, expected);
        off.fixed_rows_mut::<3>(first).copy_from(&turn);
        off.fixed_rows_mut::<3>(first + 3).copy_from(&shift);
    }
    off
}

/// Standard deviation of one of the unknowns.
#[allow(dead_code, reason = "the studies have covariances of their own")]
pub(crate) fn sigma_of(fit: &PoseFit, k: usize) -> f64 {
    fit.covariance[(k, k)].max(0.0).sqrt()
}

/// How a robot errs from stop to stop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Robot {
    /// Anew at each.
    Restless,
    /// Slowly over its workspace.
    Slow,
}

/// Position errors of the robot at stops, per axis, m: of an accuracy of six times as much.
const ROBOT_M: f64 = 0.05e-3;
/// Arm that converts them to errors of the attitude, m: as it is assumed of a robot.
const ARM_M: f64 = 1.5;

/// The answer of a whole dataset at stops, with the accuracy of the robot stated.
#[allow(dead_code, reason = "not every user has stops")]
pub(crate) fn at_stops(scan: &SightingScan, robot: Robot) -> Result<PoseScan, BoardError> {
    let errors = [ROBOT_M, ROBOT_M / ARM_M];
    let robot_noise = if robot == Robot::Restless { errors } else { [0.0; 2] };
    let mut cast = SightingScan { robot_noise, ..scan.clone() }.cast();
    if robot == Robot::Slow {
        let (mut draw, middle) = (Noise::new(scan.seed, 79), cast.robot[0].base_from_tool);
        SlowErrors::drawn(&mut draw, middle, errors[0], errors[1]).add_to(&mut cast.robot);
    }
    let read = PoseDataset {
        setup: cast.setup,
        robot: RobotPoses {
            samples: cast.robot,
            at_stops: cast.at_stops,
            file_name: "robot.csv",
            sha256: String::new(),
        },
        sightings: cast.sightings,
        inputs: BTreeMap::new(),
        notes: Vec::new(),
    };
    let options = SightingOptions { robot_accuracy_m: Some(6.0 * ROBOT_M), ..SightingOptions::default() };
    pose_scan::calibrate(Path::new("cast"), &read, &options)
}
