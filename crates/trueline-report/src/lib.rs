//! What a person or a program reads of a calibration: JSON, a terminal summary, an HTML report.
//!
//! Formatting only; every number comes from the calibration. Here metres become millimetres, seconds
//! milliseconds and radians degrees.

pub mod board_result;
pub mod calibration_page;
pub mod camera_report;
pub mod checks;
pub mod compared;
pub mod diagnosis;
pub mod evaluated;
pub mod evaluation_page;
pub mod facts;
pub mod number;
pub mod page;
pub mod picture_page;
pub mod plan_page;
pub mod planned;
pub mod reproduced;
pub mod reproduction_page;
#[cfg(feature = "rerun")]
pub mod rerun_recording;
pub mod result;
pub mod seam_error;
pub mod sensor_json;
pub mod sensor_page;
pub mod sensor_text;
pub mod summary;
