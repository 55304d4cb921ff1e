//! A cast scan of a round target as the estimator takes it, and how far its answer is off.

use nalgebra::{DMatrix, DVector, SMatrix, SVector, Vector3};
use std::path::Path;
use trueline_dataset::pose_folder::PoseTruth;
use trueline_dataset::{Recording, RobotSample, Sensor};
use trueline_geometry::se3;
use trueline_sensor::board_files::BoardError;
use trueline_sensor::board_files::pose_scan::SightingOptions;
use trueline_sensor::board_files::round_scan::{self, RoundCalibration, RoundCalibrationOptions};
use trueline_sensor::round::RoundTarget as Round;
use trueline_sim::noise::Noise;
use trueline_sim::{RoundScan, RoundScanned, RoundTarget, SlowErrors};

/// The radius is stated, the robot is ideal but for its noise, and the rest is as usual.
pub(crate) fn options(scan: &RoundScan) -> RoundCalibrationOptions {
    let of_scan = SightingOptions { robot_accuracy_m: Some(accuracy_m(scan)), ..SightingOptions::default() };
    let target = match scan.target {
        RoundTarget::Sphere => Round::Sphere,
        RoundTarget::Cylinder => Round::Cylinder,
    };
    RoundCalibrationOptions {
        target,
        scan: of_scan,
        radius_m: Some(scan.radius_m),
        ..RoundCalibrationOptions::default()
    }
}

/// At stops the noise of the robot is what its accuracy makes it: a sixth of that.
fn accuracy_m(scan: &RoundScan) -> f64 {
    if scan.sighted.at_stops { 6.0 * scan.sighted.robot_noise[0] } else { 0.0 }
}

/// The answer for what a scan casts.
pub(crate) fn calibrated(scan: &RoundScan) -> Result<RoundCalibration, BoardError> {
    with_options(scan, &options(scan))
}

pub(crate) fn with_options(
    scan: &RoundScan,
    options: &RoundCalibrationOptions,
) -> Result<RoundCalibration, BoardError> {
    of_cast(scan, &scan.cast(), options)
}

/// The answer for a cast scan.
pub(crate) fn of_cast(
    scan: &RoundScan,
    cast: &RoundScanned,
    options: &RoundCalibrationOptions,
) -> Result<RoundCalibration, BoardError> {
    let sighted = &cast.sighted;
    let recording = Recording {
        at_stops: scan.sighted.at_stops,
        ..Recording::new(Sensor::Profiler, sighted.setup.clone(), sighted.robot.clone(), Vec::new())
    };
    round_scan::calibrate(Path::new("cast"), &recording, &cast.profiles, options)
}

/// Estimate less truth, in the order of the covariance; zero for what the target looks the same under.
pub(crate) fn off(found: &RoundCalibration, truth: &PoseTruth) -> SVector<f64, 13> {
    let unknowns = &found.round.pose.unknowns;
    let (turn, shift) =
        se3::difference_decoupled(&unknowns.tool_from_camera, &truth.parameters.tool_from_camera);
    let target = &unknowns.base_from_target;
    let center = target.translation.vector - truth.base_from_target.translation.vector;
    let mut off = SVector::<f64, 13>::zeros();
    off[0] = unknowns.time_offset_s - truth.parameters.time_offset_s;
    off.fixed_rows_mut::<3>(1).copy_from(&turn);
    off.fixed_rows_mut::<3>(4).copy_from(&shift);
    if found.round.target == Round::Sphere {
        off.fixed_rows_mut::<3>(10).copy_from(&center);
        return off;
    }
    // In the axes of the cylinder that was found. A turn ε about these tips its y axis by ε × y = (−ε_z, 0, ε_x).
    let true_axis = target.rotation.inverse() * truth.base_from_target.rotation * Vector3::y();
    let true_axis = true_axis * true_axis.y.signum();
    (off[7], off[9]) = (-true_axis.z, true_axis.x);
    // The truth's point at the place of the one that was found.
    let center = target.rotation.inverse() * center;
    let across = center + true_axis * (-center.y / true_axis.y);
    (off[10], off[12]) = (across.x, across.z);
    off
}

/// Arm that converts a position error to an attitude error, m: as it is assumed of a robot.
pub(crate) const ARM_M: f64 = 1.5;
/// Gives the robot errors that change slowly over its workspace, of this size per axis, m.
pub(crate) fn err_slowly(robot: &mut [RobotSample], position_m: f64, seed: u64) {
    let middle = robot[0].base_from_tool;
    SlowErrors::drawn(&mut Noise::new(seed, 78), middle, position_m, position_m / ARM_M).add_to(robot);
}

/// Squared errors over their covariance, a component.
pub(crate) fn squares(off: &SVector<f64, 13>, covariance: &SMatrix<f64, 13, 13>, of: &[usize]) -> f64 {
    let part = DVector::from_iterator(of.len(), of.iter().map(|k| off[*k]));
    let block = DMatrix::from_fn(of.len(), of.len(), |i, j| covariance[(of[i], of[j])]);
    part.dot(&block.cholesky().unwrap().solve(&part)) / of.len() as f64
}
