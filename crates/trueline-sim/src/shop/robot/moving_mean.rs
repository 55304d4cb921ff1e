//! A log of means over the past.

use trueline_geometry::arm::six_axes::AXES;

/// Nodes, from −1 to 1, and weights of the five-point Gauss–Legendre rule \[Abramowitz1964, table 25.4\], weights halved.
const LEGENDRE: [(f64, f64); 5] = [
    (-0.906_179_845_939, 0.118_463_442_528),
    (-0.538_469_310_106, 0.239_314_335_250),
    (0.0, 0.284_444_444_444),
    (0.538_469_310_106, 0.239_314_335_250),
    (0.906_179_845_939, 0.118_463_442_528),
];

/// Mean of the joints over a length of time that ends now, rad.
pub(crate) fn mean(angles: &dyn Fn(f64) -> [f64; AXES], time_s: f64, length_s: f64) -> [f64; AXES] {
    let mut mean = [0.0; AXES];
    for (node, weight) in LEGENDRE {
        let at = angles(time_s - 0.5 * length_s * (1.0 - node));
        (0..AXES).for_each(|k| mean[k] += weight * at[k]);
    }
    mean
}
