//! A cast scan of a round target as the estimator takes it, and how far its answer is off.

use nalgebra::SVector;
use std::path::Path;
use trueline_dataset::pose_folder::PoseTruth;
use trueline_dataset::{Recording, Sensor};
use trueline_geometry::se3;
use trueline_sensor::board_files::BoardError;
use trueline_sensor::board_files::pose_scan::SightingOptions;
use trueline_sensor::board_files::sphere_scan::{self, SphereScan, SphereScanOptions};
use trueline_sim::{RoundScan, RoundScanned};

/// The radius is stated, the robot is ideal but for its noise, and the rest is as usual.
pub(crate) fn options(scan: &RoundScan) -> SphereScanOptions {
    let of_scan = SightingOptions { robot_accuracy_m: Some(accuracy_m(scan)), ..SightingOptions::default() };
    SphereScanOptions { scan: of_scan, radius_m: Some(scan.radius_m), ..SphereScanOptions::default() }
}

/// At stops the noise of the robot is what its accuracy makes it: a sixth of that.
fn accuracy_m(scan: &RoundScan) -> f64 {
    if scan.sighted.at_stops { 6.0 * scan.sighted.robot_noise[0] } else { 0.0 }
}

/// The answer for what a scan casts.
pub(crate) fn calibrated(scan: &RoundScan) -> Result<SphereScan, BoardError> {
    with_options(scan, &options(scan))
}

pub(crate) fn with_options(scan: &RoundScan, options: &SphereScanOptions) -> Result<SphereScan, BoardError> {
    of_cast(scan, &scan.cast(), options)
}

/// The answer for a cast scan.
pub(crate) fn of_cast(
    scan: &RoundScan,
    cast: &RoundScanned,
    options: &SphereScanOptions,
) -> Result<SphereScan, BoardError> {
    let sighted = &cast.sighted;
    let recording = Recording {
        at_stops: scan.sighted.at_stops,
        ..Recording::new(Sensor::Profiler, sighted.setup.clone(), sighted.robot.clone(), Vec::new())
    };
    sphere_scan::calibrate(Path::new("cast"), &recording, &cast.profiles, options)
}

/// Estimate less truth, in the order of the covariance; a sphere's attitude is none.
pub(crate) fn off(found: &SphereScan, truth: &PoseTruth) -> SVector<f64, 13> {
    let unknowns = &found.sphere.pose.unknowns;
    let (turn, shift) =
        se3::difference_decoupled(&unknowns.tool_from_camera, &truth.parameters.tool_from_camera);
    let center = unknowns.base_from_target.translation.vector - truth.base_from_target.translation.vector;
    let mut off = SVector::<f64, 13>::zeros();
    off[0] = unknowns.time_offset_s - truth.parameters.time_offset_s;
    off.fixed_rows_mut::<3>(1).copy_from(&turn);
    off.fixed_rows_mut::<3>(4).copy_from(&shift);
    off.fixed_rows_mut::<3>(10).copy_from(&center);
    off
}
