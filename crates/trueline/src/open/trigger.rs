//! The robot's digital input that the camera's exposures drive, and the time offset measured by it.

use std::cmp::Reverse;
use std::fmt;
use trueline_dataset::Recording;
use trueline_mcap::{Imported, InputsEntry};
use trueline_method::Calibration;
use trueline_method::evaluate::trigger_offset::{MeasuredOffset, TriggerEdges, measured_offset};

/// An input that follows the camera's exposures.
#[derive(Clone, Debug, PartialEq)]
pub struct Trigger {
    /// Its number, from 0.
    pub input: u32,
    /// Its rising edges.
    pub edges: TriggerEdges,
}

/// An input is the camera's if it rises for at least this share of the pictures, and for no more than twice as many.
const LEAST_RISES: f64 = 0.3;

/// The input of a recording that rises about as often as pictures were taken; `None` if there is none.
pub(crate) fn of(imported: &Imported, frames: usize) -> Option<Trigger> {
    of_inputs(&imported.inputs, imported.exposure_s?, frames)
}

fn of_inputs(changes: &[InputsEntry], exposure_s: f64, frames: usize) -> Option<Trigger> {
    let rising = (0..u64::BITS).map(|input| (input, rising(changes, input)));
    let likely = rising.filter(|(_, edges)| {
        let share = edges.len() as f64 / frames.max(1) as f64;
        (LEAST_RISES..=2.0).contains(&share)
    });
    // Of several that rise as often (a number with a sign repeats its highest bit) the first.
    let (input, between_ns) = likely.max_by_key(|(input, edges)| (edges.len(), Reverse(*input)))?;
    Some(Trigger { input, edges: TriggerEdges { between_ns, exposure_s } })
}

fn rising(inputs: &[InputsEntry], input: u32) -> Vec<[i64; 2]> {
    let is_on = |bits: u64| bits >> input & 1 == 1;
    let rises = inputs.iter().filter(|change| !is_on(change.bits[0]) && is_on(change.bits[1]));
    rises.map(|change| change.between_ns).collect()
}

/// The time offset as an input of the robot measured it, beside the estimated one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeasuredByInput {
    /// The input's number, from 0.
    pub input: u32,
    /// Its measurement.
    pub offset: MeasuredOffset,
}

impl fmt::Display for MeasuredByInput {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "digital input {}: {}", self.input, self.offset)
    }
}

impl Trigger {
    /// The time offset that it measured; `None` with too few edges, or without an estimate.
    #[must_use]
    pub(crate) fn measured(
        &self,
        recording: &Recording,
        calibration: &Calibration,
    ) -> Option<MeasuredByInput> {
        let offset = measured_offset(recording, &self.edges, calibration)?;
        Some(MeasuredByInput { input: self.input, offset })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Inputs with a value at every millisecond.
    fn changes(at_ms: impl Fn(i64) -> u64) -> Vec<InputsEntry> {
        let change = |ms: i64| InputsEntry {
            between_ns: [1_000_000 * (ms - 1), 1_000_000 * ms],
            device_ns: [0, 0],
            bits: [at_ms(ms - 1), at_ms(ms)],
        };
        (1..3000).map(change).filter(|change| change.bits[0] != change.bits[1]).collect()
    }

    #[test]
    fn the_cameras_input_is_the_one_that_rises_with_the_pictures() {
        // A hundred pictures; input 3 is the camera's, input 0 is switched once, input 63 chatters.
        let inputs =
            changes(|ms| u64::from(ms > 700) | u64::from(ms % 30 < 6) << 3 | u64::from(ms % 2 == 0) << 63);
        let found = of_inputs(&inputs, 0.006, 100);
        let trigger = found.as_ref().map(|trigger| (trigger.input, trigger.edges.between_ns.len()));
        assert_eq!(trigger, Some((3, 99)));
        let edges = found.map(|trigger| trigger.edges.between_ns).unwrap_or_default();
        assert!(edges.iter().all(|[before_ns, after_ns]| {
            (before_ns + 1_000_000, after_ns % 30_000_000) == (*after_ns, 0)
        }));
        let repeated = changes(|ms| if ms % 30 < 6 { !0 << 7 } else { 0 });
        assert_eq!(of_inputs(&repeated, 0.006, 100).map(|trigger| trigger.input), Some(7));
        assert_eq!(of_inputs(&changes(|ms| u64::from(ms > 700)), 0.006, 100), None);
        assert_eq!(of_inputs(&[], 0.006, 0), None);
    }
}
