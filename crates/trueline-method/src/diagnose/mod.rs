//! Why a scan does not fit.

pub mod doctor;
pub mod mistakes;
pub mod offset_profile;
