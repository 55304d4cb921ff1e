//! Fault injection: everything that is wrong with a cell and is not white noise.
//!
//! [`simulate_with_faults`](crate::simulate_with_faults) makes the same scan as [`simulate`](crate::simulate()) with some
//! [`Fault`]s in it. Each fault acts at its place in a real cell: on the stated sensor, on the seam's form, between the
//! robot's true and its reported pose, on the feature, on the stamps.

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
pub use robot_error::drawn_arm;

pub(crate) use robot_error::RobotErrors;
pub(crate) use seam_form::{SeamForms, Wobble};
