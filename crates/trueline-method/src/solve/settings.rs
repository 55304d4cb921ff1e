//! What every solve of a calibration shares.

use crate::config::Config;
use crate::input::noise_levels::NoiseLevels;
use crate::input::shape_prior::ShapePrior;
use crate::problem::prior::Prior;

/// What every solve of a calibration shares.
#[derive(Clone, Copy)]
pub struct FitSettings<'a> {
    /// The user's choices.
    pub config: &'a Config,
    /// Expected noise.
    pub noise: NoiseLevels,
    /// Components that are held where they start.
    pub fixed: &'a [usize],
    /// Directions that are held at a guess.
    pub prior: Option<&'a Prior>,
    /// What is known of the sensor's shape; `None` takes the sensor for exact.
    pub shape_prior: Option<ShapePrior>,
}
