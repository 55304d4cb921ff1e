//! Pictures of a plain plate with the laser's stripe on it, and where the robot stood.

use crate::board_files::error::BoardError;
use crate::board_files::pictures;
use crate::laser_plane::plate::PlateStop;
use crate::laser_plane::striped_picture::{self, NoStripe};
use rayon::prelude::*;
use std::path::Path;
use trueline_dataset::dialect::plain_file;
use trueline_dataset::picture_poses_csv::{self, PicturePose};
use trueline_dataset::sensor_setup::Mounted;
use trueline_dataset::sensor_toml::CameraFile;

/// A picture's name, and its result.
pub type Stop = (String, Result<PlateStop, NoStripe>);

/// Looks for the stripe in every picture that a table names; pictures are beside the table.
///
/// # Errors
/// A broken table; files that are not pictures, or not of this camera.
pub fn look(table: &Path, camera: &CameraFile) -> Result<Vec<Stop>, BoardError> {
    let poses = picture_poses_csv::read(table, &plain_file(table)?)?;
    let folder = table.parent().unwrap_or_else(|| Path::new(""));
    poses.into_par_iter().map(|pose| look_at(&folder.join(&pose.picture), pose, camera)).collect()
}

/// Why pictures are not used, one reason a line.
#[must_use]
pub fn why_not(stops: &[Stop]) -> String {
    stops.iter().filter_map(|(name, stop)| Some(format!("\n  {name}: {}", stop.as_ref().err()?))).collect()
}

fn look_at(file: &Path, pose: PicturePose, camera: &CameraFile) -> Result<Stop, BoardError> {
    let (lit, _) = pictures::read(file)?;
    let found = [lit.width() as u32, lit.height() as u32];
    if found != camera.camera.size {
        let name = file.display().to_string();
        return Err(BoardError::OtherCamera { name, found, camera: camera.camera.size });
    }
    let base_from_tool = match camera.setup.mounted {
        Mounted::Tool => pose.base_from_tool,
        // The robot carries the plate: load and fixed body change places.
        Mounted::Fixed => pose.base_from_tool.inverse(),
    };
    let stripe = striped_picture::on_plate(&lit, &camera.camera);
    Ok((pose.picture, stripe.map(|stripe| PlateStop { base_from_tool, stripe })))
}
