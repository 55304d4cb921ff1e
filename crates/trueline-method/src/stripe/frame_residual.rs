//! Frame → up to five residuals and their gradients, by the chain rule.

use crate::input::observations::Observations;
use crate::problem::parameters::TIME_OFFSET;
use crate::problem::placement::placement_at;
use crate::stripe::frames::{SeamSight, Sight, StripeFrame, reported};
use crate::stripe::state::StripeState;
use crate::stripe::target::Target;
use crate::stripe::unknowns::{LOCAL_ALL, LOCAL_SHAPE, PLANES, local_of_surface};
use nalgebra::{ArrayStorage, Matrix2, SMatrix, SVector, Vector2};
use trueline_model::{Placement, Plate, PoseGradient, SheetShape, StripeJacobian, StripeOnPlate};

/// Maximum residuals of a frame: two support points for each plate, and the edge point.
pub const ROWS: usize = 5;
/// The residual of the edge point.
pub const EDGE_ROW: usize = 4;

/// The gradient of each residual by the local unknowns, a column each. This is the transpose of the Jacobian, so that the entries of one residual
/// are contiguous.
pub(crate) type FrameGradients = SMatrix<f64, LOCAL_ALL, ROWS>;

/// The residuals of a frame, m, and their derivatives by the shared errors. Unused rows are zero.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FrameResidual {
    /// Residuals: support points by plate and the edge point, or the seam point along both axes of the sheet.
    pub residual: SVector<f64, ROWS>,
    /// ∂residual/∂(time offset), m/s.
    pub d_time_offset: SVector<f64, ROWS>,
    /// ∂residual/∂(displacement of the robot), base frame, m/m.
    pub d_displacement: SMatrix<f64, ROWS, 3>,
    /// ∂residual/∂(rotation of the robot about the tool's origin), axes of base, m/rad.
    pub d_turn: SMatrix<f64, ROWS, 3>,
    /// ∂residual/∂(reported point), sheet coordinates, m/m.
    pub d_reported: SMatrix<f64, ROWS, 2>,
    /// Whether one of them belongs to an edge point.
    pub has_edge: bool,
}

/// Pose of the sensor at a frame's stamp (s). `None` outside the recording or in a gap.
#[must_use]
pub fn placement(observations: &Observations, stamp_s: f64, at: &StripeState) -> Option<Placement> {
    placement_at(&observations.robot.trajectory, stamp_s - at.time_offset_s, &at.tool_from_camera)
}

/// The residuals of a frame and their gradients, not whitened. `None` where a plate lies along the sheet.
#[must_use]
pub(crate) fn linearize_frame(
    observations: &Observations,
    frame: &StripeFrame,
    at: &StripeState,
    placement: &Placement,
) -> Option<(FrameResidual, FrameGradients)> {
    let view =
        View { observations, target: at.joints.get(frame.joint)?, shape: at.shape.as_ref(), placement };
    let mut rows = FrameRows::NONE;
    match &frame.sight {
        Sight::Seam(seam) => view.seam(seam, &mut rows)?,
        Sight::Stripes(stripes) => {
            for (number, supports) in stripes.iter().enumerate() {
                let Some(supports) = supports else { continue };
                let parts = view
                    .on(&view.target.plates[number])
                    .linearize_supports(placement, &reported(supports))?;
                for (row, parts) in (2 * number..).zip(&parts) {
                    rows.add(row, number, parts, 1.0);
                    rows.all.residual[row] = parts.residual;
                    rows.all.d_reported.set_row(row, &parts.normal.transpose());
                }
            }
            if let (Some(_), Some(point)) = (&view.target.edge, &frame.edge) {
                let crossing = view.crossing(&point.reported)?;
                rows.add_beside(&crossing, &point.reported, EDGE_ROW, &frame.edge_axis);
                rows.all.has_edge = true;
            }
        }
    }
    Some(rows.carried(placement))
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
    let view =
        View { observations, target: at.joints.get(frame.joint)?, shape: at.shape.as_ref(), placement };
    let mut residual = SVector::<f64, ROWS>::zeros();
    for (number, supports) in stripes.iter().enumerate() {
        let Some(supports) = supports else { continue };
        let of_plate =
            view.on(&view.target.plates[number]).support_residuals(placement, &reported(supports))?;
        residual.fixed_rows_mut::<2>(2 * number).copy_from_slice(&of_plate);
    }
    if let (Some(_), Some(point)) = (&view.target.edge, &frame.edge) {
        residual[EDGE_ROW] = frame.edge_axis.dot(&(point.reported - view.crossing(&point.reported)?.at));
    }
    Some(residual)
}

/// The rows of a frame with their derivatives by the sensor's pose, before the chain rule.
struct FrameRows {
    all: FrameResidual,
    by_pose: [PoseGradient; ROWS],
    gradients: FrameGradients,
}

impl FrameRows {
    const NONE: Self = Self {
        all: FrameResidual {
            residual: SVector::<f64, ROWS>::new(0.0, 0.0, 0.0, 0.0, 0.0),
            d_time_offset: SVector::<f64, ROWS>::new(0.0, 0.0, 0.0, 0.0, 0.0),
            d_displacement: SMatrix::from_array_storage(ArrayStorage([[0.0; ROWS]; 3])),
            d_turn: SMatrix::from_array_storage(ArrayStorage([[0.0; ROWS]; 3])),
            d_reported: SMatrix::from_array_storage(ArrayStorage([[0.0; ROWS]; 2])),
            has_edge: false,
        },
        by_pose: [PoseGradient::ZERO; ROWS],
        gradients: SMatrix::from_array_storage(ArrayStorage([[0.0; LOCAL_ALL]; ROWS])),
    };

    /// Adds a share of one surface to the derivatives of a row.
    fn add(&mut self, row: usize, surface: usize, parts: &StripeJacobian, share: f64) {
        self.by_pose[row].add(&parts.by_pose, share);
        let gradient = &mut self.gradients.as_mut_slice()[LOCAL_ALL * row..][..LOCAL_ALL];
        let mut add = |first: usize, numbers: &[f64]| {
            gradient[first..].iter_mut().zip(numbers).for_each(|(sum, number)| *sum += share * number);
        };
        let [plane, terms] = local_of_surface(surface);
        add(plane, parts.d_plate.as_slice());
        add(terms, parts.d_surface.as_slice());
        add(LOCAL_SHAPE, parts.d_shape.as_slice());
    }

    /// Adds the row of a point's offset from the intersection along an axis of the sheet. With the normals of both stripes as the rows of N the
    /// offset is N⁻¹ ρ. All is evaluated at the intersection, where ρ vanishes. Two plates on one side of the seam have half the weight each.
    fn add_beside(&mut self, crossing: &Crossing, point: &Vector2<f64>, row: usize, axis: &Vector2<f64>) {
        for side in crossing.sides.iter().flatten() {
            let share = side.share * axis.dot(&crossing.inverse.column(side.row));
            self.add(row, side.surface, &side.parts, share);
        }
        self.all.residual[row] = axis.dot(&(point - crossing.at));
        self.all.d_reported.set_row(row, &axis.transpose());
    }

    /// Applies the chain rule through the sensor's placement.
    fn carried(self, placement: &Placement) -> (FrameResidual, FrameGradients) {
        let Self { mut all, by_pose, mut gradients } = self;
        for (row, by_pose) in by_pose.iter().enumerate() {
            let links = placement.carried(by_pose);
            all.d_time_offset[row] = links[TIME_OFFSET];
            all.d_displacement.set_row(row, &by_pose.by_shift.transpose());
            all.d_turn.set_row(row, &by_pose.by_turn.transpose());
            gradients.fixed_view_mut::<PLANES, 1>(0, row).copy_from(&links);
        }
        (all, gradients)
    }
}

/// A joint in the sensor's frame at one stamp.
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

    /// A seam point minus the intersection of the predicted stripes, along both axes of the sheet.
    fn seam(&self, seam: &SeamSight, rows: &mut FrameRows) -> Option<()> {
        let crossing = self.crossing(&seam.reported)?;
        for (row, axis) in [Vector2::x(), Vector2::y()].iter().enumerate() {
            rows.add_beside(&crossing, &seam.reported, row, axis);
        }
        Some(())
    }

    /// The intersection of the predicted stripes of the surfaces that meet in the seam, near a point.
    fn crossing(&self, near: &Vector2<f64>) -> Option<Crossing> {
        let mut at = *near;
        for _ in 0..CROSSING_STEPS {
            let (sides, inverse) = self.crossing_at(&at)?;
            for Side { row, share, parts, .. } in sides.iter().flatten() {
                at -= inverse.column(*row) * (share * parts.residual);
            }
        }
        let (sides, inverse) = self.crossing_at(&at)?;
        Some(Crossing { at, sides, inverse })
    }

    /// The residuals of a point to each surface that meets in the seam, and the inverse of the weighted normals N.
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

/// An intersection of predicted stripes in the sheet.
struct Crossing {
    /// Sheet coordinates, m.
    at: Vector2<f64>,
    sides: [Option<Side>; 3],
    /// Inverse of the weighted normals N.
    inverse: Matrix2<f64>,
}

/// Contribution of one surface to a point of the crossing.
struct Side {
    /// Side of the seam: row 0 or 1.
    row: usize,
    /// Its weight there.
    share: f64,
    /// Number of the surface.
    surface: usize,
    parts: StripeJacobian,
}

/// Newton steps to the intersection. Stripes bend by some 1e-4.
const CROSSING_STEPS: usize = 3;

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use crate::config::{Config, Measurements};
    use crate::input::observations::{observe, origin_ns};
    use crate::input::timestamps::Sampling;
    use crate::problem::layout::Layout;
    use crate::problem::parameters::Parameters;
    use crate::stripe::frames::frames;
    use crate::stripe::start::start;
    use nalgebra::{DMatrix, DVector};
    use trueline_sim::{Between, Disturbance, PlateForm, PlatePair, Plates, Preset, scan_plates};

    /// Allowed error of an entry, relative to the largest of its column. A step of 1e-6 leaves 1e-12 of a third derivative, and the foot is found to
    /// 1e-9.
    const GRADIENT_TOLERANCE: f64 = 1e-6;
    /// A step small enough for differences: rad, m or s.
    const STEP: f64 = 1e-6;

    fn plates(pair: PlatePair) -> Plates {
        Plates { pair, forms: [PlateForm::of_term(0, 2e-4); 2], ..Plates::default() }
    }

    /// Every twentieth frame: the rows for steps of all unknowns, against central differences of the residuals, at a state that is some micrometres
    /// off.
    fn check(pair: PlatePair, sight_of: impl Fn(&StripeFrame) -> StripeFrame) {
        let mut scenario = Preset::Good.scenario();
        scenario.disturbance = Disturbance::default();
        scenario.timing.between = Between::Straight;
        let recording = scan_plates(&scenario, &plates(pair), 3).unwrap();
        let config = Config::noise_only();
        let observed =
            observe(&recording, &Sampling::of(&recording, origin_ns(&recording)), &config).unwrap();
        let truth = recording.truth.as_ref().unwrap();
        let seam = Parameters::straight(&truth.parameters, truth.lines.clone());
        let all = frames(&recording, &observed, Measurements::Stripe, &config).unwrap();
        let begin =
            start(&observed, &all, &seam, Some(SheetShape::exact_about(&observed.shape_origin_m.into())));
        let begin = begin.unwrap();
        let unknowns = begin.unknowns();
        // Between the robot's samples too, where the path has a corner.
        let sizes = DVector::from_fn(unknowns.dimension(), |k, _| ((7 * k + 1) as f64).sin() * 2e-5);
        let at = begin.retract(&sizes);
        let residual = |state: &StripeState, frame: &StripeFrame| {
            let placement = placement(&observed, frame.stamp_s, state).unwrap();
            residual_of_frame(&observed, frame, state, &placement).unwrap()
        };
        let inside = |frame: &&StripeFrame| observed.robot.trajectory.bracket(frame.stamp_s - 0.1).is_some();
        let mut most = SVector::<f64, ROWS>::zeros();
        let (mut off, mut largest) = (vec![0.0_f64; sizes.len()], vec![0.0_f64; sizes.len()]);
        for frame in all.list.iter().filter(inside).step_by(20).map(sight_of) {
            let sensor = placement(&observed, frame.stamp_s, &at).unwrap();
            let (rows, gradients) = linearize_frame(&observed, &frame, &at, &sensor).unwrap();
            assert!((rows.residual - residual(&at, &frame)).amax() < 1e-12);
            let mut found = DMatrix::zeros(unknowns.dimension(), ROWS);
            for (row, mut found) in found.column_iter_mut().enumerate() {
                unknowns.add(0, gradients.column(row).as_slice(), found.as_mut_slice());
            }
            for k in 0..unknowns.dimension() {
                let step = DVector::from_fn(unknowns.dimension(), |j, _| if j == k { STEP } else { 0.0 });
                let [after, before] = [at.retract(&step), at.retract(&-step)].map(|at| residual(&at, &frame));
                let slope = (after - before) / (2.0 * STEP);
                off[k] = off[k].max((slope - found.row(k).transpose()).amax());
                largest[k] = largest[k].max(slope.amax());
                most = most.sup(&slope.abs());
            }
        }
        println!("{pair:?}: {most:?}");
        for (k, (off, largest)) in off.iter().zip(&largest).enumerate() {
            // A residual of 0.1 m rounds to 1e-17 m, and some dozen steps to it to 1e-16 m, over 2e-6.
            assert!(*off < GRADIENT_TOLERANCE * largest + 1e-9, "{pair:?} {k}: {off:e} of {largest:e}");
        }
    }

    #[test]
    fn gradients_are_those_of_the_residuals() {
        for pair in [
            PlatePair::Meeting,
            PlatePair::Lap { step_m: 3e-3 },
            PlatePair::Edge,
            PlatePair::Butt { gap_m: 1e-3, mismatch_m: 0.5e-3 },
        ] {
            check(pair, |frame| *frame);
            check(pair, |frame| StripeFrame { sight: Sight::Seam(frame.edge.unwrap()), ..*frame });
        }
    }
}
