//! Pictures of features that do not fit, for the report.

use crate::failure::Failure;
use crate::opened_dataset::OpenedDataset;
use trueline_dataset::{GrayImage, Measured, Pixels, gray_png};
use trueline_method::Calibration;
use trueline_report::calibration_page::FramePicture;
use trueline_vision::overlay::Canvas;

/// Pictures in a report: more make it too large to send.
const MOST: usize = 12;
/// Part of a picture that is shown about a feature, px.
const SIZE: [usize; 2] = [480, 320];

/// The worst outliers, each in its picture with a cross on it; none where the dataset has no pictures.
///
/// # Errors
/// Pictures that are named and cannot be read.
pub fn pictures(opened: &OpenedDataset, calibration: &Calibration) -> Result<Vec<FramePicture>, Failure> {
    let Some(source) = &opened.pictures else { return Ok(Vec::new()) };
    let mut outliers: Vec<_> = calibration.findings.fit.features.iter().filter(|f| f.is_outlier()).collect();
    outliers.sort_by(|a, b| b.normalised.total_cmp(&a.normalised));
    let mut pictures = Vec::new();
    for outlier in outliers {
        let feature = &opened.recording.features[outlier.row as usize];
        let number = (0..source.count()).find(|number| source.stamp(*number).stamp_ns == feature.stamp_ns);
        let (Some(number), Measured::Pixel(at)) = (number, feature.measured) else { continue };
        let image = source.read(number, &mut Vec::new())?;
        pictures.push(FramePicture { row: outlier.row, png: cut_out(&image, at)? });
        if pictures.len() == MOST {
            break;
        }
    }
    Ok(pictures)
}

/// The part of a picture about a feature as PNG.
fn cut_out(image: &GrayImage, at: [f64; 2]) -> Result<Vec<u8>, Failure> {
    let size = [SIZE[0].min(image.width), SIZE[1].min(image.height)];
    let first = |k: usize, length: usize| {
        let last = length - size[k];
        (at[k].round().max(0.0) as usize).saturating_sub(size[k] / 2).min(last)
    };
    let [left, top] = [first(0, image.width), first(1, image.height)];
    let rows = (top..top + size[1])
        .flat_map(|row| (left..left + size[0]).map(move |column| row * image.width + column));
    let levels: Vec<u8> = match &image.pixels {
        Pixels::Eight(levels) => rows.map(|k| levels[k]).collect(),
        Pixels::Sixteen(levels) => {
            let brightest = u32::from(levels.iter().copied().max().unwrap_or(0).max(255));
            rows.map(|k| (u32::from(levels[k]) * 255 / brightest) as u8).collect()
        }
    };
    let mut canvas = Canvas::new(size[0], size[1], &levels);
    canvas.cross(at[0] - left as f64, at[1] - top as f64);
    Ok(gray_png::encode_rgb(size, canvas.rgb())?)
}
