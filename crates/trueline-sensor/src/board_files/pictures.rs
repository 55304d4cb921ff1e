//! Pictures of a board: the files, their content, and the board in each.

use crate::board_files::error::BoardError;
use crate::{Board, FoundCorner, Gray, View, chessboard};
use rayon::prelude::*;
use std::path::{Path, PathBuf};
use trueline_dataset::{folder, gray_picture};

/// A picture and its findings.
#[derive(Debug)]
pub struct Looked {
    /// Its file.
    pub file: PathBuf,
    /// SHA-256 of the file.
    pub sha256: String,
    /// Its size, px.
    pub size_px: [u32; 2],
    /// The board, or the reason why there is none.
    pub view: Result<View, chessboard::NoBoard>,
}

impl Looked {
    /// File, SHA-256 and, without a board, the reason.
    #[must_use]
    pub fn stated(&self) -> (String, String, Option<String>) {
        let reason = self.view.as_ref().err().map(ToString::to_string);
        (self.file.display().to_string(), self.sha256.clone(), reason)
    }
}

/// The first reasons why pictures show no board, one a line.
#[must_use]
pub fn why_not(looked: &[Looked]) -> String {
    let reason = |l: &Looked| Some(format!("\n  {}: {}", l.file.display(), l.view.as_ref().err()?));
    looked.iter().filter_map(reason).take(5).collect()
}

/// The files that a user named: all pictures of a folder, by name, or the files themselves.
///
/// # Errors
/// A folder that cannot be read, or has no pictures.
pub fn files(named: &[PathBuf]) -> Result<Vec<PathBuf>, BoardError> {
    let mut files = Vec::new();
    for path in named {
        if path.is_dir() {
            files.extend(in_folder(path)?);
        } else if !path.exists() {
            return Err(BoardError::Missing(path.clone()));
        } else {
            files.push(path.clone());
        }
    }
    Ok(files)
}

fn in_folder(path: &Path) -> Result<Vec<PathBuf>, BoardError> {
    let listed = std::fs::read_dir(path).and_then(|entries| {
        entries.map(|entry| Ok(entry?.path())).collect::<std::io::Result<Vec<PathBuf>>>()
    });
    let mut files = listed.map_err(|error| BoardError::Folder { folder: path.to_owned(), error })?;
    files.retain(|file| gray_picture::is_picture(file));
    files.sort();
    if files.is_empty() {
        return Err(BoardError::NoPictures(path.to_owned()));
    }
    Ok(files)
}

/// Corners of two pictures that are nearer than this, root mean square, are of one picture, px. A second picture from a
/// tripod has noise of its own, but the same errors of corners and board.
const SAME_PX: f64 = 0.05;

/// Looks for the board in every file, with the threads of the current rayon pool. A picture that is there twice counts once.
///
/// # Errors
/// Files that are not pictures, and pictures of different sizes.
pub fn look(files: &[PathBuf], board: &Board) -> Result<Vec<Looked>, BoardError> {
    let mut looked: Vec<Looked> =
        files.par_iter().map(|file| look_at(file, board)).collect::<Result<_, BoardError>>()?;
    if let Some(pair) = looked.windows(2).find(|pair| pair[0].size_px != pair[1].size_px) {
        let named = |looked: &Looked| (looked.file.clone(), looked.size_px);
        return Err(BoardError::Sizes { one: named(&pair[0]), other: named(&pair[1]) });
    }
    for k in 1..looked.len() {
        if let Some(of) = (0..k).find(|first| is_same(&looked[*first], &looked[k])) {
            let of = looked[of].file.file_name().unwrap_or_default().display().to_string();
            looked[k].view = Err(chessboard::NoBoard::Repeated { of });
        }
    }
    Ok(looked)
}

/// Whether two pictures show the same corners in the same places.
fn is_same(one: &Looked, other: &Looked) -> bool {
    let (Ok(one), Ok(other)) = (&one.view, &other.view) else { return false };
    let place = |corner: &FoundCorner| (corner.column, corner.row);
    let pairs = one.corners.iter().zip(&other.corners);
    let alike = one.corners.len() == other.corners.len() && pairs.clone().all(|(a, b)| place(a) == place(b));
    let sum: f64 = pairs.map(|(a, b)| (a.pixel - b.pixel).norm_squared()).sum();
    alike && sum <= SAME_PX * SAME_PX * one.corners.len() as f64
}

fn look_at(file: &Path, board: &Board) -> Result<Looked, BoardError> {
    let (gray, sha256) = read(file)?;
    let size_px = [gray.width() as u32, gray.height() as u32];
    Ok(Looked { file: file.to_owned(), sha256, size_px, view: chessboard::find(&gray, board) })
}

/// A picture's gray levels, and the SHA-256 of its file.
///
/// # Errors
/// A file that is not a picture.
pub fn read(file: &Path) -> Result<(Gray, String), BoardError> {
    let bytes = gray_picture::bytes(file)?;
    let image = gray_picture::decode(file, &bytes)?;
    let gray = Gray::new(image.width, image.height, image.levels_f32())
        .ok_or_else(|| BoardError::Empty(file.display().to_string()))?;
    Ok((gray, folder::sha256(&bytes)))
}
