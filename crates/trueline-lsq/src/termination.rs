//! Reason for the end of a solve, with the measured value and its threshold.

use std::fmt;

/// The end of a solve. Step lengths are in standard deviations of the unknowns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Termination {
    /// The last step was shorter than the threshold.
    StepConverged {
        /// Length of the step, σ.
        step: f64,
        /// Threshold, σ.
        threshold: f64,
    },
    /// The cost fell by less than the threshold.
    CostConverged {
        /// Relative decrease.
        decrease: f64,
        /// Threshold.
        threshold: f64,
    },
    /// No step lowers the cost any more: it is limited by rounding error.
    NoFurtherDecrease {
        /// Damping at the end.
        damping: f64,
        /// Largest damping tried.
        threshold: f64,
        /// Length of the remaining Gauss–Newton step, σ.
        step: f64,
    },
    /// The equations have no solution.
    NoSolution,
    /// The iteration limit was reached.
    IterationLimit {
        /// Iterations done.
        iterations: usize,
        /// Iterations allowed.
        threshold: usize,
    },
}

impl Termination {
    /// Whether the state counts as the minimum.
    #[must_use]
    pub fn is_converged(&self) -> bool {
        match *self {
            Self::StepConverged { .. } | Self::CostConverged { .. } => true,
            // The remaining gradient is far below the data's precision.
            Self::NoFurtherDecrease { step, .. } => step < 1e-2,
            Self::IterationLimit { .. } | Self::NoSolution => false,
        }
    }
}

impl fmt::Display for Termination {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoSolution => f.write_str("the scan does not determine every unknown"),
            Self::StepConverged { step, threshold } => {
                write!(f, "converged: last step {step:.1e} σ, below {threshold:.0e}")
            }
            Self::CostConverged { decrease, threshold } => {
                write!(f, "converged: relative cost change {decrease:.1e}, below {threshold:.0e}")
            }
            Self::NoFurtherDecrease { damping, threshold, step } => write!(
                f,
                "no further decrease: damping {damping:.0e} passed {threshold:.0e}, step left over {step:.1e} σ"
            ),
            Self::IterationLimit { threshold, .. } => {
                write!(f, "stopped at the limit of {threshold} iterations")
            }
        }
    }
}
