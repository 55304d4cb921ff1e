//! A path to travel: a plan's folder, or a robot.csv.

use crate::failure::Failure;
use crate::planned_scan::{PATH, read_text};
use std::path::{Path, PathBuf};
use trueline_dataset::{RobotSample, robot_csv};

/// The poses of a path.
///
/// # Errors
/// A file that is missing or cannot be used.
pub fn read(path: &Path) -> Result<Vec<RobotSample>, Failure> {
    let file = file(path);
    Ok(robot_csv::read(&file, read_text(&file)?.as_bytes())?)
}

/// The file with the poses.
pub fn file(path: &Path) -> PathBuf {
    if path.is_dir() { path.join(PATH) } else { path.to_owned() }
}
