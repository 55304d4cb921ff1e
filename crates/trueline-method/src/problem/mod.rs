//! Observations → least-squares problem: unknowns, residuals, priors, and the sums over all samples.

pub(crate) mod known;
pub(crate) mod layout;
pub mod line_problem;
pub(crate) mod packing;
pub mod parameters;
pub mod placement;
pub mod prior;
pub mod row_products;
pub(crate) mod row_table;
pub mod scalar_sums;
pub(crate) mod simd;
pub mod unknowns;
pub mod usable;
pub(crate) mod whitened_rows;

#[cfg(test)]
mod observation_tests;
