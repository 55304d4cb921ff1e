//! Stage 4 for a whole stripe: the line fitted to a stripe relative to the line through the predicted stripe.
//!
//! A stripe is reported as two support points of its line of least squares, half a length/√3 from the middle.
//! A plate is not straight, so the line does not lie on the stripe. The same line is therefore fitted to the
//! predicted stripe. With h the distance of the reported line from it, perpendicular to the line, and t from
//! −1 to 1 along the line,
//!
//! ```text
//! ρ(±1/√3) = ½ ∫ h dt ± √3 · ½ ∫ t h dt
//! ```
//!
//! by Gauss–Legendre quadrature with three points, which is exact for h up to the fourth degree. For a straight stripe this is the distance at the
//! support points.
//!
//! A line of a picture is fitted to even columns, in px, so t and h are those of the picture. Parts further
//! from the camera are smaller there. By the depth z along the line, t is as z₂/z₁ has it, and a pixel is as
//! long as z.

use crate::stripe_residual::{Local, SheetInBase};
use crate::{Placement, StripeJacobian, StripeOnPlate};
use nalgebra::Vector2;

/// Places of the distances along a line, in units of the way from its middle to its second support point:
/// ±√(3/5) of its half length, which is √3 of them.
const NODES: [f64; 3] = [-NODE, 0.0, NODE];
/// √(9/5).
const NODE: f64 = 1.341_640_786_499_874;
/// Their weights in the line at its support points: 5/18, 8/18, 5/18 of the mean, and √(9/5) · 5/18 of the
/// slope.
const PARTS: [[f64; 3]; 2] =
    [[MEAN + SLOPE, 4.0 / 9.0, MEAN - SLOPE], [MEAN - SLOPE, 4.0 / 9.0, MEAN + SLOPE]];
const MEAN: f64 = 5.0 / 18.0;
const SLOPE: f64 = NODE * MEAN;

/// Cosine of the largest angle between a line and the stripe that it belongs to.
const LEAST_ALIKE: f64 = std::f64::consts::FRAC_1_SQRT_2;
/// Maximum Newton steps from a line to the stripe. Each reduces the error by the product of the bow's slope and curvature.
const STEPS: usize = 4;
/// After a step below this the stripe is reached, m: to its square over the bow's radius, as φ is.
const REACHED_M: f64 = 1e-7;

/// The two support points of a stripe as reported.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SupportPair {
    /// Reported sheet coordinates, m.
    pub reported: [Vector2<f64>; 2],
    /// Ratio of the second's distance from the camera to the first's, along its axis; 1 for sensors that
    /// report lengths.
    pub depth_ratio: f64,
}

impl SupportPair {
    /// The places of the line, as parts of the way from the first support point to the second, and the weight of each
    /// point's distance at these places.
    fn places(&self) -> ([f64; 3], [[f64; 3]; 2]) {
        let of_picture = NODES.map(|node| 0.5 * (1.0 + node));
        // 1/z is linear in the image.
        let nearness = of_picture.map(|part| 1.0 - part + part / self.depth_ratio);
        let places = std::array::from_fn(|k| of_picture[k] / (self.depth_ratio * nearness[k]));
        let depths = [1.0, self.depth_ratio];
        let parts = [0, 1]
            .map(|support: usize| std::array::from_fn(|k| PARTS[support][k] * depths[support] * nearness[k]));
        (places, parts)
    }
}

/// A place of the reported line, and the predicted stripe beside it.
struct Node {
    /// Distance of the line from the stripe along the normal, m.
    distance_m: f64,
    local: Local,
    /// Place of the stripe, reported sheet coordinates, m.
    on_stripe: Vector2<f64>,
}

impl StripeOnPlate<'_> {
    /// The residuals of the two support points of a stripe, m: distance of its line from that through the predicted stripe. `None` if the plate lies
    /// along the sheet.
    #[must_use]
    pub fn support_residuals(&self, placement: &Placement, supports: &SupportPair) -> Option<[f64; 2]> {
        let (places, parts) = supports.places();
        let (_, nodes) = self.nodes(placement, supports, &places)?;
        Some(parts.map(|parts| nodes.iter().zip(parts).map(|(node, part)| part * node.distance_m).sum()))
    }

    /// [`StripeOnPlate::support_residuals`] with their derivatives. For a stripe that is no line near the predicted one, an
    /// outlier, the rotation of the direction is left out.
    #[must_use]
    pub fn linearize_supports(
        &self,
        placement: &Placement,
        supports: &SupportPair,
    ) -> Option<[StripeJacobian; 2]> {
        let (places, parts) = supports.places();
        let (normal, nodes) = self.nodes(placement, supports, &places)?;
        let mut sums = [StripeJacobian::ZERO; 2];
        for (k, node) in nodes.iter().enumerate() {
            let along = (&normal, node.distance_m);
            let row = self.jacobian_along(placement, &node.on_stripe, &node.local, along);
            sums.iter_mut().zip(parts).for_each(|(sum, parts)| sum.add(&row, parts[k]));
        }
        Some(sums)
    }

    /// The normal of a line, or of the stripe if they differ by more than 45°, to the side where φ rises, and
    /// the distance of the line's places from the stripe along it.
    fn nodes(
        &self,
        placement: &Placement,
        supports: &SupportPair,
        places: &[f64; 3],
    ) -> Option<(Vector2<f64>, [Node; 3])> {
        let [one, other] = supports.reported;
        let way = other - one;
        let across = Vector2::new(-way.y, way.x).try_normalize(0.0)?;
        let sheet = self.sheet_in_base(placement);
        let middle = one + way * places[1];
        let local = self.local(&sheet, &middle)?;
        let up = local.gradient.normalize();
        let turned = across.dot(&up);
        // A stripe of another plate is no line near this one: its distance is that of the places unchanged.
        let normal = if turned.abs() > LEAST_ALIKE { across * turned.signum() } else { up };
        let centre = self.along(&sheet, (&middle, &normal), (0.0, local))?;
        let first_m = centre.distance_m;
        let beside = |part: f64| {
            let place = one + way * part;
            let local = self.local(&sheet, &(place - normal * first_m))?;
            self.along(&sheet, (&place, &normal), (first_m, local))
        };
        Some((normal, [beside(places[0])?, centre, beside(places[2])?]))
    }

    /// The stripe near a place, along a direction; the search begins at a distance with known φ.
    fn along(
        &self,
        sheet: &SheetInBase,
        (place, normal): (&Vector2<f64>, &Vector2<f64>),
        (first_m, first): (f64, Local),
    ) -> Option<Node> {
        let (mut distance_m, mut local) = (first_m, first);
        for _ in 0..STEPS {
            let step = local.value / local.steepness_along(normal)?;
            distance_m += step;
            if step.abs() < REACHED_M {
                break;
            }
            local = self.local(sheet, &(place - normal * distance_m))?;
        }
        Some(Node { distance_m, local, on_stripe: place - normal * distance_m })
    }
}
