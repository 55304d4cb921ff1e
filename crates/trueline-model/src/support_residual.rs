//! Stage 4 for a whole stripe: the straight line that was fitted to a stripe against that through the predicted stripe.
//!
//! A stripe is reported as two support points of its line of least squares, half a length/√3 from the middle. A plate is not
//! straight, so the line does not lie on the stripe, and the same line is taken of the predicted stripe: with h the distance of the
//! reported line from it, square to the line, and t from −1 to 1 along the line,
//!
//! ```text
//! ρ(±1/√3) = ½ ∫ h dt ± √3 · ½ ∫ t h dt
//! ```
//!
//! by Gauss and Legendre's three points, which is exact where h is of the fourth degree. With a straight stripe that is the distance at the
//! support points.

use crate::stripe_residual::{Local, SheetInBase};
use crate::{Placement, StripeJacobian, StripeOnPlate};
use nalgebra::Vector2;

/// Where along a line the distances are taken, in units of the way from its middle to its second support point: ±√(3/5) of its
/// half length, which is √3 of them.
const NODES: [f64; 3] = [-NODE, 0.0, NODE];
/// √(9/5).
const NODE: f64 = 1.341_640_786_499_874;
/// What part of them is in the line at its support points: 5/18, 8/18, 5/18 of the mean, and √(9/5) · 5/18 of the slope.
const PARTS: [[f64; 3]; 2] =
    [[MEAN + SLOPE, 4.0 / 9.0, MEAN - SLOPE], [MEAN - SLOPE, 4.0 / 9.0, MEAN + SLOPE]];
const MEAN: f64 = 5.0 / 18.0;
const SLOPE: f64 = NODE * MEAN;

/// Cosine of the angle up to which a line is taken for one along the stripe.
const LEAST_ALIKE: f64 = std::f64::consts::FRAC_1_SQRT_2;
/// Most of Newton's steps from a line to the stripe: each leaves the bow's slope times its curvature's of the one before.
const STEPS: usize = 4;
/// After a step below this the stripe is reached, m: to its square over the bow's radius, and φ is known as near to it as that.
const REACHED_M: f64 = 1e-7;

/// A place of the reported line, and the predicted stripe beside it.
struct Node {
    /// Distance of the line from the stripe along the normal, m.
    distance_m: f64,
    local: Local,
    /// Where the stripe is, reported sheet coordinates, m.
    on_stripe: Vector2<f64>,
}

impl StripeOnPlate<'_> {
    /// The residuals of the two support points of a stripe, reported sheet coordinates in m, in m: distance of its line from that
    /// through the predicted stripe. `None` if the plate lies along the sheet.
    #[must_use]
    pub fn support_residuals(&self, placement: &Placement, supports: &[Vector2<f64>; 2]) -> Option<[f64; 2]> {
        let (_, nodes) = self.nodes(placement, supports)?;
        Some(PARTS.map(|parts| nodes.iter().zip(parts).map(|(node, part)| part * node.distance_m).sum()))
    }

    /// [`StripeOnPlate::support_residuals`] with their derivatives. Of a stripe that is no line beside the predicted one, which is an outlier, the turn of the
    /// direction is left out. What the robot's turn does to a sum of rows goes by the arm to the sum of their feet: plates are level
    /// enough for that.
    #[must_use]
    pub fn linearize_supports(
        &self,
        placement: &Placement,
        supports: &[Vector2<f64>; 2],
    ) -> Option<[StripeJacobian; 2]> {
        let (normal, nodes) = self.nodes(placement, supports)?;
        let mut sums = [StripeJacobian::ZERO; 2];
        for (k, node) in nodes.iter().enumerate() {
            let along = (&normal, node.distance_m);
            let row = self.jacobian_along(placement, &node.on_stripe, &node.local, along);
            sums.iter_mut().zip(PARTS).for_each(|(sum, parts)| sum.add(&row, parts[k]));
        }
        Some(sums)
    }

    /// The normal of a line, or that of the stripe where they differ by more than 45°, to the side where φ rises, and how far places of it are from the
    /// stripe along that.
    fn nodes(
        &self,
        placement: &Placement,
        [one, other]: &[Vector2<f64>; 2],
    ) -> Option<(Vector2<f64>, [Node; 3])> {
        let (middle, way) = (0.5 * (one + other), 0.5 * (other - one));
        let across = Vector2::new(-way.y, way.x).try_normalize(0.0)?;
        let sheet = self.sheet_in_base(placement);
        let local = self.local(&sheet, &middle)?;
        let up = local.gradient.normalize();
        let turned = across.dot(&up);
        // A stripe of another plate is no line beside this one: its distance is that of the places as they are.
        let normal = if turned.abs() > LEAST_ALIKE { across * turned.signum() } else { up };
        let centre = self.along(&sheet, (&middle, &normal), (0.0, local))?;
        let first_m = centre.distance_m;
        let beside = |node: f64| {
            let place = middle + way * node;
            let local = self.local(&sheet, &(place - normal * first_m))?;
            self.along(&sheet, (&place, &normal), (first_m, local))
        };
        Some((normal, [beside(NODES[0])?, centre, beside(NODES[2])?]))
    }

    /// The stripe beside a place, along a direction; the search begins at a distance, where φ is known.
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
