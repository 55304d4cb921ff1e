//! A cast recording as the estimator takes it, and how far its answer is off.

use nalgebra::SVector;
use trueline_dataset::pose_folder::PoseTruth;
use trueline_dataset::sensor_setup::Mounted;
use trueline_geometry::{Pose, Trajectory, se3};
use trueline_sensor::Error;
use trueline_sensor::board_hand_eye::joint::SIZE;
use trueline_sensor::board_hand_eye::poses::{self, PoseOptions};
use trueline_sensor::board_hand_eye::{Carried, ErrorModel, PoseFit, ReportedPose, RobotPath};
use trueline_sim::{Sighted, SightingScan};

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
pub(crate) fn sigma_of(fit: &PoseFit, k: usize) -> f64 {
    fit.covariance[(k, k)].max(0.0).sqrt()
}
