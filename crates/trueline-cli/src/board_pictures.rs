//! Pictures of a board: which files, what they hold, and the board in each.

use crate::failure::Failure;
use rayon::prelude::*;
use std::path::{Path, PathBuf};
use trueline_dataset::{folder, gray_picture};
use trueline_sensor::{Board, Gray, View, chessboard};

/// A picture that was looked at.
pub struct Looked {
    /// Its file.
    pub file: PathBuf,
    /// SHA-256 of the file.
    pub sha256: String,
    /// Its size, px.
    pub size_px: [u32; 2],
    /// The board, or why there is none.
    pub view: Result<View, chessboard::NoBoard>,
}

/// The files that a user named: all pictures of a folder, by name, or the files themselves.
pub fn files(named: &[PathBuf]) -> Result<Vec<PathBuf>, Failure> {
    let mut files = Vec::new();
    for path in named {
        if path.is_dir() {
            files.extend(in_folder(path)?);
        } else {
            files.push(path.clone());
        }
    }
    Ok(files)
}

fn in_folder(path: &Path) -> Result<Vec<PathBuf>, Failure> {
    let listed = std::fs::read_dir(path)
        .map_err(|e| Failure::new(format!("{}: cannot be read: {e}", path.display()), "check the path"))?;
    let mut files: Vec<PathBuf> = listed
        .filter_map(|entry| Some(entry.ok()?.path()))
        .filter(|file| gray_picture::is_picture(file))
        .collect();
    files.sort();
    if files.is_empty() {
        return Err(Failure::new(
            format!("{}: there are no pictures", path.display()),
            "pictures are .png, .jpg or .jpeg",
        ));
    }
    Ok(files)
}

/// Looks for the board in every file. All pictures must be of one size.
pub fn look(files: &[PathBuf], board: &Board) -> Result<Vec<Looked>, Failure> {
    let looked: Vec<Looked> = files
        .par_iter()
        .map(|file| {
            let (gray, sha256) = read(file)?;
            let size_px = [gray.width() as u32, gray.height() as u32];
            Ok(Looked { file: file.clone(), sha256, size_px, view: chessboard::find(&gray, board) })
        })
        .collect::<Result<_, Failure>>()?;
    if let Some(pair) = looked.windows(2).find(|pair| pair[0].size_px != pair[1].size_px) {
        return Err(Failure::new(
            format!(
                "{} has {} x {} pixels, {} has {} x {}",
                pair[0].file.display(),
                pair[0].size_px[0],
                pair[0].size_px[1],
                pair[1].file.display(),
                pair[1].size_px[0],
                pair[1].size_px[1]
            ),
            "all pictures must be of one camera and one setting",
        ));
    }
    Ok(looked)
}

/// A picture's gray levels, and the SHA-256 of its file.
pub fn read(file: &Path) -> Result<(Gray, String), Failure> {
    let bytes = gray_picture::bytes(file)?;
    let image = gray_picture::decode(file, &bytes)?;
    let gray = Gray::new(image.width, image.height, image.levels_f32()).ok_or_else(|| {
        Failure::new(format!("{}: the picture is empty", file.display()), "is the file cut off?")
    })?;
    Ok((gray, folder::sha256(&bytes)))
}
