//! Other explanations of the same scan: another offset, the mirrored attitude, other stamps, a drifting clock.

pub mod clock_drift;
pub mod drift_and_step;
pub mod likelihood_ratio;
pub mod mirror;
pub mod search;
pub mod second_minimum;
pub mod timestamp_selection;
