//! Use of a calibration on another scan.

pub mod cloud;
pub mod difference;
pub mod evaluation;
pub mod live_placement;
pub mod other_cell;
pub mod placed_features;
pub mod reference_curve;
pub mod seam_points;
pub mod standstill;
pub mod thickness;
pub mod trigger_offset;
