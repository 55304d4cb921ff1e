//! Intersections of four lines with their laser planes, and the residuals.

use super::displacement_rows::{FullRows, InSheetRows};
use super::lanes::{Lanes, Vectors, WIDTH};
use trueline_model::sheet_residual::MIN_SINE;

/// A residual with the inputs of its derivatives. `B` are its rows.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Located<const FUSED: bool, B> {
    pub rows: B,
    pub at: Vectors<FUSED>,
    pub residual: [Lanes<FUSED>; 2],
    pub along: Lanes<FUSED>,
    pub usable: [bool; WIDTH],
}

/// Measured minus predicted point in the sheet.
#[inline(always)]
pub(super) fn in_sheet<const FUSED: bool>(
    measured: Vectors<FUSED>,
    anchor: Vectors<FUSED>,
    axes: [Vectors<FUSED>; 3],
) -> Located<FUSED, InSheetRows<FUSED>> {
    let u = axes[0].0;
    let mut usable = [true; WIDTH];
    let mut sine = u[2];
    if (sine * sine).min() < MIN_SINE * MIN_SINE {
        for lane in 0..WIDTH {
            usable[lane] = sine.0[lane].abs() >= MIN_SINE;
            // Without an intersection the numbers are meaningless, but they must be finite.
            sine.0[lane] = if usable[lane] { sine.0[lane] } else { 1.0 };
        }
    }
    let inverse = Lanes::splat(1.0) / sine;
    let along = (measured.0[2] - anchor.0[2]) * inverse;
    let at = anchor.plus_scaled(axes[0], along).0;
    Located {
        rows: InSheetRows { slopes: [u[0] * inverse, u[1] * inverse] },
        at: Vectors([at[0], at[1], measured.0[2]]),
        residual: [measured.0[0] - at[0], measured.0[1] - at[1]],
        along,
        usable,
    }
}

/// Distance of the measured point from the line.
#[inline(always)]
pub(super) fn beside_line<const FUSED: bool>(
    measured: Vectors<FUSED>,
    anchor: Vectors<FUSED>,
    axes: [Vectors<FUSED>; 3],
) -> Located<FUSED, FullRows<FUSED>> {
    let from_anchor = measured - anchor;
    Located {
        rows: FullRows([axes[1], axes[2]]),
        at: measured,
        residual: [axes[1].dot(from_anchor), axes[2].dot(from_anchor)],
        along: axes[0].dot(from_anchor),
        usable: [true; WIDTH],
    }
}
