//! The pictures of a simulated scan as part of a dataset folder, with the true seam beside them.

use super::renderer::Picture;
use super::scan::PictureScan;
use crate::shutter::Exposed;
use rayon::prelude::*;
use std::fs;
use std::path::Path;
use trueline_dataset::{Error, Feature, FrameFile, Measured, Problem, features_csv, gray_png, images};

/// The written pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WrittenPictures {
    /// Pictures.
    pub pictures: usize,
    /// Number with the seam.
    pub with_seam: usize,
}

/// Draws every picture with all threads of the pool, and writes `images/`, its index and `truth_features.csv` into a folder
/// that exists. `drawn` is called after each picture.
///
/// # Errors
/// A file that cannot be written.
pub fn write_pictures(
    folder: &Path,
    scan: &PictureScan<'_>,
    drawn: &(dyn Fn() + Sync),
) -> Result<WrittenPictures, Error> {
    let pictures = folder.join("images");
    fs::create_dir_all(&pictures).map_err(|error| Error::in_file(&pictures, Problem::Io(error)))?;
    let frames = scan
        .exposures()
        .par_iter()
        .map_init(
            || scan.renderer(),
            |renderer, exposed| {
                let Picture { image, seam_px, second_px } = scan.draw(renderer, exposed);
                let path = pictures.join(format!("{:06}.png", exposed.frame));
                gray_png::write(&path, &image)?;
                drawn();
                let frame =
                    FrameFile { stamp_ns: exposed.stamp_ns, frame: exposed.frame, device_ns: None, path };
                let lines = [seam_px, second_px].into_iter().flatten().zip(0..);
                let features = lines.map(|(pixel, line)| feature(exposed, line, pixel.into())).collect();
                Ok((frame, features))
            },
        )
        .collect::<Result<Vec<(FrameFile, Vec<Feature>)>, Error>>()?;
    let index: Vec<FrameFile> = frames.iter().map(|(frame, _)| frame.clone()).collect();
    images::write_index(folder, &index)?;
    let with_seam = frames.iter().filter(|(_, features)| !features.is_empty()).count();
    let truth: Vec<Feature> = frames.into_iter().flat_map(|(_, features)| features).collect();
    let file = folder.join("truth_features.csv");
    let mut text = Vec::new();
    features_csv::write(&mut text, &truth)
        .and_then(|()| fs::write(&file, text))
        .map_err(|error| Error::in_file(&file, Problem::Io(error)))?;
    Ok(WrittenPictures { pictures: index.len(), with_seam })
}

fn feature(exposed: &Exposed, line: u32, pixel: [f64; 2]) -> Feature {
    Feature {
        stamp_ns: exposed.stamp_ns,
        line,
        frame: Some(exposed.frame),
        device_ns: None,
        measured: Measured::Pixel(pixel),
        sigma: None,
        correlation: 0.0,
    }
}
