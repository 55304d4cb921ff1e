//! Appearance of the pictures: optics, sensor and all disturbances.

/// Content of the pictures besides the bare stripe. Brightness is counted in parts of full scale.
#[derive(Clone, Debug, PartialEq)]
pub struct Look {
    /// Standard deviation of the laser sheet's thickness, m.
    pub laser_sigma_m: f64,
    /// Peak of the stripe on a plate square to the laser; above 1 it saturates.
    pub amplitude: f64,
    /// Standard deviation of the optical blur, px.
    pub blur_sigma_px: f64,
    /// Exposure time, s.
    pub exposure_s: f64,
    /// Level of the dark picture.
    pub background: f64,
    /// Read noise, standard deviation.
    pub read_noise: f64,
    /// Electrons at full scale: shot noise. Infinite for none.
    pub full_well_electrons: f64,
    /// Bits of a pixel, 8 or 16.
    pub bits: u8,
    /// Contrast of the speckle: 0 none, 1 fully developed.
    pub speckle_contrast: f64,
    /// Correlation length of the speckle: where the covariance of the intensity has fallen to 1/e, px.
    pub speckle_length_px: f64,
    /// How much light a plate mirrors.
    pub mirror: f64,
    /// Distance from the seam at which mirrored light has fallen to 1/e, m.
    pub mirror_reach_m: f64,
    /// Bright blobs and streaks in a picture, on average.
    pub spatter: f64,
    /// Peak of the arc's glow.
    pub glow: f64,
    /// Stretches of the stripe that are missing in a picture, on average.
    pub missing: f64,
}

impl Look {
    /// Nothing but the stripe and whole grey levels.
    #[must_use]
    pub fn clean() -> Self {
        Self {
            laser_sigma_m: 0.08e-3,
            amplitude: 0.8,
            blur_sigma_px: 0.8,
            exposure_s: 1e-3,
            background: 0.02,
            read_noise: 0.0,
            full_well_electrons: f64::INFINITY,
            bits: 8,
            speckle_contrast: 0.0,
            speckle_length_px: 1.75,
            mirror: 0.0,
            mirror_reach_m: 2.5e-3,
            spatter: 0.0,
            glow: 0.0,
            missing: 0.0,
        }
    }

    /// Full speckle and the noise of a common camera.
    #[must_use]
    pub fn speckled() -> Self {
        Self { read_noise: 0.003, full_well_electrons: 10_000.0, speckle_contrast: 1.0, ..Self::clean() }
    }

    /// Bare metal: speckle, and each plate mirrors in the other.
    #[must_use]
    pub fn shiny() -> Self {
        Self { mirror: 0.35, ..Self::speckled() }
    }

    /// While welding: speckle, mirrors, spatter, the arc's glow, missing pieces.
    #[must_use]
    pub fn welding() -> Self {
        Self { spatter: 25.0, glow: 0.2, missing: 2.0, ..Self::shiny() }
    }
}
