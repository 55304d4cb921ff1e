//! Findings in pictures, for the report.

use crate::failure::Failure;
use std::path::Path;
use trueline_dataset::{PictureFolder, gray_png};
use trueline_report::picture_page::{Looked, MissingSeam, SeamPixel};
use trueline_vision::contact_sheet::{self, Sample};
use trueline_vision::scan::ScanSeams;

/// Every picture, for the report.
pub(crate) fn looked(scan: &ScanSeams) -> Vec<Looked> {
    let first_ns = scan.frames.first().map_or(0, |frame| frame.stamp.stamp_ns);
    let looked = scan.frames.iter().map(|frame| Looked {
        stamp_s: (frame.stamp.stamp_ns - first_ns) as f64 * 1e-9,
        file: Path::new(&frame.name).file_name().unwrap_or_default().to_string_lossy().into_owned(),
        seam: match &frame.found {
            Ok(found) => Ok(SeamPixel { at_px: found.seam.pixel.into(), sigma_px: found.seam.sigma_px() }),
            Err(reason) => Err(MissingSeam { code: reason.code(), text: reason.to_string() }),
        },
    });
    looked.collect()
}

/// Some pictures for the report, PNG, with their numbers.
pub(crate) fn samples(dataset: &Path, scan: &ScanSeams) -> Result<Vec<(usize, Vec<u8>)>, Failure> {
    let samples = contact_sheet::samples(&PictureFolder::open(dataset)?, scan);
    let png =
        |Sample { number, canvas }: Sample| Ok((number, gray_png::encode_rgb(canvas.size(), canvas.rgb())?));
    samples.into_iter().map(png).collect()
}
