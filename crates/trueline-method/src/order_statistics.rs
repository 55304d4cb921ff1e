//! Medians and quantiles, which the geometry needs too.

pub use trueline_geometry::statistics::{mad_sigma, median, quantile};
