//! Stamps that are cut to milliseconds, of one of the streams.

use super::super::drawn_errors::DrawnErrors;
use super::super::error_table::ShopError;

/// The grain of each stream's stamps, s: robot, images. Zero is no rounding.
pub(crate) fn grains_s(errors: &DrawnErrors) -> [f64; 2] {
    let mut grains = [0.0; 2];
    if let Some(grain_s) = errors.size(ShopError::MillisecondStamps) {
        let of_images = errors.noise(ShopError::MillisecondStamps, 1).happens(0.5);
        grains[usize::from(of_images)] = grain_s;
    }
    grains
}

/// A stamp, ns, cut to a grain, s.
pub(crate) fn cut(stamp_ns: i64, grain_s: f64) -> i64 {
    let grain_ns = (grain_s * 1e9).round() as i64;
    if grain_ns > 0 { stamp_ns - stamp_ns.rem_euclid(grain_ns) } else { stamp_ns }
}
