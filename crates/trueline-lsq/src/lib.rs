//! Robust nonlinear least squares on manifolds, for small dense problems with very many residuals.
//!
//! Three nouns, never mixed: the problem ([`LeastSquares`]), the options ([`SolveOptions`]), the solution
//! ([`Solution`], as data). The problem adds its own residuals into [`NormalEquations`], so that this crate needs
//! memory for the unknowns only, never for the residuals.
//!
//! Residuals must be whitened: one is one standard deviation. The crate is independent of robots, cameras and lasers. It does not print, and the
//! same input gives identical bits.
//!
//! ```
//! use nalgebra::DVector;
//! use trueline_lsq::{LeastSquares, NormalEquations, SolveOptions, solve};
//!
//! /// The decay rate of y = exp(−k t), from measurements with noise 0.01.
//! struct Decay(Vec<(f64, f64)>);
//!
//! impl LeastSquares for Decay {
//!     type State = f64;
//!
//!     fn dimension(&self) -> usize {
//!         1
//!     }
//!
//!     fn retract(&self, k: &f64, step: &DVector<f64>) -> f64 {
//!         k + step[0]
//!     }
//!
//!     fn cost(&self, k: &f64) -> f64 {
//!         self.0.iter().map(|(t, y)| 0.5 * (((-k * t).exp() - y) / 0.01).powi(2)).sum()
//!     }
//!
//!     fn linearize(&self, k: &f64, equations: &mut NormalEquations) {
//!         for (t, y) in &self.0 {
//!             let (residual, derivative) = (((-k * t).exp() - y) / 0.01, -t * (-k * t).exp() / 0.01);
//!             equations.hessian[(0, 0)] += derivative * derivative;
//!             equations.gradient[0] += derivative * residual;
//!             equations.cost += 0.5 * residual * residual;
//!         }
//!     }
//! }
//!
//! let measured = (0..10).map(|n| f64::from(n) * 0.2).map(|t| (t, (-1.5 * t).exp())).collect();
//! let solution = solve(&Decay(measured), 0.1, &[], &SolveOptions::default())?;
//! assert!((solution.state - 1.5).abs() < 1e-6);
//! # Ok::<(), trueline_lsq::SolveError>(())
//! ```

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
