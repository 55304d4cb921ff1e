//! The light around the end of a stripe, and the edge that it shows.

/// Bands across the stripe.
pub const BANDS: usize = 6;

/// The light of one section through the stripe, band by band, in levels.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BandSection {
    /// Distance along the line, px.
    pub s: f64,
    /// Mean light of each band, from the negative side of the line's normal to the positive.
    pub light: [f64; BANDS],
}

/// An edge of the stripe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Edge {
    /// Its crossing with the line, along the line, px.
    pub s: f64,
    /// Its standard deviation, px.
    pub sigma_px: f64,
    /// How far it is blurred, px: the scale of a logistic step is 1 / 1.702 of it.
    pub blur_px: f64,
    /// Distance of the stripe from its line before it, px, if that is more than chance.
    pub rounded_px: f64,
}
