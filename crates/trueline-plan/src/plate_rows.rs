//! The stripes on the plates of a joint in the frames of a scan, as in the estimator. Each plate gives two residuals, of
//! two support points; the edge point gives one if the plates do not meet.
//!
//! Unknowns are time offset and hand-eye, the planes of the plates and of the edge, their forms with a prior, then the
//! sensor's shape, in the order of `trueline_method::stripe::unknowns`.

use crate::cell::Cell;
use crate::evidence::{Evidence, FrameRows};
use crate::joint::Joint;
use crate::predicted_frames::{NoiseLeft, PredictedFrame, PredictedFrames, feature_px, sheet_per_px};
use crate::robustness_to_guess::SeenBy;
use crate::stripes_ahead::{Stripe, ends, stripe};
use crate::truth::Truth;
use nalgebra::{Const, Dyn, Matrix2, OMatrix, SMatrix, UnitVector3, Vector2, Vector3};
use trueline_method::problem::parameters::TIME_OFFSET;
use trueline_method::stripe::frame_residual::{EDGE_ROW, ROWS};
use trueline_method::stripe::frames::edge_axis;
use trueline_method::stripe::state::SURFACE_SIGMA_M;
use trueline_method::stripe::target::EDGE;
use trueline_method::stripe::unknowns::{LOCAL_ALL, LOCAL_EDGE, LOCAL_SHAPE, StripeUnknowns};
use trueline_model::{Plate, SheetShape, StripeJacobian, StripeOnPlate, SupportPair};

/// Residuals of a frame, and unknowns with and without the shape of the sensor, where two plates meet.
pub(crate) const MEETING_ROWS: usize = EDGE_ROW;
/// See [`MEETING_ROWS`].
pub(crate) const MEETING_ALL: usize = LOCAL_EDGE;
/// See [`MEETING_ROWS`].
pub(crate) const MEETING_FORM: usize = LOCAL_SHAPE;
/// The same with an edge.
pub(crate) const EDGED_ROWS: usize = ROWS;
/// See [`EDGED_ROWS`].
pub(crate) const EDGED_ALL: usize = LOCAL_ALL;
/// See [`EDGED_ROWS`].
pub(crate) const EDGED_FORM: usize = LOCAL_ALL - SheetShape::DIMENSION;
/// Standard deviation of an absent support point, m: its row has no information.
const NOT_THERE_M: f64 = 1e3;

/// Information of the stripes on an approximately known joint.
pub(crate) fn stripes<const R: usize, const N: usize>(
    cell: &Cell,
    (truth, joint): (&Truth, &Joint),
    sights: &PredictedFrames,
    seen_by: &[SeenBy],
) -> Evidence<R, N> {
    let ahead = JointAhead::of(truth, joint, sights);
    let left = NoiseLeft::of(cell);
    let mut frames = Vec::with_capacity(sights.list.len());
    for (k, (sight, seen)) in sights.list.iter().zip(seen_by).enumerate() {
        if seen.stripes.iter().all(|share| *share == 0.0) {
            continue;
        }
        let Some(rows) = ahead.as_ref().and_then(|ahead| Rows::<R, N>::of(cell, ahead, sight)) else {
            continue;
        };
        let of_shares = seen.stripes.iter().enumerate().filter(|(_, share)| **share > 0.0);
        frames.extend(of_shares.filter_map(|(which, share)| {
            let is_seen = [which != 1, which != 0];
            Some(FrameRows { sight: k, share: *share, ..rows.whitened(&left, is_seen)? })
        }));
    }
    let unknowns = unknowns(joint);
    Evidence {
        frames,
        stride: sights.stride() as f64,
        asked: unknowns.asked_for(),
        shape: unknowns.shape().start,
        known_of_form: SURFACE_SIGMA_M.powi(-2),
        held: held(joint),
        axis_sigmas: Vec::new(),
    }
}

fn unknowns(joint: &Joint) -> StripeUnknowns {
    StripeUnknowns { joints: 1, edged: joint.edge_on.is_some(), shaped: true }
}

/// The unknowns that are held because nothing shows them, as the estimator has it: how the edge leans about the seam, and a plate that is
/// not there.
fn held(joint: &Joint) -> Vec<usize> {
    let unknowns = unknowns(joint);
    let missing = (0..2).filter(|&number| !joint.seen[number]).flat_map(|number| unknowns.plane(0, number));
    missing.chain(joint.edge_on.map(|_| unknowns.plane(0, EDGE).start)).collect()
}

/// A joint about the line of a cell, with the sensor's readings of it.
struct JointAhead {
    joint: Joint,
    along: Vector3<f64>,
    unknowns: StripeUnknowns,
    /// The plates and, if there is one, the edge.
    surfaces: Vec<Plate>,
    shape: SheetShape,
}

impl JointAhead {
    /// If the line differs from the guess, its plates are turned and moved with it.
    fn of(truth: &Truth, joint: &Joint, sights: &PredictedFrames) -> Option<Self> {
        let along = truth.line.direction();
        let middle = truth.line.anchor() + along * sights.middle_m();
        let joint = joint.about(&along);
        let flat = |normal: &UnitVector3<f64>, offset_m: f64| {
            Some(Plate { offset_m, ..Plate::flat(middle, normal, &along)? })
        };
        let plates = joint.plates.iter().map(|plate| flat(&plate.normal, plate.above_m));
        let edge = joint.edge_on.map(|on| flat(&joint.plates[on].outward, 0.0));
        let surfaces = plates.chain(edge).collect::<Option<_>>()?;
        let shape = SheetShape::exact_about(sights.origin());
        Some(Self { unknowns: unknowns(&joint), joint, along, surfaces, shape })
    }

    fn on_plate<'a>(&'a self, cell: &'a Cell, number: usize) -> StripeOnPlate<'a> {
        StripeOnPlate { plate: &self.surfaces[number], sheet: &cell.sheet, shape: Some(&self.shape) }
    }
}

/// The unwhitened residuals of a frame, in m.
struct Rows<const R: usize, const N: usize> {
    columns: SMatrix<f64, R, N>,
    by_px: SMatrix<f64, R, 2>,
    by_shift: SMatrix<f64, R, 3>,
    by_turn: SMatrix<f64, R, 3>,
    /// Own noise of each row, m.
    sigma_m: [f64; R],
}

impl<const R: usize, const N: usize> Rows<R, N> {
    /// The stripes where the plates cut the sheet, in view or not, and the edge point; `None` where a plate lies along the sheet.
    fn of(cell: &Cell, ahead: &JointAhead, sight: &PredictedFrame) -> Option<Self> {
        let camera_from_base = sight.placement.base_from_camera().rotation.inverse();
        let in_camera = |direction: &Vector3<f64>| camera_from_base * direction;
        let mut rows = Self {
            columns: SMatrix::zeros(),
            by_px: SMatrix::zeros(),
            by_shift: SMatrix::zeros(),
            by_turn: SMatrix::zeros(),
            sigma_m: [NOT_THERE_M; R],
        };
        let ends_of = ends(cell, (&ahead.joint, &ahead.along), in_camera, &sight.point_in_camera);
        for (number, ends) in ends_of.iter().enumerate().filter(|(number, _)| ahead.joint.seen[*number]) {
            let Stripe { places, noise } = stripe(cell, ends.as_ref()?)?;
            // Even spacing in a picture is not quite even on the sheet. For a scan that is not yet made this changes
            // thousandths.
            let reported = places.each_ref().map(|place| cell.sheet.coordinates(place));
            let supports = SupportPair { reported, depth_ratio: 1.0 };
            let found = ahead.on_plate(cell, number).linearize_supports(&sight.placement, &supports)?;
            for (k, found) in found.iter().enumerate() {
                rows.set(cell, (2 * number + k, number), (ahead, sight, found), (&places[k], noise))?;
            }
        }
        if let Some(on) = ahead.joint.edge_on {
            let places = stripe(cell, ends_of[on].as_ref()?)?.places;
            rows.set_edge(cell, on, (ahead, sight), &places)?;
        }
        Some(rows)
    }

    /// The residual of a support point of a plate; its noise is a multiple of a seam point's.
    fn set(
        &mut self,
        cell: &Cell,
        (row, number): (usize, usize),
        (ahead, sight, found): (&JointAhead, &PredictedFrame, &StripeJacobian),
        (place, noise): (&Vector3<f64>, f64),
    ) -> Option<()> {
        self.add((row, number), (ahead, sight, found), 1.0);
        self.set_own(cell, row, &found.normal, (place, noise))
    }

    /// The residual of an edge point: how far along its stripe it is from where the stripes on its plate and on the edge cross.
    fn set_edge(
        &mut self,
        cell: &Cell,
        on: usize,
        (ahead, sight): (&JointAhead, &PredictedFrame),
        places: &[Vector3<f64>; 2],
    ) -> Option<()> {
        let point = &sight.point_in_camera;
        let at = cell.sheet.coordinates(point);
        let of = |number: usize| ahead.on_plate(cell, number).linearize(&sight.placement, &at);
        let (plate, edge) = (of(on)?, of(EDGE)?);
        let [begin, end] = places.each_ref().map(|place| cell.sheet.coordinates(place));
        let axis = edge_axis(&cell.sensor, &sheet_per_px(cell, point)?, &(end - begin));
        let normals = Matrix2::from_rows(&[plate.normal.transpose(), edge.normal.transpose()]);
        let shares = normals.transpose().try_inverse()? * axis;
        self.add((EDGE_ROW, on), (ahead, sight, &plate), shares[0]);
        self.add((EDGE_ROW, EDGE), (ahead, sight, &edge), shares[1]);
        self.set_own(cell, EDGE_ROW, &axis, (point, 1.0))
    }

    /// Adds a share of how a residual moves with the unknowns and with the robot.
    fn add(
        &mut self,
        (row, number): (usize, usize),
        (ahead, sight, found): (&JointAhead, &PredictedFrame, &StripeJacobian),
        share: f64,
    ) {
        let unknowns = &ahead.unknowns;
        let mut add = |first: usize, numbers: &[f64]| {
            let columns = numbers.iter().enumerate();
            columns.for_each(|(k, number)| self.columns[(row, first + k)] += share * number);
        };
        let links = sight.placement.carried(&found.by_pose);
        add(TIME_OFFSET, links.as_slice());
        add(unknowns.plane(0, number).start, found.d_plate.as_slice());
        add(unknowns.surface(0, number).start, found.d_surface.as_slice());
        add(unknowns.shape().start, found.d_shape.as_slice());
        let mut by_shift = self.by_shift.row_mut(row);
        by_shift += found.by_pose.by_shift.transpose() * share;
        let mut by_turn = self.by_turn.row_mut(row);
        by_turn += found.by_pose.by_turn.transpose() * share;
    }

    /// The own noise of a residual along a vector of the sheet, as a multiple of a seam point's.
    fn set_own(
        &mut self,
        cell: &Cell,
        row: usize,
        along: &Vector2<f64>,
        (place, noise): (&Vector3<f64>, f64),
    ) -> Option<()> {
        let by_px = along.transpose() * sheet_per_px(cell, place)?;
        self.by_px.set_row(row, &by_px);
        self.sigma_m[row] = noise * feature_px(cell) * by_px.norm();
        Some(())
    }

    /// Whitened by Σ = D + σ_r² G Gᵀ + σ_ω² T Tᵀ + σ_t² ρ̇ ρ̇ᵀ, which all rows of a frame share. The rows of an invisible
    /// plate contain no information.
    fn whitened(&self, left: &NoiseLeft, is_seen: [bool; 2]) -> Option<FrameRows<R, N>> {
        let rate = self.columns.column(TIME_OFFSET);
        let mut covariance = self.by_shift * self.by_shift.transpose() * left.levels.robot_sigma_m.powi(2)
            + self.by_turn * self.by_turn.transpose() * left.robot_rad.powi(2)
            + rate * rate.transpose() * left.levels.stamp_sigma_s.powi(2);
        for row in 0..R {
            let is_there = is_seen.get(row / 2).is_none_or(|seen| *seen);
            let own_m = if is_there { self.sigma_m[row] } else { NOT_THERE_M };
            covariance[(row, row)] += own_m * own_m;
        }
        let lower = covariance.cholesky()?.l();
        Some(FrameRows {
            sight: 0,
            share: 0.0,
            columns: lower.solve_lower_triangular(&self.columns)?,
            by_px: lower.solve_lower_triangular(&self.by_px)?,
            by_shift: lower.solve_lower_triangular(&self.by_shift)?,
            by_turn: lower.solve_lower_triangular(&self.by_turn)?,
            by_axes: OMatrix::zeros_generic(Const, Dyn(0)),
            piece: None,
        })
    }
}

#[cfg(test)]
mod tests;
