//! Medians and their kin, which the geometry needs as well.

pub use trueline_geometry::statistics::{mad_sigma, median, quantile};
