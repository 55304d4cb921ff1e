//! Illumination of a picture: properties that a person can change at the camera, the laser and the room.

use crate::locate::line_segment::LineSegment;
use crate::locate::tiles::Tiles;

/// The light in one picture, in levels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PictureLight {
    /// The brightest place.
    pub brightest: f64,
    /// The median over the picture: the surroundings of the stripe.
    pub ambient: f64,
    /// How far the stripe typically is above its surroundings; without a stripe, the brightest place.
    pub stripe: f64,
    /// Typical thickness of the stripe (standard deviation), px; `None` without one.
    pub sigma_px: Option<f64>,
}

impl PictureLight {
    pub(crate) fn of(tiles: &Tiles, segments: &[LineSegment], level_scale: f64) -> Self {
        let strongest = segments.first();
        let stripe = strongest.map_or(f64::from(tiles.greatest_excess()), |segment| segment.brightness);
        Self {
            brightest: f64::from(tiles.brightest()) / level_scale,
            ambient: f64::from(tiles.median_level()) / level_scale,
            stripe: stripe / level_scale,
            sigma_px: strongest.map(|segment| segment.sigma_px),
        }
    }
}
