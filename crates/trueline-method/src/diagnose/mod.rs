//! Why a scan does not fit.

pub mod clock_alignment;
pub mod doctor;
pub mod mistakes;
pub mod offset_profile;
mod shift_regression;
