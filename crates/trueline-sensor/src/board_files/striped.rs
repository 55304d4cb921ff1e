//! Pictures of a board with the laser's stripe on it.

use crate::Board;
use crate::board_files::error::BoardError;
use crate::board_files::pictures;
use crate::laser_plane::{BoardPicture, KnownCamera, NoStripe, StripeOn, striped_picture};
use nalgebra::SMatrix;
use rayon::prelude::*;
use std::path::{Path, PathBuf};
use trueline_dataset::sensor_setup::SensorCovariance;
use trueline_dataset::sensor_toml::CameraFile;

/// Result of one picture.
pub type Found = Result<BoardPicture, NoStripe>;

/// The camera from its file; without a covariance it is treated as exact.
#[must_use]
pub fn known(file: &CameraFile) -> KnownCamera {
    let stated = file.setup.uncertainty.as_ref().and_then(|u| u.covariance.as_ref());
    KnownCamera {
        camera: file.camera,
        covariance: stated.map_or_else(SMatrix::zeros, SensorCovariance::of_camera),
    }
}

/// Looks for board and stripe in every picture. `without_laser` is a folder that has the same pictures, by name, with the laser
/// off.
///
/// # Errors
/// Files that are not pictures, or not of this camera.
pub fn look(
    files: &[PathBuf],
    without_laser: Option<&Path>,
    camera: &CameraFile,
    ground: (&Board, StripeOn),
) -> Result<Vec<Found>, BoardError> {
    files.par_iter().map(|file| look_at(file, without_laser, camera, ground)).collect()
}

/// Adds the fit's results about the pictures with a board, in their order, to the findings.
pub fn conclude(found: &mut [Found], of_pictures: Vec<Result<(), NoStripe>>) {
    for (found, of_picture) in found.iter_mut().filter(|found| found.is_ok()).zip(of_pictures) {
        if let Err(why) = of_picture {
            *found = Err(why);
        }
    }
}

/// Why pictures are not used, one reason a line.
#[must_use]
pub fn why_not(files: &[PathBuf], found: &[Found]) -> String {
    let reason = |(file, found): (&PathBuf, &Found)| {
        Some(format!("\n  {}: {}", file.display(), found.as_ref().err()?))
    };
    files.iter().zip(found).filter_map(reason).collect()
}

fn look_at(
    file: &Path,
    without_laser: Option<&Path>,
    camera: &CameraFile,
    ground: (&Board, StripeOn),
) -> Result<Found, BoardError> {
    let (lit, _) = pictures::read(file)?;
    let found = [lit.width() as u32, lit.height() as u32];
    if found != camera.camera.size {
        let name = file.display().to_string();
        return Err(BoardError::OtherCamera { name, found, camera: camera.camera.size });
    }
    let dark = match (without_laser, file.file_name()) {
        (Some(folder), Some(name)) => Some(pictures::read(&folder.join(name))?.0),
        _ => None,
    };
    Ok(striped_picture::look(&lit, dark.as_ref(), &camera.camera, ground))
}
