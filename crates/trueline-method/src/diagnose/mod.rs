//! Diagnosis of a scan that does not fit.

pub mod axis_mistakes;
pub mod clock_alignment;
pub mod doctor;
pub mod estimated_mistakes;
mod euler_mistakes;
pub mod mistake;
pub mod mistakes;
pub mod offset_profile;
pub mod outcome;
mod plausibility;
pub(crate) mod pose_mistakes;
mod quick_fit;
pub(crate) mod sensor_mistakes;
mod shift_regression;
mod stamp_rate;
pub mod steps;
mod told;
pub mod trials;
