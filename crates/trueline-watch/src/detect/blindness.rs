//! Changes that welds like these cannot detect, however many.
//!
//! The size that matters is one unit: 0.1 ms, 0.1 mm, 0.05°, 0.3 %, 1e-4 per mm. If such a change adds less
//! than 25 to the sum of squares of the longest window, it stays below five standard deviations, the limit of
//! an alarm. More often than not it would never raise one.

use super::piece::PieceInformation;
use super::sensor_axes::{AXES, SensorAxes};
use super::windows::WINDOWS;
use crate::parameters::{
    ALL, CALIBRATION, Kind, PART_ROTATION, PART_TRANSLATION, ROTATION, SHAPE, TRANSLATION,
};
use nalgebra::{DVector, Matrix3, Vector3};

/// Least sum of squares that the longest window must gather.
const LEAST: f64 = 25.0;
/// Welds over which the information is averaged.
const RECENT: usize = 16;

const SHAPE_NAMES: [&str; 5] = ["width", "depth", "shear", "keystone across", "keystone in depth"];

/// Changes that the last welds cannot show: the name of a kind if none of it would show, else its name and
/// the hidden part.
#[must_use]
pub fn blind_to(pieces: &[PieceInformation], axes: &SensorAxes) -> Vec<String> {
    let recent = &pieces[pieces.len().saturating_sub(RECENT)..];
    let Some(size) = recent.first().map(|piece| piece.evidence.size()) else {
        return Kind::ALL.map(|kind| kind.name().to_owned()).to_vec();
    };
    let welds = recent.len() as f64;
    let gathered = |direction: &DVector<f64>| {
        let sum: f64 = recent.iter().map(|p| direction.dot(&(&p.evidence.matrix * direction))).sum();
        sum / welds * WINDOWS[WINDOWS.len() - 1] as f64
    };
    let mut blind = Vec::new();
    for kind in Kind::ALL {
        let all = directions(kind, size, axes);
        let hidden: Vec<&String> =
            all.iter().filter(|(_, d)| gathered(d) < LEAST).map(|(name, _)| name).collect();
        if hidden.len() == all.len() {
            blind.push(kind.name().to_owned());
        } else if kind != Kind::Seam {
            // A straight seam never shows a shift along itself: that is not reported as blindness.
            blind.extend(hidden.into_iter().map(|name| format!("{} {name}", kind.name())));
        }
    }
    blind
}

/// Every change that may be named as hidden: its kind, and its part, which is empty for a kind as a whole.
#[must_use]
pub fn names() -> Vec<(Kind, String)> {
    let axes = SensorAxes { tool_from_axes: Matrix3::identity() };
    let of = |kind| directions(kind, ALL, &axes).into_iter().map(move |(name, _)| (kind, name));
    let mut all: Vec<_> = Kind::ALL.into_iter().flat_map(of).collect();
    all.dedup();
    all
}

/// Unit changes of a kind, by name.
fn directions(kind: Kind, size: usize, axes: &SensorAxes) -> Vec<(String, DVector<f64>)> {
    let single = |column: usize| {
        let mut direction = DVector::zeros(size);
        direction[column] = 1.0;
        direction
    };
    let turned = |first: usize, axis: usize| {
        let mut direction = DVector::zeros(size);
        let in_tool: Vector3<f64> = axes.tool_from_axes.column(axis).into();
        direction.rows_mut(first, 3).copy_from(&in_tool);
        direction
    };
    match kind {
        Kind::Timing => vec![(String::new(), single(0))],
        Kind::Bracket => (0..3)
            .map(|k| (format!("shift {}", AXES[k]), turned(TRANSLATION, k)))
            .chain((0..3).map(|k| (format!("turn about {}", AXES[k]), turned(ROTATION, k))))
            .collect(),
        Kind::Sensor => {
            (SHAPE..CALIBRATION).map(|k| (SHAPE_NAMES[k - SHAPE].to_owned(), single(k))).collect()
        }
        Kind::Seam => (PART_TRANSLATION..PART_ROTATION + 3).map(|k| (String::new(), single(k))).collect(),
    }
}
