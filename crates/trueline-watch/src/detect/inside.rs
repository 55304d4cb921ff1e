//! A change in the middle of a weld: its first stretches against its last.
//!
//! Unknowns besides the change δ are θ₀, learnt from the pieces before, the places of this piece's seams, and their bows.
//! All are marginalised for each place where the weld may be cut.

use super::change::{Change, Confidence};
use crate::innovation::Chunk;
use crate::parameters::{ALL, CALIBRATION, Kind, UNITS};
use crate::quadratic::Quadratic;
use crate::reference::Part;
use nalgebra::DMatrix;

/// A weld that is tested inside.
pub struct CutWeld<'a> {
    /// Its stretches.
    pub chunks: &'a [Chunk],
    /// Prior knowledge of its seams' bows and plates.
    pub bow_prior: &'a Quadratic,
    /// Its part.
    pub part: &'a Part,
    /// Variance of single pieces relative to their evidence, by kind: see [`super::Scatter`].
    pub dispersion: [f64; 4],
    /// Degrees of freedom of its noise level.
    pub freedom: f64,
}

/// The most significant change inside of a weld, and when it happened, s after the first robot sample. `before` is the
/// information on θ₀ without this weld.
#[must_use]
pub fn strongest(weld: &CutWeld<'_>, before: &Quadratic) -> Option<(Change, f64)> {
    let mut best: Option<(Change, f64)> = None;
    let maps = [false, true].map(|changed| piece_from_unknowns(weld.part, weld.bow_prior.size(), changed));
    let mut base = weld.bow_prior.of_unknowns(&maps[0]);
    let mut level = base.matrix.view_mut((ALL, ALL), (CALIBRATION, CALIBRATION));
    level += &before.matrix;
    let mut level = base.vector.rows_mut(ALL, CALIBRATION);
    level += &before.vector;
    let [unchanged, changed] =
        [0, 1].map(|k| weld.chunks.iter().map(|c| c.evidence.of_unknowns(&maps[k])).collect::<Vec<_>>());
    for cut in 1..weld.chunks.len() {
        let mut all = base.clone();
        unchanged[..cut].iter().chain(&changed[cut..]).for_each(|chunk| all.add(chunk));
        let change = all.marginal(ALL);
        for kind in Kind::ALL {
            let columns: Vec<usize> = kind.columns().collect();
            let known = Confidence {
                noise_freedom: weld.freedom,
                taught_by: 0,
                dispersion: weld.dispersion[kind as usize],
                pieces: 1,
            };
            let evidence = change.restricted(&columns);
            let found = Change::of(kind, &evidence, Some(&evidence), known);
            if best.as_ref().is_none_or(|(other, _)| found.p_log10 < other.p_log10) {
                best = Some((found, weld.chunks[cut].from_s));
            }
        }
    }
    best
}

/// (θ, seams, bows and plates), SI, together `size`, from (δ, θ₀ in units; the others in SI).
fn piece_from_unknowns(part: &Part, size: usize, changed: bool) -> DMatrix<f64> {
    let own = 4 * part.lines.len();
    let rest = size - CALIBRATION;
    let units = |first: usize, count: usize| {
        DMatrix::from_diagonal(&nalgebra::DVector::from_column_slice(&UNITS[first..first + count]))
    };
    let calibration = units(0, CALIBRATION);
    let mut map = DMatrix::zeros(CALIBRATION + rest, ALL + CALIBRATION + rest);
    if changed {
        let seams = part.seams_from_placement() * units(CALIBRATION, 6);
        map.view_mut((0, 0), (CALIBRATION, CALIBRATION)).copy_from(&calibration);
        map.view_mut((CALIBRATION, CALIBRATION), (own, 6)).copy_from(&seams);
    }
    map.view_mut((0, ALL), (CALIBRATION, CALIBRATION)).copy_from(&calibration);
    map.view_mut((CALIBRATION, ALL + CALIBRATION), (rest, rest)).fill_with_identity();
    map
}
