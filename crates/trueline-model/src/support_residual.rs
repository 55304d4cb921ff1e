//! Stage 4 for a whole stripe: the straight line that was fitted to a stripe against that through the predicted stripe.
//!
//! A stripe is reported as two support points of its line of least squares, half a length/√3 from the middle. A plate is not
//! straight, so the line does not lie on the stripe, and the same line is taken of the predicted stripe: with h the distance of the
//! reported line from it, square to it, and t from −1 to 1 along the line,
//!
//! ```text
//! ρ(±1/√3) = ½ ∫ h dt ± √3 · ½ ∫ t h dt
//! ```
//!
//! by Gauss and Legendre's three points, which is exact where h is of the fourth degree. With a straight stripe that is the distance at the
//! support points.

use crate::stripe_residual::Local;
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

/// Most of Newton's steps from a line to the stripe: each leaves the bow's slope times its curvature's of the one before.
const STEPS: usize = 4;
/// After a step below this the stripe is reached, m.
const REACHED_M: f64 = 1e-9;

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

    /// [`StripeOnPlate::support_residuals`] with their derivatives; those of the normal's direction, along which distances are taken, are left out: they
    /// count by the slope of the bow times its height.
    #[must_use]
    pub fn linearize_supports(
        &self,
        placement: &Placement,
        supports: &[Vector2<f64>; 2],
    ) -> Option<[StripeJacobian; 2]> {
        let (normal, nodes) = self.nodes(placement, supports)?;
        let rows = nodes.map(|node| {
            self.jacobian_along(placement, &node.on_stripe, &node.local, (&normal, node.distance_m))
        });
        Some(PARTS.map(|parts| sum(&rows, &parts)))
    }

    /// The predicted stripe's normal beside the middle of a line, and the distances along it.
    fn nodes(
        &self,
        placement: &Placement,
        [one, other]: &[Vector2<f64>; 2],
    ) -> Option<(Vector2<f64>, [Node; 3])> {
        let (middle, way) = (0.5 * (one + other), 0.5 * (other - one));
        let (foot, local) = self.foot(placement, &middle)?;
        let normal = local.gradient.normalize();
        let first = normal.dot(&(middle - foot));
        let beside = |node: f64| self.along(placement, &(middle + way * node), &normal, first);
        let nodes =
            [beside(NODES[0])?, Node { distance_m: first, local, on_stripe: foot }, beside(NODES[2])?];
        Some((normal, nodes))
    }

    /// The stripe beside a place, along a direction; the search begins at a distance.
    fn along(
        &self,
        placement: &Placement,
        place: &Vector2<f64>,
        normal: &Vector2<f64>,
        first_m: f64,
    ) -> Option<Node> {
        let mut distance_m = first_m;
        for _ in 0..STEPS {
            let local = self.local(placement, &(place - normal * distance_m))?;
            let step = local.value / local.steepness_along(normal)?;
            distance_m += step;
            if step.abs() < REACHED_M {
                break;
            }
        }
        let on_stripe = place - normal * distance_m;
        Some(Node { distance_m, local: self.local(placement, &on_stripe)?, on_stripe })
    }
}

/// A sum of rows. What the robot's turn does to it goes by the arm to the sum of the feet: plates are level enough for that.
fn sum(rows: &[StripeJacobian; 3], parts: &[f64; 3]) -> StripeJacobian {
    let [a, b, c] = rows;
    let [of_a, of_b, of_c] = *parts;
    macro_rules! total {
        ($($field:ident),*) => { StripeJacobian { $($field: a.$field * of_a + b.$field * of_b + c.$field * of_c),* } };
    }
    total!(
        residual,
        normal,
        foot_in_base,
        d_time_offset,
        d_rotation,
        d_translation,
        d_plate,
        d_surface,
        d_shape,
        d_displacement
    )
}
