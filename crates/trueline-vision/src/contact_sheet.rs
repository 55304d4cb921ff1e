//! Some pictures of a scan, small, with the findings in them: seams across the scan, and each kind of picture without one.

use crate::overlay::Canvas;
use crate::scan::ScanSeams;
use std::collections::BTreeSet;
use trueline_dataset::PictureSource;

/// Pictures with a seam that are shown.
const FOUND: usize = 6;
/// Columns of a shown picture, px, at most.
const WIDTH: usize = 480;

/// A picture that is shown.
#[derive(Clone, Debug)]
pub struct Sample {
    /// Its number in the scan, from 0.
    pub number: usize,
    /// The picture with crosses on its seams.
    pub canvas: Canvas,
}

/// Six pictures with a seam, evenly over the scan, and the first of each kind without one. An unreadable picture is not among them:
/// `scan` has the reason.
#[must_use]
pub fn samples(source: &dyn PictureSource, scan: &ScanSeams) -> Vec<Sample> {
    let (found, without): (Vec<usize>, Vec<usize>) =
        (0..scan.frames.len()).partition(|number| scan.frames[*number].found.is_ok());
    let shown = FOUND.min(found.len());
    let spread = (0..shown).map(|k| found[k * (found.len() - 1) / (shown - 1).max(1)]);
    let mut kinds = BTreeSet::new();
    let kinds = without.into_iter().filter(|number| {
        scan.frames[*number].found.as_ref().is_err_and(|reason| kinds.insert(reason.code()))
    });
    spread.chain(kinds).filter_map(|number| sample(source, scan, number)).collect()
}

fn sample(source: &dyn PictureSource, scan: &ScanSeams, number: usize) -> Option<Sample> {
    let image = source.read(number, &mut Vec::new()).ok()?;
    let shrink = image.width.div_ceil(WIDTH).max(1);
    let [width, height] = [image.width / shrink, image.height / shrink];
    let levels = brightest(&image.levels_u8(), image.width, shrink, [width, height]);
    let mut canvas = Canvas::new(width, height, &levels);
    for seam in scan.frames[number].found.iter().flat_map(|found| found.seams()) {
        // Pixel centres: the first of a group is half of them before their common centre.
        let small = |at: f64| (at + 0.5) / shrink as f64 - 0.5;
        canvas.cross(small(seam.pixel.x), small(seam.pixel.y));
    }
    Some(Sample { number, canvas })
}

/// The brightest pixel of each square: thin stripes stay visible.
fn brightest(levels: &[u8], columns: usize, side: usize, [width, height]: [usize; 2]) -> Vec<u8> {
    let square = |u: usize, v: usize| {
        let rows = (v * side..(v + 1) * side).map(move |row| row * columns + u * side);
        rows.flat_map(|first| levels[first..first + side].iter().copied()).max().unwrap_or(0)
    };
    (0..height).flat_map(|v| (0..width).map(move |u| (u, v))).map(|(u, v)| square(u, v)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_single_bright_pixel_stays_visible() {
        let mut levels = vec![10; 6 * 4];
        levels[3 * 6 + 4] = 200;
        assert_eq!(brightest(&levels, 6, 2, [3, 2]), [10, 10, 10, 10, 10, 200]);
    }
}
