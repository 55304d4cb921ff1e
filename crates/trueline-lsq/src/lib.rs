//! Robust nonlinear least squares on manifolds, for small dense problems with very many residuals.
//!
//! Three nouns, never mixed: the problem ([`LeastSquares`]: what), the options ([`SolveOptions`]: how),
//! the solution ([`Solution`]: what happened, as data). The problem adds its own residuals into
//! [`NormalEquations`], so that this crate needs memory for the unknowns only, never for the residuals.
//!
//! Residuals must be whitened: one is one standard deviation. The crate knows no robot, no camera and
//! no laser; it does not print, and the same input gives the same bits.

pub mod check;
pub mod information;
pub mod loss;
pub mod normal_equations;
pub mod problem;
pub mod solve;
pub mod termination;

pub use information::Information;
pub use loss::Loss;
pub use normal_equations::NormalEquations;
pub use problem::LeastSquares;
pub use solve::{Iteration, Solution, SolveError, SolveOptions, solve};
pub use termination::Termination;
