//! A path to travel: a plan's folder, or a robot.csv.

use crate::failure::Failure;
use crate::planned_scan::PATH;
use std::path::{Path, PathBuf};
use trueline_dataset::{RobotSample, axes_folder, robot_csv};
#[cfg(feature = "live")]
use trueline_geometry::Trajectory;
#[cfg(feature = "live")]
use trueline_live::pose_feed::{small_s, through};

/// The poses of a path.
///
/// # Errors
/// A file that is missing or cannot be used; a plan that moves external axes with the robot.
pub(crate) fn read(path: &Path) -> Result<Vec<RobotSample>, Failure> {
    let axes = path.join(axes_folder::VALUES_FILE);
    if path.is_dir() && axes.exists() {
        return Err(Failure::new(
            format!(
                "{}: this plan moves external axes with the robot, and this command moves the robot alone",
                axes.display()
            ),
            "`trueline plan … --program krl,rapid` writes programs that move them too",
        ));
    }
    Ok(robot_csv::read_file(&file(path))?)
}

/// The file with the poses.
pub(crate) fn file(path: &Path) -> PathBuf {
    if path.is_dir() { path.join(PATH) } else { path.to_owned() }
}

/// The path in a file, or a small S without one.
///
/// # Errors
/// As [`read`], and times that do not rise.
#[cfg(feature = "live")]
pub(crate) fn trajectory(path: Option<&Path>) -> Result<Trajectory, Failure> {
    let Some(path) = path else { return Ok(small_s()) };
    let poses = read(path)?;
    through(&poses).map_err(|error| {
        let message = format!("{}: {error}", file(path).display());
        Failure::new(message, "a path has poses at rising times")
    })
}
