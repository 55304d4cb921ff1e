//! What a person or a program reads of a calibration: JSON, a terminal summary, an HTML report.
//!
//! Formatting only; every number comes from the calibration. Here metres become millimetres, seconds
//! milliseconds and radians degrees.

pub mod diagnosis;
pub mod evaluated;
pub mod html;
pub mod json;
pub mod number;
pub mod planned;
pub mod reproduced;
pub mod summary;
pub mod trust;
