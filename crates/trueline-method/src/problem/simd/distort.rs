//! The points that a sensor with a shape reports for four predicted points. The scalar form, with the derivation, is
//! [`trueline_model::SheetShape::reported`].

use super::displacement_rows::{FullRows, InSheetRows};
use super::lanes::{Lanes, Vectors};
use super::located::Located;
use trueline_model::SheetShape;

/// Replaces the predicted point by the reported one in the residual and its rows. Returns d r / d h.
#[inline(always)]
pub(super) fn distort<const FUSED: bool>(
    located: Located<FUSED, InSheetRows<FUSED>>,
    measured: Vectors<FUSED>,
    shape: &SheetShape,
) -> (Located<FUSED, FullRows<FUSED>>, [[Lanes<FUSED>; 2]; 5]) {
    let splat = Lanes::<FUSED>::splat;
    let [h1, h2, h3, h4, h5] = shape.h;
    let origin = shape.origin_m.map(splat);
    let (inverse_a, inverse_b) = (splat(1.0 / (1.0 + h1)), splat(1.0 / (1.0 + h2)));
    let (shear, zero) = (splat(h3), splat(0.0));
    let b = (located.at.0[1] - origin[1]) * inverse_b;
    let a = (located.at.0[0] - origin[0] - shear * b) * inverse_a;
    let inverse_w = splat(1.0) / (splat(1.0) - splat(h4) * a - splat(h5) * b);
    let (x, y) = (a * inverse_w, b * inverse_w);
    let residual = [measured.0[0] - origin[0] - x, measured.0[1] - origin[1] - y];
    // d reported / d m = (1 + g (h₄ h₅))/w
    let d_m = [
        [(splat(1.0) + x * splat(h4)) * inverse_w, x * splat(h5) * inverse_w],
        [y * splat(h4) * inverse_w, (splat(1.0) + y * splat(h5)) * inverse_w],
    ];
    let first = times(d_m, [inverse_a, zero]);
    let second = times(d_m, [-(shear * inverse_a * inverse_b), inverse_b]);
    let [slope_a, slope_b] = located.rows.slopes;
    let rows = FullRows([
        Vectors([first[0], second[0], -(slope_a * first[0]).plus_product(slope_b, second[0])]),
        Vectors([first[1], second[1], -(slope_a * first[1]).plus_product(slope_b, second[1])]),
    ]);
    let Located { at, along, usable, .. } = located;
    let by_shape = [
        times(d_m, [a * inverse_a, zero]),
        times(d_m, [-(shear * b * inverse_a * inverse_b), b * inverse_b]),
        times(d_m, [b * inverse_a, zero]),
        [-(x * x), -(y * x)],
        [-(x * y), -(y * y)],
    ];
    (Located { rows, at, residual, along, usable }, by_shape)
}

#[inline(always)]
fn times<const FUSED: bool>(m: [[Lanes<FUSED>; 2]; 2], v: [Lanes<FUSED>; 2]) -> [Lanes<FUSED>; 2] {
    [(m[0][0] * v[0]).plus_product(m[0][1], v[1]), (m[1][0] * v[0]).plus_product(m[1][1], v[1])]
}
