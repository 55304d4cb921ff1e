//! Fault injection: everything that is wrong with a cell and is not white noise.
//!
//! [`simulate_with_faults`] makes the same scan as [`simulate`](crate::simulate()) with some
//! [`Fault`]s in it. Each fault acts where it acts in a real cell: on the stated sensor, on the seam's form, between
//! the robot's true and its reported pose, on the feature, on the stamps.

mod event;
pub mod fault;
mod feature_error;
pub mod names;
mod robot_error;
mod seam_form;
mod sensor_error;
mod stream_error;

pub use fault::{Event, Fault, FeatureError, RobotError, SeamForm, SensorError, StreamError};
pub use names::{FAULT_NAMES, FaultError, FaultName};

pub(crate) use feature_error::{FeatureErrors, line_beside};
pub(crate) use robot_error::RobotErrors;
pub(crate) use seam_form::SeamForms;

use crate::motion::Motion;
use crate::scenario::Scenario;
use crate::simulate::record;
use trueline_dataset::Recording;

/// Simulates a scan with faults; the same scenario, faults and seed give the same recording, bit for bit.
///
/// Returns `None` for a scenario without a line, or an [arm](crate::arm) that cannot reach the path.
#[must_use]
pub fn simulate_with_faults(scenario: &Scenario, faults: &[Fault], seed: u64) -> Option<Recording> {
    let motion = Motion::new(scenario)?;
    let mut recording = record(scenario, &|time_s| motion.base_from_tool(time_s), faults, seed)?;
    for fault in faults {
        match fault {
            Fault::Sensor(error) => error.apply(&mut recording, &scenario.cell.sensor)?,
            Fault::Stream(error) => error.apply(&mut recording, scenario, seed),
            Fault::Event(event) => event.apply(&mut recording, scenario, seed)?,
            // These acted while the scan was cast.
            Fault::Seam(_) | Fault::Robot(_) | Fault::Feature(_) => {}
        }
    }
    Some(recording)
}
