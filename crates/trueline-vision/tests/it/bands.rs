//! The light along a stripe, band by band: what the end of a stripe is found from.

use crate::drawn;

use drawn::detector;
use nalgebra::Vector2;
use trueline_vision::Picture;
use trueline_vision::frame::Frame;
use trueline_vision::line::Line2;
use trueline_vision::measure::stripe_end::{BANDS, BandSection};
use trueline_vision::measure::stripe_meter::StripeMeter;
use trueline_vision::measure::template::Template;

const SIZE: [usize; 2] = [640, 240];
const SIGMA_PX: f64 = 3.0;

/// A stripe without noise that crosses a row of pixels every ten columns, in fine levels.
fn picture(line: &Line2) -> Vec<u16> {
    let level = |u: usize, v: usize| {
        let beside = line.distance(&Vector2::new(u as f64, v as f64)) / SIGMA_PX;
        (100.0 + 50_000.0 * (-0.5 * beside * beside).exp()).round() as u16
    };
    (0..SIZE[1]).flat_map(|v| (0..SIZE[0]).map(move |u| level(u, v))).collect()
}

/// A band of b px takes each pixel for even light. On a flank of relative slope k per px what is wrong at each of its borders is at most
/// k / 8 of a pixel's light: k / (8 b) of the band's, up or down at either border. The inner four bands reach to 4.2 px, where k = 4.2 / 9;
/// b is 2.1 px: 0.028 of the light up and down, 0.056 from the least to the most. Whole pixels, two or three a band, moved by half a
/// pixel, would be k / 2 = 0.23 up and down.
#[test]
fn the_light_along_a_band_does_not_swing_with_the_pixel_grid() {
    let line = Line2 { point: Vector2::new(20.0, 80.3), along: Vector2::new(1.0, 0.1).normalize() };
    let levels = picture(&line);
    let picture = Picture::new(SIZE[0], SIZE[1], levels.as_slice()).unwrap();
    let detector = detector(SIZE);
    let frame = Frame { picture: &picture, lens: detector.lens() };
    let mut sections: Vec<BandSection> = Vec::new();
    let template = Template::gaussian(SIGMA_PX);
    let band_px = StripeMeter::default().bands(&line, [0.0, 500.0], &template, frame, &mut sections);
    assert!((band_px - 2.1).abs() < 0.05, "bands of {band_px} px");
    assert!(sections.len() > 450, "{} sections", sections.len());
    for band in 1..BANDS - 1 {
        let light = || sections.iter().map(|section| section.light[band]);
        let (least, most) = (light().fold(f64::INFINITY, f64::min), light().fold(0.0, f64::max));
        let mean = light().sum::<f64>() / sections.len() as f64;
        assert!(most - least < 0.056 * mean, "band {band}: {least:.0} to {most:.0}");
    }
}
