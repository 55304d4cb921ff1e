//! Faults of pictures that are named for the scan.

use crate::drawn;

use drawn::{Paper, arms, detector};
use trueline_dataset::{Error, FrameStamp, GrayImage, PictureSource, Pixels};
use trueline_vision::find_seams;
use trueline_vision::scan::PictureFault;

const SIZE: [usize; 2] = [640, 480];

struct Pictures(GrayImage);

impl PictureSource for Pictures {
    fn count(&self) -> usize {
        2
    }

    fn stamp(&self, number: usize) -> FrameStamp {
        FrameStamp { stamp_ns: number as i64, frame: number as u64, device_ns: None }
    }

    fn name(&self, number: usize) -> String {
        format!("picture {number}")
    }

    fn read(&self, _: usize, _: &mut Vec<u8>) -> Result<GrayImage, Error> {
        Ok(self.0.clone())
    }
}

/// A fillet with a stripe of a thickness and height (levels of 255) on a ground.
fn faults(sigma_px: f64, height: f64, ground: f64, bits: u32) -> Vec<&'static str> {
    let mut paper = Paper::new(SIZE, 1);
    arms([320.0, 120.0], 2000.0, sigma_px, false).iter().for_each(|stroke| paper.stroke(stroke));
    // The paper's own ground is 6 levels, and its stripes are 160 high.
    let scaled = |level: &u8| ground + (f64::from(*level) - 6.0) * height / 160.0;
    let levels = paper.levels(0.0);
    let pixels = if bits == 8 {
        Pixels::Eight(levels.iter().map(|level| scaled(level).clamp(0.0, 255.0) as u8).collect())
    } else {
        let full = f64::from(2_u32.pow(bits) - 1);
        let wide = |level: &u8| (scaled(level) * full / 255.0).clamp(0.0, full) as u16;
        Pixels::Sixteen(levels.iter().map(wide).collect())
    };
    let pictures = Pictures(GrayImage { width: SIZE[0], height: SIZE[1], pixels });
    let scan = find_seams(&pictures, &detector(SIZE), None, &()).unwrap();
    for fault in &scan.faults {
        // There is no more than all of it.
        assert!(!matches!(fault, PictureFault::SaturatedStripe { percent } if *percent > 100.0), "{fault}");
    }
    scan.faults.iter().map(PictureFault::code).collect()
}

#[test]
fn each_fault_is_named_and_a_good_picture_has_none() {
    assert_eq!(faults(2.0, 150.0, 8.0, 8), [""; 0]);
    assert_eq!(faults(2.0, 9.0, 5.0, 8), ["underexposed"]);
    assert_eq!(faults(2.0, 18.0, 25.0, 8), ["dim-stripe"]);
    assert_eq!(faults(2.0, 60.0, 180.0, 8), ["overexposed"]);
    assert_eq!(faults(2.0, 100.0, 80.0, 8), ["ambient-light"]);
    assert_eq!(faults(2.0, 600.0, 8.0, 8), ["saturated-stripe"]);
    // The measured width is the core of a stripe, here 0.69 of its standard deviation; more than 10 px are out of
    // focus.
    assert_eq!(faults(20.0, 150.0, 8.0, 8), ["out-of-focus"]);
}

#[test]
fn twelve_bits_in_sixteen_are_judged_by_what_they_use() {
    assert_eq!(faults(2.0, 150.0, 8.0, 12), [""; 0]);
    assert_eq!(faults(2.0, 600.0, 8.0, 12), ["saturated-stripe"]);
}
