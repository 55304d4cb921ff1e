//! Settings shared by all solves of a calibration.

use crate::config::Config;
use crate::input::noise_levels::NoiseLevels;
use crate::input::shape_prior::ShapePrior;
use crate::problem::prior::Prior;

/// Settings shared by all solves of a calibration.
#[derive(Clone, Copy)]
pub struct FitSettings<'a> {
    /// The user's choices.
    pub config: &'a Config,
    /// Expected noise.
    pub noise: NoiseLevels,
    /// Components held at their start.
    pub fixed: &'a [usize],
    /// Directions that are held at a guess.
    pub prior: Option<&'a Prior>,
    /// Prior of the sensor's shape. `None` for an exact sensor.
    pub shape_prior: Option<ShapePrior>,
}
