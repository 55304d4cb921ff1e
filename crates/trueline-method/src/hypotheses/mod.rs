//! Other explanations of the same scan: another time offset, the mirrored attitude, other stamps, a drifting clock.

pub mod ambiguity;
pub mod choice;
pub mod clock_drift;
pub mod drift_and_step;
pub mod feature_bias;
pub(crate) mod likelihood_ratio;
pub mod mirror;
pub mod paired_test;
pub mod rivals;
pub mod search;
pub(crate) mod timestamp_selection;
pub mod unbiased;
