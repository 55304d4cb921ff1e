//! Cells as integrators build them: sensor, line and offset anywhere.

use crate::noise::Noise;
use crate::scenario::Scenario;
use nalgebra::{Quaternion, UnitQuaternion, UnitVector3, Vector3};
use trueline_geometry::{Line, se3};

/// The same scan in another cell: any hand-eye rotation, up to 200 mm of translation per axis, an offset between
/// ±`offset_s`, and a line in any direction up to 1.5 m from the base, approached from any side.
#[must_use]
pub fn random_cell(scenario: &Scenario, seed: u64, offset_s: f64) -> Scenario {
    let mut noise = Noise::new(seed, 4);
    let mut random = scenario.clone();
    let rotation = UnitQuaternion::new_normalize(Quaternion::from_parts(
        noise.normal(1.0),
        Vector3::from_fn(|_, _| noise.normal(1.0)),
    ));
    let translation = Vector3::from_fn(|_, _| noise.uniform(-0.2, 0.2));
    random.cell.tool_from_camera = se3::from_parts(rotation, translation);
    random.timing.time_offset_s = noise.uniform(-offset_s, offset_s);
    // All lines move together, as one body.
    let turn = UnitQuaternion::new_normalize(Quaternion::from_parts(
        noise.normal(1.0),
        Vector3::from_fn(|_, _| noise.normal(1.0)),
    ));
    let centre = scenario.cell.lines.first().map_or_else(Vector3::zeros, |line| *line.anchor());
    let place = Vector3::from_fn(|_, _| noise.uniform(-1.5, 1.5));
    random.cell.lines = (scenario.cell.lines.iter())
        .map(|line| {
            let direction = UnitVector3::new_normalize(turn * line.direction());
            Line::new(place + turn * (line.anchor() - centre), &direction)
        })
        .collect();
    random.cell.approach = UnitVector3::new_normalize(turn * scenario.cell.approach.into_inner());
    random
}
