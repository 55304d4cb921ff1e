//! Pictures that show a person what was found in a frame.

use crate::failure::Failure;
use std::fs;
use std::path::Path;
use trueline_dataset::{Error, GrayImage, Problem, gray_png};
use trueline_vision::overlay::Canvas;
use trueline_vision::{Detector, NotFound, Seam};

/// Makes the folder.
pub fn prepare(folder: &Path) -> Result<(), Failure> {
    let used = fs::read_dir(folder).is_ok_and(|mut entries| entries.next().is_some());
    if used {
        return Err(Error::in_file(folder, Problem::AlreadyExists).into());
    }
    fs::create_dir_all(folder).map_err(|e| Error::in_file(folder, Problem::Io(e)))?;
    Ok(())
}

/// Draws a frame with its pieces and its seam into a file of a name; a frame without a seam says so in it.
pub fn draw(
    name: &Path,
    image: &GrayImage,
    detector: &Detector,
    seam: &Result<Seam, NotFound>,
) -> Result<(), Failure> {
    let mut canvas = Canvas::new(image.width, image.height, &levels(image));
    for piece in detector.pieces() {
        canvas.piece(piece, detector.lens());
    }
    if let Ok(seam) = seam {
        canvas.seam(seam);
    }
    let found = if seam.is_ok() { "" } else { "-not-found" };
    let file = format!("{}{found}.png", name.display());
    Ok(gray_png::write_rgb(Path::new(&file), [image.width, image.height], canvas.rgb())?)
}

/// Levels of 8 bits.
fn levels(image: &GrayImage) -> Vec<u8> {
    match &image.pixels {
        trueline_dataset::Pixels::Eight(levels) => levels.clone(),
        trueline_dataset::Pixels::Sixteen(levels) => {
            let brightest = levels.iter().copied().max().unwrap_or(0).max(255);
            levels.iter().map(|level| (u32::from(*level) * 255 / u32::from(brightest)) as u8).collect()
        }
    }
}
