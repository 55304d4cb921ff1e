//! Prediction for a motion: the covariance of the estimates, from the information of every frame.
//!
//! The Fisher information of a frame is JᵀΣ⁻¹J with the estimator's own residual, at the place where the seam or its plates
//! are expected, and Σ of feature, robot and stamp. Robot noise counts as the estimator leaves it, after its local fit. As
//! in the estimator the seam may bow, and plates need not be flat. A frame counts as often as it is seen in cells with a
//! wrong guess.

use crate::criterion::SensorCovariance;
use nalgebra::DMatrix;
use trueline_lsq::Information;
use trueline_method::assess::observability::RANK_THRESHOLD;
use trueline_method::problem::parameters::LINES;

/// Standard deviations that a scan promises.
#[derive(Clone, Debug, PartialEq)]
pub struct Prediction {
    /// Covariance of time offset and hand-eye, in the order and units of [`trueline_method::problem::parameters`].
    pub covariance: SensorCovariance,
    /// Directions that the scan shows.
    pub rank: usize,
    /// Required unknowns: time offset, hand-eye, and line or planes.
    pub asked: usize,
}

impl Prediction {
    /// The prediction from the complete information. The first unknowns are required, except those held fixed, and the others
    /// have a prior; `None` if it is not finite.
    #[must_use]
    pub(crate) fn of(information: &DMatrix<f64>, held: &[usize], asked: usize) -> Option<Self> {
        let known = asked..information.nrows();
        let analysed = Information::beside(information, held, known.clone(), RANK_THRESHOLD)?;
        let asked = asked - held.len();
        let covariance = analysed.covariance().fixed_view::<LINES, LINES>(0, 0).into_owned();
        // Unknowns with a prior always count as determined.
        Some(Self { covariance, rank: analysed.rank() - known.len(), asked })
    }

    /// Whether everything can be seen.
    #[must_use]
    pub fn shows_all(&self) -> bool {
        self.rank == self.asked
    }

    /// Standard deviation of a component.
    #[must_use]
    pub fn sigma(&self, component: usize) -> f64 {
        self.covariance[(component, component)].max(0.0).sqrt()
    }
}
