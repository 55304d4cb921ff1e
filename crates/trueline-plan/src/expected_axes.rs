//! A plan's promise about the external axes, as the estimator will state it: the ± of each part, and parts that stay hidden.

use crate::cell::Cell;
use crate::motion::Motion;
use crate::prediction::Prediction;
use crate::rehearsal::cast;
use nalgebra::DVector;
use trueline_dataset::SensorSetup;
use trueline_method::adjustment::axis_step::AxisStep;
use trueline_method::axes::finding::{AxisFinding, of_all};
use trueline_method::axes::runs_evenly;
use trueline_method::verdict::hidden_of_axis;
use trueline_method::{Measurements, Warning};

/// The axes with their predicted ±; none without axes.
#[must_use]
pub fn expected_axes(cell: &Cell, motion: &Motion, prediction: &Prediction) -> Vec<AxisFinding> {
    let line = cell.seam.line();
    let recording = cast(cell, &SensorSetup::default(), Measurements::Seam, motion);
    let (Some(mut recording), Some(line)) = (recording.filter(|_| !cell.axes.is_empty()), line) else {
        return Vec::new();
    };
    let even: Vec<bool> = recording.axes.iter().map(|axis| runs_evenly(axis, &recording)).collect();
    for (axis, is_even) in recording.axes.iter_mut().zip(even) {
        axis.holds_time_offset = is_even;
    }
    let (step, covariance) = (DVector::zeros(prediction.axes.nrows()), prediction.axes.clone());
    of_all(&recording, &[line], Some(&AxisStep { step, covariance }))
}

/// Parts of the axes that the scan does not determine, each with the motion that does.
#[must_use]
pub fn hidden(axes: &[AxisFinding], prediction: &Prediction) -> Vec<Warning> {
    let keeps_attitude = !prediction.shows_all();
    axes.iter().flat_map(|axis| hidden_of_axis(axis, keeps_attitude)).collect()
}

/// Everything that a motion leaves undetermined, a sentence or a name each.
#[must_use]
pub(crate) fn all_hidden(cell: &Cell, motion: &Motion, prediction: &Prediction) -> Vec<String> {
    let axes = expected_axes(cell, motion, prediction);
    let of_axes = hidden(&axes, prediction).into_iter().map(|warning| warning.to_string());
    prediction.hidden.iter().map(|name| (*name).to_owned()).chain(of_axes).collect()
}
