//! Frames → problem: up to four whitened residuals for each frame, with their Jacobian by the chain rule.

use crate::input::observations::Observations;
use crate::problem::block_priors::ShapePrior;
use crate::problem::parameters::{ROTATION, TIME_OFFSET, TRANSLATION};
use crate::problem::placement::placement_at;
use crate::problem::usable::UNUSABLE_SQUARED;
use crate::stripe::frames::{SeamSight, Sight, StripeFrame, reported};
use crate::stripe::state::StripeState;
use crate::stripe::target::{EDGE, Target};
use crate::stripe::unknowns::{LOCAL_ALL, LOCAL_SHAPE, StripeUnknowns, local_of_surface};
use nalgebra::{DVector, Matrix2, SMatrix, SVector, Vector2, Vector3};
use trueline_geometry::so3;
use trueline_lsq::{LeastSquares, NormalEquations};
use trueline_model::{Placement, Plate, SheetShape, StripeJacobian, StripeOnPlate};

/// Most residuals of a frame: two support points a plate, and the edge point.
pub const ROWS: usize = 5;
/// The residual of the edge point.
pub const EDGE_ROW: usize = 4;

/// A Jacobian by the unknowns that a frame depends on.
pub(crate) type FrameJacobian = SMatrix<f64, ROWS, LOCAL_ALL>;

/// The residuals of a frame, m; rows that it does not have are zero.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FrameResidual {
    /// Residuals: support points by plate and the edge point, or the seam point along both axes of the sheet.
    pub residual: SVector<f64, ROWS>,
    /// Their Jacobian.
    pub jacobian: FrameJacobian,
    /// By a displacement of the robot in base.
    pub d_displacement: SMatrix<f64, ROWS, 3>,
    /// By a turn of the robot in base.
    pub d_turn: SMatrix<f64, ROWS, 3>,
    /// By a shift of what is measured, sheet coordinates.
    pub d_reported: SMatrix<f64, ROWS, 2>,
    /// Whether one of them is that of an edge point.
    pub has_edge: bool,
}

/// What the residuals of a frame say of the errors that they share.
///
/// A derivative that shares an error with the residual is biased wherever little else varies it, as in every problem with errors
/// in its variables. The foot of a stripe is free of the stripe's own error, but at the robot's reported pose it holds the
/// robot's. So derivatives are taken where the robot most likely was, and the residual stays that of the reported pose.
#[derive(Clone, Copy, Debug)]
pub struct PoseError {
    /// By how much the reported position is off, base, m.
    pub shift_m: Vector3<f64>,
    /// By how much the reported attitude is turned, base, rad.
    pub turn_rad: Vector3<f64>,
    /// By how much the time offset of this frame differs, s.
    pub late_s: f64,
    /// What they make of the residuals, m.
    pub in_residual: SVector<f64, ROWS>,
}

impl PoseError {
    /// No error.
    pub const NONE: Self = Self {
        shift_m: Vector3::new(0.0, 0.0, 0.0),
        turn_rad: Vector3::new(0.0, 0.0, 0.0),
        late_s: 0.0,
        in_residual: SVector::<f64, ROWS>::new(0.0, 0.0, 0.0, 0.0, 0.0),
    };
}

/// A frame with what whitens it; rows that do not count are zero.
#[derive(Clone, Copy, Debug)]
pub struct WeighedFrame {
    /// The frame.
    pub frame: StripeFrame,
    /// W with W Σ Wᵀ = 1 over the rows that count.
    pub whitener: SMatrix<f64, ROWS, ROWS>,
    /// Rows that count.
    pub rows: usize,
    /// How far the robot's report is expected to be off in it.
    pub pose_error: PoseError,
}

impl WeighedFrame {
    /// Where the sensor most likely was; `None` as for [`placement`].
    #[must_use]
    pub fn placement(&self, observations: &Observations, at: &StripeState) -> Option<Placement> {
        let PoseError { shift_m, turn_rad, late_s, .. } = &self.pose_error;
        let exposed = StripeFrame { stamp_s: self.frame.stamp_s + late_s, ..self.frame };
        let mut placement = placement(observations, &exposed, at)?;
        let robot = &mut placement.base_from_tool;
        robot.translation.vector -= shift_m;
        robot.rotation = so3::exp(&-turn_rad) * robot.rotation;
        Some(placement)
    }

    /// Whitened residuals and Jacobian where the sensor most likely was.
    pub(crate) fn whitened(&self, parts: &FrameResidual) -> (SVector<f64, ROWS>, FrameJacobian) {
        let residual = parts.residual + self.pose_error.in_residual;
        (self.whitener * residual, self.whitener * parts.jacobian)
    }
}

/// The least-squares problem of the plates. Weights are fixed: the robust loss is in the whiteners.
pub struct StripeProblem<'a> {
    /// Trajectory and sheet.
    pub observations: &'a Observations,
    /// The frames that take part.
    pub frames: Vec<WeighedFrame>,
    /// Its unknowns.
    pub unknowns: StripeUnknowns,
    /// What is known of the sensor's shape beforehand.
    pub shape_prior: Option<ShapePrior>,
}

/// Where the sensor was when a frame was exposed; `None` outside the recording or in a gap.
#[must_use]
pub fn placement(observations: &Observations, frame: &StripeFrame, at: &StripeState) -> Option<Placement> {
    let exposure_s = frame.stamp_s - at.time_offset_s;
    placement_at(&observations.robot.trajectory, exposure_s, &at.tool_from_camera)
}

/// The residuals of a frame, not whitened; `None` where a plate lies along the sheet.
#[must_use]
pub(crate) fn linearize_frame(
    observations: &Observations,
    frame: &StripeFrame,
    at: &StripeState,
    placement: &Placement,
) -> Option<FrameResidual> {
    let view =
        View { observations, target: at.joints.get(frame.joint)?, shape: at.shape.as_ref(), placement };
    match &frame.sight {
        Sight::Seam(seam) => view.seam(seam),
        Sight::Stripes(stripes) => {
            let mut all = EMPTY;
            for (number, supports) in stripes.iter().enumerate() {
                let Some(supports) = supports else { continue };
                let parts = view
                    .on(&view.target.plates[number])
                    .linearize_supports(placement, &reported(supports))?;
                view.set_row(&mut all, 2 * number, number, &parts[0]);
                view.set_row(&mut all, 2 * number + 1, number, &parts[1]);
            }
            if let (Some(edge), Some(point)) = (&view.target.edge, &frame.edge) {
                let parts = view.point(&edge.surface, &point.reported)?;
                view.set_row(&mut all, EDGE_ROW, EDGE, &parts);
                all.has_edge = true;
            }
            Some(all)
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
        return Some(linearize_frame(observations, frame, at, placement)?.residual);
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
    jacobian: FrameJacobian::from_array_storage(nalgebra::ArrayStorage([[0.0; ROWS]; LOCAL_ALL])),
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

    fn set_row(&self, all: &mut FrameResidual, row: usize, surface: usize, parts: &StripeJacobian) {
        all.residual[row] = parts.residual;
        let mut set = |first: usize, numbers: &[f64]| {
            numbers.iter().enumerate().for_each(|(k, number)| all.jacobian[(row, first + k)] = *number);
        };
        set(TIME_OFFSET, &[parts.d_time_offset]);
        set(ROTATION, parts.d_rotation.as_slice());
        set(TRANSLATION, parts.d_translation.as_slice());
        let [plane, terms] = local_of_surface(surface);
        set(plane, parts.d_plate.as_slice());
        set(terms, parts.d_surface.as_slice());
        set(LOCAL_SHAPE, parts.d_shape.as_slice());
        let lever: Vector3<f64> = parts.foot_in_base - self.placement.base_from_tool.translation.vector;
        all.d_displacement.set_row(row, &parts.d_displacement.transpose());
        all.d_turn.set_row(row, &lever.cross(&parts.d_displacement).transpose());
        all.d_reported.set_row(row, &parts.normal.transpose());
    }

    /// A seam point against the crossing of the predicted stripes of the surfaces that meet there: with their normals as the rows of N, r = N⁻¹ ρ, and
    /// everything is evaluated at the crossing, where ρ vanishes. Two plates that share a side of it count with half each.
    fn seam(&self, seam: &SeamSight) -> Option<FrameResidual> {
        let mut crossing = seam.reported;
        for _ in 0..CROSSING_STEPS {
            let (parts, inverse) = self.crossing_at(&crossing)?;
            for Side { row, share, parts, .. } in parts.iter().flatten() {
                crossing -= inverse.column(*row) * (share * parts.residual);
            }
        }
        let (parts, inverse) = self.crossing_at(&crossing)?;
        let mut all = EMPTY;
        for Side { row, share, surface, parts } in parts.iter().flatten() {
            let mut own = EMPTY;
            self.set_row(&mut own, *row, *surface, parts);
            let share = inverse.column(*row) * *share;
            let mut jacobian = all.jacobian.fixed_rows_mut::<2>(0);
            jacobian += share * own.jacobian.row(*row);
            let mut displacement = all.d_displacement.fixed_rows_mut::<2>(0);
            displacement += share * own.d_displacement.row(*row);
            let mut turn = all.d_turn.fixed_rows_mut::<2>(0);
            turn += share * own.d_turn.row(*row);
        }
        all.residual.fixed_rows_mut::<2>(0).copy_from(&(seam.reported - crossing));
        all.d_reported.fixed_rows_mut::<2>(0).fill_with_identity();
        Some(all)
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

impl StripeProblem<'_> {
    /// Whitened residuals and Jacobian of a frame; `None` where it cannot be placed.
    #[must_use]
    pub fn whitened(
        &self,
        weighed: &WeighedFrame,
        at: &StripeState,
    ) -> Option<(SVector<f64, ROWS>, FrameJacobian)> {
        let placement = weighed.placement(self.observations, at)?;
        let parts = linearize_frame(self.observations, &weighed.frame, at, &placement)?;
        Some(weighed.whitened(&parts))
    }

    /// What is known beforehand, with its pull at a state.
    pub(crate) fn known_beforehand(&self, at: &StripeState) -> NormalEquations {
        let hessian = at.prior_information(self.shape_prior.as_ref());
        let gradient = &hessian * at.about_prior();
        NormalEquations { hessian, gradient, cost: self.cost_of_prior(at) }
    }

    fn cost_of_prior(&self, at: &StripeState) -> f64 {
        let values = at.about_prior();
        0.5 * values.dot(&(at.prior_information(self.shape_prior.as_ref()) * &values))
    }
}

impl LeastSquares for StripeProblem<'_> {
    type State = StripeState;

    fn dimension(&self) -> usize {
        self.unknowns.dimension()
    }

    fn retract(&self, state: &StripeState, step: &DVector<f64>) -> StripeState {
        state.retract(step)
    }

    fn cost(&self, state: &StripeState) -> f64 {
        let squares = self.frames.iter().map(|weighed| {
            let placement = weighed.placement(self.observations, state);
            let residual =
                placement.and_then(|p| residual_of_frame(self.observations, &weighed.frame, state, &p));
            residual.map_or(UNUSABLE_SQUARED, |residual| {
                (weighed.whitener * (residual + weighed.pose_error.in_residual)).norm_squared()
            })
        });
        0.5 * squares.sum::<f64>() + self.cost_of_prior(state)
    }

    fn linearize(&self, state: &StripeState, equations: &mut NormalEquations) {
        let mut joints: Vec<(SMatrix<f64, LOCAL_ALL, LOCAL_ALL>, SVector<f64, LOCAL_ALL>)> =
            vec![(SMatrix::zeros(), SVector::zeros()); state.joints.len()];
        let local = self.unknowns.local();
        for weighed in &self.frames {
            let Some((residual, jacobian)) = self.whitened(weighed, state) else {
                equations.cost += 0.5 * UNUSABLE_SQUARED;
                continue;
            };
            let (hessian, gradient) = &mut joints[weighed.frame.joint];
            // Of a symmetric matrix one half is enough.
            for column in 0..local {
                let of_column = jacobian.column(column);
                gradient[column] += of_column.dot(&residual);
                for row in 0..=column {
                    hessian[(row, column)] += jacobian.column(row).dot(&of_column);
                }
            }
            equations.cost += 0.5 * residual.norm_squared();
        }
        for (joint, (hessian, gradient)) in joints.iter().enumerate() {
            let places: Vec<(usize, usize)> =
                (0..local).filter_map(|k| Some((k, self.unknowns.place(k, joint)?))).collect();
            for &(row, to) in &places {
                equations.gradient[to] += gradient[row];
                for &(column, beside) in &places {
                    equations.hessian[(to, beside)] += hessian[(row.min(column), row.max(column))];
                }
            }
        }
        let known = self.known_beforehand(state);
        equations.gradient += known.gradient;
        equations.hessian += known.hessian;
        equations.cost += known.cost;
    }
}
