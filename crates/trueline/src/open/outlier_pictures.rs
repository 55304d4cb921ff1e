//! Pictures of features that do not fit, for the report.

use crate::open::opened::Opened;
use trueline_dataset::{Error, Measured, gray_png};
use trueline_method::Calibration;
use trueline_vision::overlay::Canvas;

/// Pictures in a report: more make it too large to send.
const MOST: usize = 12;
/// Part of a picture that is shown about a feature, px.
const SIZE: [usize; 2] = [480, 320];

/// An outlier in its picture.
#[derive(Clone, Debug)]
pub struct OutlierPicture {
    /// Row of the feature.
    pub row: u32,
    /// Part of the picture around it, PNG, with a cross on it.
    pub png: Vec<u8>,
}

/// The worst outliers, each in its picture with a cross on it; none where the dataset has no pictures.
///
/// # Errors
/// Pictures that are named and cannot be read.
pub fn outlier_pictures(opened: &Opened, calibration: &Calibration) -> Result<Vec<OutlierPicture>, Error> {
    let Some(source) = &opened.pictures else { return Ok(Vec::new()) };
    let mut outliers: Vec<_> = calibration.findings.fit.features.iter().filter(|f| f.is_outlier()).collect();
    outliers.sort_by(|a, b| b.normalised.total_cmp(&a.normalised));
    let mut pictures = Vec::new();
    for outlier in outliers {
        let feature = &opened.recording.features[outlier.row as usize];
        let number = (0..source.count()).find(|number| source.stamp(*number).stamp_ns == feature.stamp_ns);
        let (Some(number), Measured::Pixel(at)) = (number, feature.measured) else { continue };
        let image = source.read(number, &mut Vec::new())?;
        let mut canvas = Canvas::of_picture(&image);
        canvas.cross(at[0], at[1]);
        let canvas = canvas.cut_out(at, SIZE);
        pictures.push(OutlierPicture {
            row: outlier.row,
            png: gray_png::encode_rgb(canvas.size(), canvas.rgb())?,
        });
        if pictures.len() == MOST {
            break;
        }
    }
    Ok(pictures)
}
