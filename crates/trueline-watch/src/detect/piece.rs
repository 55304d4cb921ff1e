//! One piece as the detector sees it: 18 numbers and their information.

use super::moved_axis::part_from_axis;
use super::scatter::Scatter;
use crate::innovation::WeldStatistic;
use crate::parameters::{ALL, CALIBRATION, UNITS};
use crate::quadratic::Quadratic;
use crate::reference::Part;
use nalgebra::{DMatrix, Matrix6};

/// Evidence of a piece about θ and about the mean place ψ of its part, in [`UNITS`].
#[derive(Clone, Debug)]
pub struct PieceInformation {
    /// The part.
    pub part: usize,
    /// About θ and ψ, with the scatter of the part; nothing about ψ if that is not known.
    pub evidence: Quadratic,
    /// About θ alone, wherever the seams are.
    pub within: Quadratic,
    /// Degrees of freedom of its noise level.
    pub freedom: f64,
    /// How a displacement of the axis under the part displaces the part; `None` without such an axis.
    pub part_from_axis: Option<Matrix6<f64>>,
}

impl PieceInformation {
    /// Marginalises the places of this piece's seams.
    #[must_use]
    pub fn of(statistic: &WeldStatistic, part_index: usize, part: &Part, scatter: Option<&Scatter>) -> Self {
        let within = statistic.evidence.marginal(CALIBRATION).in_units(&UNITS[..CALIBRATION]);
        let with_place = scatter.and_then(|scatter| with_scatter(statistic, part, scatter));
        let evidence = with_place.unwrap_or_else(|| padded(&within));
        let part_from_axis = statistic.base_from_part.map(|pose| part_from_axis(part, &pose));
        Self { part: part_index, evidence, within, freedom: statistic.freedom(), part_from_axis }
    }
}

/// Evidence about θ as evidence about θ and ψ.
fn padded(within: &Quadratic) -> Quadratic {
    let mut evidence = Quadratic::nothing(ALL);
    evidence.matrix.view_mut((0, 0), (CALIBRATION, CALIBRATION)).copy_from(&within.matrix);
    evidence.vector.rows_mut(0, CALIBRATION).copy_from(&within.vector);
    evidence
}

/// ℓ = A ψ + e with e ~ N(0, P), which is marginalised.
fn with_scatter(statistic: &WeldStatistic, part: &Part, scatter: &Scatter) -> Option<Quadratic> {
    let own = 4 * part.lines.len();
    let mut map = DMatrix::zeros(CALIBRATION + own, ALL + own);
    map.view_mut((0, 0), (CALIBRATION, CALIBRATION)).fill_with_identity();
    map.view_mut((CALIBRATION, CALIBRATION), (own, 6)).copy_from(&part.seams_from_placement());
    map.view_mut((CALIBRATION, ALL), (own, own)).fill_with_identity();
    let mut evidence = statistic.evidence.of_unknowns(&map);
    let precision = scatter.covariance.clone().cholesky()?.inverse();
    let mut corner = evidence.matrix.view_mut((ALL, ALL), (own, own));
    corner += precision;
    Some(evidence.marginal(ALL).in_units(&UNITS))
}
