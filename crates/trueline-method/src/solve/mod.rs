//! Start → optimum → covariance.

pub mod covariance;
pub mod drawn_lines;
pub mod fit;
pub mod iteration_record;
pub(crate) mod line_anchors;
pub(crate) mod linear_start;
pub(crate) mod narrowing;
pub mod noise_scale;
pub(crate) mod placed_lines;
pub mod refine;
pub mod seam_chart;
pub mod settings;
pub mod solver;
pub mod start;
