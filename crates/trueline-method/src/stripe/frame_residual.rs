//! Frame → up to five residuals and their gradients, by the chain rule.

use crate::input::observations::Observations;
use crate::problem::parameters::{ROTATION, TIME_OFFSET, TRANSLATION};
use crate::problem::placement::placement_at;
use crate::stripe::frames::{SeamSight, Sight, StripeFrame, reported};
use crate::stripe::state::StripeState;
use crate::stripe::target::{EDGE, Target};
use crate::stripe::unknowns::{LOCAL_ALL, LOCAL_SHAPE, local_of_surface};
use nalgebra::{Matrix2, SMatrix, SVector, Vector2, Vector3};
use trueline_model::{Placement, Plate, SheetShape, StripeJacobian, StripeOnPlate};

/// Most residuals of a frame: two support points a plate, and the edge point.
pub const ROWS: usize = 5;
/// The residual of the edge point.
pub const EDGE_ROW: usize = 4;

/// The gradient of each residual by the unknowns that a frame depends on, a column each: the transpose of the Jacobian, so that what
/// is of one residual lies together.
pub(crate) type FrameGradients = SMatrix<f64, LOCAL_ALL, ROWS>;

/// The residuals of a frame, m, and how the errors that they share move them; rows that it does not have are zero.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FrameResidual {
    /// Residuals: support points by plate and the edge point, or the seam point along both axes of the sheet.
    pub residual: SVector<f64, ROWS>,
    /// By the time offset, m/s.
    pub d_time_offset: SVector<f64, ROWS>,
    /// By a displacement of the robot in base.
    pub d_displacement: SMatrix<f64, ROWS, 3>,
    /// By a turn of the robot in base.
    pub d_turn: SMatrix<f64, ROWS, 3>,
    /// By a shift of what is measured, sheet coordinates.
    pub d_reported: SMatrix<f64, ROWS, 2>,
    /// Whether one of them is that of an edge point.
    pub has_edge: bool,
}

/// Where the sensor was when a frame of this stamp (s) was exposed; `None` outside the recording or in a gap.
#[must_use]
pub fn placement(observations: &Observations, stamp_s: f64, at: &StripeState) -> Option<Placement> {
    placement_at(&observations.robot.trajectory, stamp_s - at.time_offset_s, &at.tool_from_camera)
}

/// The residuals of a frame and their gradients, not whitened; `None` where a plate lies along the sheet.
#[must_use]
pub(crate) fn linearize_frame(
    observations: &Observations,
    frame: &StripeFrame,
    at: &StripeState,
    placement: &Placement,
) -> Option<(FrameResidual, FrameGradients)> {
    let view =
        View { observations, target: at.joints.get(frame.joint)?, shape: at.shape.as_ref(), placement };
    match &frame.sight {
        Sight::Seam(seam) => view.seam(seam),
        Sight::Stripes(stripes) => {
            let (mut all, mut gradients) = (EMPTY, FrameGradients::zeros());
            for (number, supports) in stripes.iter().enumerate() {
                let Some(supports) = supports else { continue };
                let parts = view
                    .on(&view.target.plates[number])
                    .linearize_supports(placement, &reported(supports))?;
                for (row, parts) in (2 * number..).zip(&parts) {
                    view.set_row(&mut all, row, parts);
                    set_gradient(gradients.column_mut(row).as_mut_slice(), number, parts);
                }
            }
            if let (Some(edge), Some(point)) = (&view.target.edge, &frame.edge) {
                let parts = view.point(&edge.surface, &point.reported)?;
                view.set_row(&mut all, EDGE_ROW, &parts);
                set_gradient(gradients.column_mut(EDGE_ROW).as_mut_slice(), EDGE, &parts);
                all.has_edge = true;
            }
            Some((all, gradients))
        }
    }
}

/// The residuals of a frame alone; `None` as for [`linearize_frame`].
pub(crate) fn residual_of_frame(
    observations: &Observations,
    frame: &StripeFrame,
    at: &StripeState,
    placement: &Placement,
) -> Option<SVector<f64, ROWS>> {
    let Sight::Stripes(stripes) = &frame.sight else {
        return Some(linearize_frame(observations, frame, at, placement)?.0.residual);
    };
    let (target, shape) = (at.joints.get(frame.joint)?, at.shape.as_ref());
    let on = |plate| StripeOnPlate { plate, sheet: &observations.sheet, shape };
    let mut residual = SVector::<f64, ROWS>::zeros();
    for (number, supports) in stripes.iter().enumerate() {
        let Some(supports) = supports else { continue };
        let of_plate = on(&target.plates[number]).support_residuals(placement, &reported(supports))?;
        residual.fixed_rows_mut::<2>(2 * number).copy_from_slice(&of_plate);
    }
    if let (Some(edge), Some(point)) = (&target.edge, &frame.edge) {
        residual[EDGE_ROW] = on(&edge.surface).residual(placement, &point.reported)?;
    }
    Some(residual)
}

const EMPTY: FrameResidual = FrameResidual {
    residual: SVector::<f64, ROWS>::new(0.0, 0.0, 0.0, 0.0, 0.0),
    d_time_offset: SVector::<f64, ROWS>::new(0.0, 0.0, 0.0, 0.0, 0.0),
    d_displacement: SMatrix::<f64, ROWS, 3>::from_array_storage(nalgebra::ArrayStorage([[0.0; ROWS]; 3])),
    d_turn: SMatrix::<f64, ROWS, 3>::from_array_storage(nalgebra::ArrayStorage([[0.0; ROWS]; 3])),
    d_reported: SMatrix::<f64, ROWS, 2>::from_array_storage(nalgebra::ArrayStorage([[0.0; ROWS]; 2])),
    has_edge: false,
};

/// A joint as the sensor sees it in one frame.
struct View<'a> {
    observations: &'a Observations,
    target: &'a Target,
    shape: Option<&'a SheetShape>,
    placement: &'a Placement,
}

impl View<'_> {
    fn on<'b>(&'b self, plate: &'b Plate) -> StripeOnPlate<'b> {
        StripeOnPlate { plate, sheet: &self.observations.sheet, shape: self.shape }
    }

    fn point(&self, plate: &Plate, reported: &Vector2<f64>) -> Option<StripeJacobian> {
        self.on(plate).linearize(self.placement, reported)
    }

    fn set_row(&self, all: &mut FrameResidual, row: usize, parts: &StripeJacobian) {
        let lever: Vector3<f64> = parts.foot_in_base - self.placement.base_from_tool.translation.vector;
        all.residual[row] = parts.residual;
        all.d_time_offset[row] = parts.d_time_offset;
        all.d_displacement.set_row(row, &parts.d_displacement.transpose());
        all.d_turn.set_row(row, &lever.cross(&parts.d_displacement).transpose());
        all.d_reported.set_row(row, &parts.normal.transpose());
    }

    /// A seam point against the crossing of the predicted stripes of the surfaces that meet there: with their normals as the rows of N, r = N⁻¹ ρ, and
    /// everything is evaluated at the crossing, where ρ vanishes. Two plates that share a side of it count with half each.
    fn seam(&self, seam: &SeamSight) -> Option<(FrameResidual, FrameGradients)> {
        let mut crossing = seam.reported;
        for _ in 0..CROSSING_STEPS {
            let (parts, inverse) = self.crossing_at(&crossing)?;
            for Side { row, share, parts, .. } in parts.iter().flatten() {
                crossing -= inverse.column(*row) * (share * parts.residual);
            }
        }
        let (parts, inverse) = self.crossing_at(&crossing)?;
        let (mut all, mut gradients) = (EMPTY, FrameGradients::zeros());
        for Side { row, share, surface, parts } in parts.iter().flatten() {
            let (mut own, mut gradient) = (EMPTY, SVector::<f64, LOCAL_ALL>::zeros());
            self.set_row(&mut own, *row, parts);
            set_gradient(gradient.as_mut_slice(), *surface, parts);
            let share = inverse.column(*row) * *share;
            let mut by_unknowns = gradients.fixed_columns_mut::<2>(0);
            by_unknowns += gradient * share.transpose();
            let mut rate = all.d_time_offset.fixed_rows_mut::<2>(0);
            rate += share * own.d_time_offset[*row];
            let mut displacement = all.d_displacement.fixed_rows_mut::<2>(0);
            displacement += share * own.d_displacement.row(*row);
            let mut turn = all.d_turn.fixed_rows_mut::<2>(0);
            turn += share * own.d_turn.row(*row);
        }
        all.residual.fixed_rows_mut::<2>(0).copy_from(&(seam.reported - crossing));
        all.d_reported.fixed_rows_mut::<2>(0).fill_with_identity();
        Some((all, gradients))
    }

    /// The residuals of a point beside each surface that meets in the seam, and the inverse of the normals N as they count.
    fn crossing_at(&self, at: &Vector2<f64>) -> Option<([Option<Side>; 3], Matrix2<f64>)> {
        let (first, second) = self.target.at_seam();
        let side = |row, share, surface| {
            let parts = self.point(self.target.surface(surface)?, at)?;
            Some(Side { row, share, surface, parts })
        };
        let [one, other] = first;
        let mut one = side(0, 1.0, one?)?;
        let other = match other {
            Some(surface) => {
                one.share = 0.5;
                let other = side(0, 0.5, surface)?;
                let sign = one.parts.normal.dot(&other.parts.normal).signum();
                Some(Side { share: 0.5 * sign, ..other })
            }
            None => None,
        };
        let sides = [Some(one), other, Some(side(1, 1.0, second)?)];
        let mut normals = Matrix2::zeros();
        for Side { row, share, parts, .. } in sides.iter().flatten() {
            let mut normal = normals.row_mut(*row);
            normal += parts.normal.transpose() * *share;
        }
        Some((sides, normals.try_inverse()?))
    }
}

/// The gradient of a residual of one surface.
fn set_gradient(gradient: &mut [f64], surface: usize, parts: &StripeJacobian) {
    let mut set =
        |first: usize, numbers: &[f64]| gradient[first..first + numbers.len()].copy_from_slice(numbers);
    let [plane, terms] = local_of_surface(surface);
    set(TIME_OFFSET, &[parts.d_time_offset]);
    set(ROTATION, parts.d_rotation.as_slice());
    set(TRANSLATION, parts.d_translation.as_slice());
    set(plane, parts.d_plate.as_slice());
    set(terms, parts.d_surface.as_slice());
    set(LOCAL_SHAPE, parts.d_shape.as_slice());
}

/// What one surface says of a point in the crossing.
struct Side {
    /// Of which of the two sides of the crossing.
    row: usize,
    /// With what part of it.
    share: f64,
    /// Number of the surface.
    surface: usize,
    parts: StripeJacobian,
}

/// Newton's steps to the crossing: stripes bend by some 1e-4.
const CROSSING_STEPS: usize = 3;
