//! Parts of an external axis that a scan does not determine, and the motion that does.

use super::warning::Warning;
use crate::axes::finding::{AxisFinding, AxisPart};
use trueline_geometry::AxisKind;

/// Unobservable parts of an axis. The direction, place and time offset of a standing axis do not matter.
/// A robot that keeps its attitude hides the hand-eye translation, and the place of an axis with it.
#[must_use]
pub fn hidden_of_axis(axis: &AxisFinding, keeps_attitude: bool) -> Vec<Warning> {
    let cure = |part: AxisPart| match (axis.axis.kind, part) {
        _ if !axis.moves => "move it while scanning",
        _ if keeps_attitude => {
            "tilt the sensor by ±10° about two axes while it moves: a robot that keeps its attitude hides the hand-eye translation, \
             and with it the place of an axis"
        }
        (AxisKind::Linear, AxisPart::Direction) => {
            "scan seams in two directions: a shift along a straight seam is not measured"
        }
        (AxisKind::Rotary, AxisPart::TimeOffset) => "let it swing, or turn the other way in a second scan",
        (AxisKind::Linear, _) => "let it run back and forth",
        (AxisKind::Rotary, _) if axis.has_twin() => {
            "let it stand at three angles, or swing, while the sensor tilts: with two angles there are two solutions, which may be centimetres apart"
        }
        (AxisKind::Rotary, _) => "let it stand at three angles, or swing by ±30°, while the sensor tilts",
    };
    let hidden = AxisPart::ALL.into_iter().filter(|part| axis.has(*part) && axis.sigma(*part).is_none());
    let warning = |part| Warning::AxisNotShown { name: axis.name.clone(), part, cure: cure(part) };
    let all: Vec<Warning> = hidden.map(warning).collect();
    if axis.moves { all } else { all.into_iter().take(1).collect() }
}
