//! Controller and camera on one clock: both follow the same IEEE 1588 master, so their own stamps are the stamps.

use crate::import::stored_picture::RecordedFrame;
use crate::import_error::ImportError;
use std::collections::HashMap;
use trueline_dataset::{Feature, RobotSample};

/// Stamps robot, pictures and features by their own clocks; the robot's are given by its recorded stamp.
///
/// # Errors
/// Something that has no such time, or two clocks that never show the same time.
pub(super) fn stamp(
    robot: &mut [RobotSample],
    frames: &mut [RecordedFrame],
    features: &mut [Feature],
    ptp_ns: &HashMap<i64, i64>,
) -> Result<(), ImportError> {
    let mut without = 0;
    for sample in robot.iter_mut() {
        match ptp_ns.get(&sample.stamp_ns) {
            Some(ptp_ns) => (sample.stamp_ns, sample.device_ns) = (*ptp_ns, Some(*ptp_ns)),
            None => without += 1,
        }
    }
    refuse(without, "robot poses")?;
    let mut without = 0;
    for frame in frames.iter_mut() {
        frame.device_ns.map_or_else(|| without += 1, |device_ns| frame.stamp_ns = device_ns);
    }
    refuse(without, "pictures")?;
    let mut without = 0;
    for feature in features.iter_mut() {
        feature.device_ns.map_or_else(|| without += 1, |device_ns| feature.stamp_ns = device_ns);
    }
    refuse(without, "seam points")?;
    robot.sort_by_key(|sample| sample.stamp_ns);
    frames.sort_by_key(|frame| frame.stamp_ns);
    features.sort_by_key(|feature| feature.stamp_ns);
    let seen = frames.iter().map(|frame| frame.stamp_ns).chain(features.iter().map(|f| f.stamp_ns));
    refuse_strangers(robot, seen)
}

/// Profiles are recorded without a time of the profiler's own.
///
/// # Errors
/// Any profile.
pub(super) fn refuse_profiles(count: usize) -> Result<(), ImportError> {
    refuse(count, "profiles")
}

fn refuse(count: usize, what: &'static str) -> Result<(), ImportError> {
    if count == 0 { Ok(()) } else { Err(ImportError::NoPtp { count, what }) }
}

/// Clocks that follow one master show the same time at the same time: TAI and UTC, 37 s apart, do not.
fn refuse_strangers(robot: &[RobotSample], seen: impl Iterator<Item = i64>) -> Result<(), ImportError> {
    let (Some(first), Some(last)) = (robot.first(), robot.last()) else { return Ok(()) };
    let mut stamps = seen.peekable();
    let Some(&first_seen_ns) = stamps.peek() else { return Ok(()) };
    if stamps.any(|stamp_ns| (first.stamp_ns..=last.stamp_ns).contains(&stamp_ns)) {
        return Ok(());
    }
    let apart_s = (first_seen_ns - first.stamp_ns) as f64 * 1e-9;
    Err(ImportError::ClocksApart { apart_s })
}
