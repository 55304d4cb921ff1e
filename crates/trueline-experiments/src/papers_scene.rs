//! The scan in a base frame in which the paper's own start of the line is its start.
//!
//! The paper prints φ₀ and no end of φ, but the end is 6.5° and 16 mm away and the distance of the points from the line begins near
//! 14 mm (Figs. 6 and 7). A line that passes 12.3 mm beside the start's at 1.15 m from its foot, turned by 4.6° about the
//! radius, has all three.

use crate::published;
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, UnitVector3, Vector3};
use trueline_geometry::{Line, Pose, se3};
use trueline_sim::Scenario;

/// Place of the scan along the start's line, from its foot, m.
const ALONG_M: f64 = 1.15;
/// Distance of the true line from it there, m.
const BESIDE_M: f64 = 12.3e-3;
/// How far its direction is off, rad: 4.6°.
const TURNED_RAD: f64 = 4.6 * std::f64::consts::PI / 180.0;

/// The same scene in the paper's base frame; of its lines the first is moved, and others with it.
#[must_use]
pub(crate) fn in_the_papers_base(mut scenario: Scenario) -> Scenario {
    let Some(line) = scenario.cell.lines.first() else { return scenario };
    let moved = move_to(line, &true_line(), &scenario.cell.approach);
    let in_base = |line: &Line| {
        let direction = UnitVector3::new_normalize(moved.rotation * line.direction());
        Line::new(moved.rotation * line.anchor() + moved.translation.vector, &direction)
    };
    scenario.cell.lines = scenario.cell.lines.iter().map(in_base).collect();
    scenario.cell.approach = UnitVector3::new_normalize(moved.rotation * scenario.cell.approach.into_inner());
    scenario
}

/// The true line: beside the paper's start.
fn true_line() -> Line {
    let axes = published::line_start().rotation.to_rotation_matrix().into_inner();
    let [along, across, radial]: [Vector3<f64>; 3] = [0, 1, 2].map(|k| axes.column(k).into());
    let anchor = radial * (published::LINE_START_M + BESIDE_M) + along * ALONG_M;
    let direction = along * TURNED_RAD.cos() + across * TURNED_RAD.sin();
    Line::new(anchor, &UnitVector3::new_normalize(direction))
}

/// The motion of base that brings one line onto another, anchor onto anchor, with the approach from above.
fn move_to(from: &Line, to: &Line, approach: &UnitVector3<f64>) -> Pose {
    let frame = |direction: Vector3<f64>, approach: Vector3<f64>| {
        let range = (approach - direction * direction.dot(&approach)).normalize();
        Matrix3::from_columns(&[direction, range, direction.cross(&range)])
    };
    let turn =
        frame(to.direction(), -Vector3::z()) * frame(from.direction(), approach.into_inner()).transpose();
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(turn));
    se3::from_parts(rotation, to.anchor() - rotation * from.anchor())
}
