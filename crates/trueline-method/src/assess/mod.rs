//! What the optimum is worth: identifiability, residuals, cross-validation, outlier segments, seam point error.

pub mod cause_kind;
pub mod convergence;
pub mod corrected_sensor;
pub mod correlated_noise;
pub mod cross_validation;
pub mod drawn_line_shift;
pub(crate) mod excitation;
pub(crate) mod identifiability;
pub mod instead_of_sensor;
pub mod lens;
pub mod misfit_cause;
pub(crate) mod misfit_patterns;
pub mod noise_filter;
pub mod observability;
pub mod outlier_segments;
pub(crate) mod profile_likelihood;
pub mod residuals;
pub(crate) mod robot_accuracy;
pub mod robot_field;
pub mod row_products;
pub mod seam_error;
pub mod seam_point_error;
pub(crate) mod section_series;
pub mod sensor_shape;
pub mod systematic;
pub mod tilt_bias;
