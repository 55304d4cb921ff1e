//! Start → optimum → covariance.

pub mod covariance;
pub mod refine;
pub mod start;
pub mod streaming;
