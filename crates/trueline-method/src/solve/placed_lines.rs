//! Lines through points placed with a time offset and a hand-eye transform.

use crate::input::observations::{Observation, Observations};
use crate::problem::parameters::Parameters;
use crate::problem::placement::placement;
use nalgebra::Vector3;
use trueline_dataset::Guess;
use trueline_geometry::{Line, fit};

/// The lines that fit the points placed with a time offset and a hand-eye transform.
#[must_use]
pub(crate) fn lines_for(
    observations: &Observations,
    list: &[Observation],
    guess: &Guess,
) -> Option<Vec<Line>> {
    let at = Parameters::straight(guess, Vec::new());
    let mut points: Vec<Vec<Vector3<f64>>> = vec![Vec::new(); observations.line_count];
    for o in list {
        if let Some(placement) = placement(observations, o, &at) {
            points[o.line as usize].push(placement.point_in_base(&o.point_in_camera));
        }
    }
    points.iter().map(|points| if points.len() < 3 { None } else { fit::robust_line(points) }).collect()
}
