//! Prediction for a motion: the covariance of the estimates, from the information of every frame.
//!
//! The Fisher information of a frame is JᵀΣ⁻¹J with the estimator's own residual, at the place where the seam or its plates
//! are expected, and Σ of feature, robot and stamp. Robot noise counts as the estimator leaves it, after its local fit. As
//! in the estimator the seam may bow, plates need not be flat, and external axes have wide priors. A frame counts as often as it is seen in cells with a
//! wrong guess.

use crate::covariances::{in_si, inverse};
use crate::criterion::SensorCovariance;
use nalgebra::DMatrix;
use trueline_lsq::Information;
use trueline_method::assess::observability::RANK_THRESHOLD;
use trueline_method::problem::parameters::{LINES, ROTATION, TRANSLATION};

/// Standard deviations that a scan promises.
#[derive(Clone, Debug, PartialEq)]
pub struct Prediction {
    /// Covariance of time offset and hand-eye, in the order and units of [`trueline_method::problem::parameters`].
    pub covariance: SensorCovariance,
    /// Directions that the scan shows.
    pub rank: usize,
    /// Required unknowns: time offset, hand-eye, and line or planes.
    pub asked: usize,
    /// Covariance of the numbers of the external axes ([`trueline_geometry::axis::AXIS`] each), SI; empty without axes.
    pub axes: DMatrix<f64>,
    /// Links that the scan does not determine, external axes apart.
    pub hidden: Vec<&'static str>,
}

/// Prior standard deviation of the required unknowns where the hidden ones are sought, rad, m and s.
const LOOSE: f64 = 1.0;
/// An unknown is hidden if it keeps this part of that.
const HIDDEN: f64 = 0.3;

impl Prediction {
    /// The prediction from the complete information. The first unknowns are required, except those held fixed, and the others
    /// have a prior. The last are the external axes, in units of their priors; `None` if it is not finite.
    #[must_use]
    pub(crate) fn of(
        information: &DMatrix<f64>,
        held: &[usize],
        asked: usize,
        axis_sigmas: &[f64],
    ) -> Option<Self> {
        let known = asked..information.nrows();
        let analysed = Information::beside(information, held, known.clone(), RANK_THRESHOLD)?;
        let covariance = analysed.covariance().fixed_view::<LINES, LINES>(0, 0).into_owned();
        let (axes, hidden) = loosened(information, held, asked, axis_sigmas)?;
        // Unknowns with a prior always count as determined.
        Some(Self {
            covariance,
            rank: analysed.rank() - known.len(),
            asked: asked - held.len(),
            axes,
            hidden,
        })
    }

    /// Whether everything can be seen, external axes apart.
    #[must_use]
    pub fn shows_all(&self) -> bool {
        self.rank == self.asked && self.hidden.is_empty()
    }

    /// Standard deviation of a component.
    #[must_use]
    pub fn sigma(&self, component: usize) -> f64 {
        self.covariance[(component, component)].max(0.0).sqrt()
    }
}

/// Covariance of the external axes, SI, and the hidden links. Both are with a loose prior of the required unknowns: what an axis
/// shares with a hidden one is then as uncertain as that.
fn loosened(
    information: &DMatrix<f64>,
    held: &[usize],
    asked: usize,
    axis_sigmas: &[f64],
) -> Option<(DMatrix<f64>, Vec<&'static str>)> {
    if axis_sigmas.is_empty() {
        return Some((DMatrix::zeros(0, 0), Vec::new()));
    }
    let mut loose = information.clone();
    (0..asked).filter(|k| !held.contains(k)).for_each(|k| loose[(k, k)] += LOOSE.powi(-2));
    let covariance = inverse(&loose)?;
    let is_hidden = |k: usize| covariance[(k, k)].sqrt() > HIDDEN * LOOSE;
    let links = [
        ("the time offset", 0..ROTATION),
        ("the hand-eye rotation", ROTATION..TRANSLATION),
        ("the hand-eye translation", TRANSLATION..LINES),
        ("the line", LINES..asked),
    ];
    let hidden = links.into_iter().filter(|(_, numbers)| numbers.clone().any(is_hidden));
    Some((in_si(&covariance, axis_sigmas), hidden.map(|(name, _)| name).collect()))
}
