//! Adds bows and shape to straight lines, with the origin of each seam's bow.

use crate::input::observations::{Observation, Observations};
use crate::problem::parameters::Parameters;
use crate::problem::placement::placement;
use nalgebra::Vector2;
use trueline_model::{Curvature, SheetShape};

/// Fraction of a line's points that may lie beyond each end of the visible part, as outliers.
const BEYOND: f64 = 0.02;
/// Half the length of the shortest seam whose bow is modelled, m.
const LEAST_HALF_LENGTH_M: f64 = 5e-3;

/// The same parameters with a zero bow for each line that has none.
#[must_use]
pub fn with_bows(observations: &Observations, list: &[Observation], mut at: Parameters) -> Parameters {
    if !at.curvatures.is_empty() {
        return at;
    }
    let mut along: Vec<Vec<f64>> = vec![Vec::new(); at.lines.len()];
    for o in list {
        if let Some(placement) = placement(observations, o, &at) {
            let line = &at.lines[o.line as usize];
            let from_anchor = placement.point_in_base(&o.point_in_camera) - line.anchor();
            along[o.line as usize].push(line.direction().dot(&from_anchor));
        }
    }
    at.curvatures = along.into_iter().map(straight_over).collect();
    at
}

fn straight_over(mut along: Vec<f64>) -> Curvature {
    along.sort_by(f64::total_cmp);
    let beyond = (BEYOND * along.len() as f64) as usize;
    let [first, last] = match along.as_slice() {
        [] => [0.0; 2],
        places => [places[beyond], places[places.len() - 1 - beyond]],
    };
    Curvature {
        bow_m: [0.0; 2],
        half_length_m: (0.5 * (last - first)).max(LEAST_HALF_LENGTH_M),
        middle_m: 0.5 * (first + last),
    }
}

/// The same parameters with a zero shape, if they have none.
#[must_use]
pub fn with_shape(observations: &Observations, mut at: Parameters) -> Parameters {
    if at.shape.is_none() {
        at.shape = Some(SheetShape::exact_about(&Vector2::from(observations.shape_origin_m)));
    }
    at
}
