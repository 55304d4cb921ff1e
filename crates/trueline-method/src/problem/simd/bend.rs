//! Intersections of four bowed seams with their sheets: two Newton steps from those of the straight lines. The scalar form is
//! [`trueline_model::SeamInSheet`].

use super::displacement_rows::InSheetRows;
use super::lanes::{Lanes, Vectors, WIDTH};
use super::located::Located;
use trueline_model::Curvature;
use trueline_model::curvature::MEAN_SQUARE;
use trueline_model::sheet_residual::MIN_SINE;

/// Effect of a bow on a sample.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bowed<const FUSED: bool> {
    /// φ at the intersection.
    pub form: Lanes<FUSED>,
    /// φ κ₂ and φ κ₃, m.
    pub offset: [Lanes<FUSED>; 2],
}

impl<const FUSED: bool> Bowed<FUSED> {
    /// For a straight line.
    #[inline(always)]
    pub(super) fn none() -> Self {
        let zero = Lanes::splat(0.0);
        Self { form: zero, offset: [zero; 2] }
    }
}

/// Moves the intersections of straight lines to those of bowed seams.
#[inline(always)]
pub(super) fn bend<const FUSED: bool>(
    straight: Located<FUSED, InSheetRows<FUSED>>,
    measured: Vectors<FUSED>,
    anchor: Vectors<FUSED>,
    axes: [Vectors<FUSED>; 3],
    bow: &Curvature,
) -> (Located<FUSED, InSheetRows<FUSED>>, Bowed<FUSED>) {
    let splat = Lanes::<FUSED>::splat;
    let [bow_2, bow_3] = bow.bow_m.map(splat);
    let ([u, v, w], zero) = ([axes[0], axes[1], axes[2]], splat(0.0));
    let bend = Vectors([zero; 3]).plus_scaled(v, bow_2).plus_scaled(w, bow_3);
    let mut along = straight.along;
    along = newton_step(along, bow, measured.0[2] - anchor.0[2], [u.0[2], bend.0[2]]);
    along = newton_step(along, bow, measured.0[2] - anchor.0[2], [u.0[2], bend.0[2]]);
    let (form, slope) = form_at(along, bow);
    let at = anchor.plus_scaled(u, along).plus_scaled(bend, form).0;
    let tangent = u.plus_scaled(bend, slope).0;
    let (sine, met) = guarded(tangent[2]);
    let mut usable = straight.usable;
    for lane in 0..WIDTH {
        usable[lane] &= met[lane];
    }
    let inverse = splat(1.0) / sine;
    let located = Located {
        rows: InSheetRows { slopes: [tangent[0] * inverse, tangent[1] * inverse] },
        at: Vectors([at[0], at[1], measured.0[2]]),
        residual: [measured.0[0] - at[0], measured.0[1] - at[1]],
        along,
        usable,
    };
    (located, Bowed { form, offset: [form * bow_2, form * bow_3] })
}

/// φ and its slope.
#[inline(always)]
fn form_at<const FUSED: bool>(along: Lanes<FUSED>, bow: &Curvature) -> (Lanes<FUSED>, Lanes<FUSED>) {
    let inverse = Lanes::splat(1.0 / bow.half_length_m);
    let relative = (along - Lanes::splat(bow.middle_m)) * inverse;
    (Lanes::splat(-MEAN_SQUARE).plus_product(relative, relative), (relative + relative) * inverse)
}

/// Moves along the seam to the point at `height` above its anchor. `slopes` are the heights of u₁ and of the bow.
#[inline(always)]
fn newton_step<const FUSED: bool>(
    along: Lanes<FUSED>,
    bow: &Curvature,
    height: Lanes<FUSED>,
    [direction, bend]: [Lanes<FUSED>; 2],
) -> Lanes<FUSED> {
    let (form, slope) = form_at(along, bow);
    let reached = (along * direction).plus_product(form, bend);
    along - (reached - height) / guarded(direction.plus_product(slope, bend)).0
}

/// The sine of the angle between seam and sheet, 1 without an intersection, and whether there is one.
#[inline(always)]
fn guarded<const FUSED: bool>(mut sine: Lanes<FUSED>) -> (Lanes<FUSED>, [bool; WIDTH]) {
    let mut met = [true; WIDTH];
    if (sine * sine).min() >= MIN_SINE * MIN_SINE {
        return (sine, met);
    }
    for lane in 0..WIDTH {
        met[lane] = sine.0[lane].abs() >= MIN_SINE;
        sine.0[lane] = if met[lane] { sine.0[lane] } else { 1.0 };
    }
    (sine, met)
}
