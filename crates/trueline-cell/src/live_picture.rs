//! The last picture for people to look at: made small, with the seam that was found in it.
//!
//! Nothing is done without a request in the last seconds, and at most twice a second. The camera's thread never waits.

use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};
use trueline_dataset::{Feature, GrayImage, Measured, Pixels};

/// Columns of a small picture at most.
const WIDTH: usize = 816;
/// Between pictures.
const EVERY: Duration = Duration::from_millis(500);
/// Without a request for this time the observer has left.
const ATTENTION: Duration = Duration::from_secs(15);

/// A small picture.
#[derive(Clone, Debug, PartialEq)]
pub struct SmallPicture {
    /// Columns, px.
    pub width: usize,
    /// Rows, px.
    pub height: usize,
    /// Levels, row by row.
    pub gray: Vec<u8>,
    /// Columns and rows of the picture that it was made from, px.
    pub size_px: [usize; 2],
    /// The seam in that picture, px, if found.
    pub seam_px: Option<[f64; 2]>,
    /// The picture's number.
    pub frame: u64,
}

/// Place of the camera's last picture.
#[derive(Debug, Default)]
pub struct LivePicture {
    asked: Mutex<Option<Instant>>,
    last: Mutex<Option<(Instant, SmallPicture)>>,
}

impl LivePicture {
    /// The last picture; the next call finds a newer one.
    #[must_use]
    pub fn look(&self) -> Option<SmallPicture> {
        *self.asked.lock().unwrap_or_else(PoisonError::into_inner) = Some(Instant::now());
        self.last.lock().unwrap_or_else(PoisonError::into_inner).as_ref().map(|(_, picture)| picture.clone())
    }

    /// Takes a picture if somebody looks; whether it was taken.
    pub fn offer(&self, image: &GrayImage, frame: u64, seam: Option<&Feature>) -> bool {
        let (Ok(asked), Ok(mut last)) = (self.asked.try_lock(), self.last.try_lock()) else { return false };
        let is_wanted = asked.is_some_and(|at| at.elapsed() < ATTENTION);
        if !is_wanted || last.as_ref().is_some_and(|(at, _)| at.elapsed() < EVERY) {
            return false;
        }
        let seam_px = seam.and_then(|feature| match feature.measured {
            Measured::Pixel(at_px) => Some(at_px),
            Measured::Profile(_) | Measured::Point(_) => None,
        });
        *last = Some((Instant::now(), small(image, frame, seam_px)));
        true
    }
}

/// The brightest of each few pixels: a thin stripe stays.
fn small(image: &GrayImage, frame: u64, seam_px: Option<[f64; 2]>) -> SmallPicture {
    let step = image.width.div_ceil(WIDTH).max(1);
    let (width, height) = (image.width / step, image.height / step);
    let mut gray = vec![0_u8; width * height];
    let mut take = |index: usize, level: u8| {
        let (row, column) = (index / image.width / step, index % image.width / step);
        if row < height && column < width {
            let small = &mut gray[row * width + column];
            *small = level.max(*small);
        }
    };
    match &image.pixels {
        Pixels::Eight(levels) => levels.iter().enumerate().for_each(|(k, level)| take(k, *level)),
        Pixels::Sixteen(levels) => {
            // At any depth, the brightest level is white.
            let white = f32::from(levels.iter().copied().max().unwrap_or(1).max(1));
            levels
                .iter()
                .enumerate()
                .for_each(|(k, level)| take(k, (255.0 * f32::from(*level) / white) as u8));
        }
    }
    SmallPicture { width, height, gray, size_px: [image.width, image.height], seam_px, frame }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;

    #[test]
    fn a_picture_is_taken_when_somebody_looks_and_a_thin_stripe_stays() {
        let mut levels = vec![3_u8; 2448 * 20];
        levels[2448 * 7 + 1001] = 250;
        let image = GrayImage { width: 2448, height: 20, pixels: Pixels::Eight(levels) };
        let live = LivePicture::default();
        assert!(!live.offer(&image, 1, None), "nobody has asked");
        assert_eq!(live.look(), None);
        let measured = Measured::Pixel([1001.0, 7.0]);
        let seam = Feature {
            stamp_ns: 0,
            line: 0,
            frame: None,
            device_ns: None,
            measured,
            sigma: None,
            correlation: 0.0,
        };
        assert!(live.offer(&image, 2, Some(&seam)));
        assert!(!live.offer(&image, 3, None), "too soon after the last");
        let small = live.look().unwrap();
        assert_eq!((small.width, small.height, small.size_px, small.frame), (816, 6, [2448, 20], 2));
        assert_eq!(small.seam_px, Some([1001.0, 7.0]));
        let bright: Vec<usize> = (0..small.gray.len()).filter(|k| small.gray[*k] > 3).collect();
        // Row 7 of 20 and column 1001 of 2448, three to one.
        assert_eq!(bright, [2 * 816 + 333]);
    }

    #[test]
    fn sixteen_bits_are_shown_from_black_to_white() {
        let image = GrayImage { width: 2, height: 1, pixels: Pixels::Sixteen(vec![0, 1000]) };
        assert_eq!(small(&image, 0, None).gray, [0, 255]);
    }
}
