//! The stripes on both plates in the frames of a scan: up to four residuals a frame, as the estimator has them, with two support points
//! on each plate.
//!
//! Unknown are time offset and hand-eye, the two planes and, with a prior, how they are not flat, then the sensor's shape: in the
//! order of `trueline_method::stripe::unknowns`.

use crate::cell::Cell;
use crate::evidence::{Evidence, FrameRows};
use crate::sights::{NoiseLeft, Sight, Sights, feature_px, sheet_per_px};
use crate::stripes_ahead::{Stripe, ends, stripe};
use crate::truth::Truth;
use crate::wrong_cells::SeenBy;
use nalgebra::{SMatrix, UnitVector3, Vector3};
use trueline_method::problem::parameters::{ROTATION, TIME_OFFSET, TRANSLATION};
use trueline_method::stripe::state::SURFACE_SIGMA_M;
use trueline_method::stripe::unknowns::{LOCAL_EDGE, LOCAL_SHAPE, LOCAL_SURFACES, PLANES};
use trueline_model::{Plate, SheetShape, StripeJacobian, StripeOnPlate};

/// Residuals of a frame: two support points on each plate.
pub(crate) const ROWS: usize = 4;
/// Unknowns, the shape of the sensor included.
pub(crate) const PLATES_ALL: usize = LOCAL_EDGE;
/// Those without the shape.
pub(crate) const PLATES_FORM: usize = LOCAL_SHAPE;
/// A support point that is not there is known so well, m: its row tells nothing.
const NOT_THERE_M: f64 = 1e3;

/// What the stripes tell of two plates that meet in a line of which the normals are roughly known.
pub(crate) fn stripes(
    cell: &Cell,
    (truth, normals): (&Truth, &[UnitVector3<f64>; 2]),
    sights: &Sights,
    seen_by: &[SeenBy],
) -> Evidence<ROWS, PLATES_ALL> {
    let evidence = |frames| Evidence {
        frames,
        stride: sights.stride() as f64,
        asked: LOCAL_SURFACES,
        shape: LOCAL_SHAPE,
        known_of_form: SURFACE_SIGMA_M.powi(-2),
    };
    let along = truth.line.direction();
    let middle = truth.line.anchor() + along * sights.middle_m();
    let flat = |k: usize| {
        let normal = normals[k].into_inner();
        // Where the line is not as it was guessed, its plates are turned with it.
        let held = UnitVector3::try_new(normal - along * along.dot(&normal), 1e-6)?;
        Plate::flat(middle, &held, &along)
    };
    let (Some(first), Some(second)) = (flat(0), flat(1)) else { return evidence(Vec::new()) };
    let plates = [first, second];
    let shape = SheetShape::exact_about(sights.origin());
    let left = NoiseLeft::of(cell);
    let mut frames = Vec::with_capacity(sights.list.len());
    for (k, (sight, seen)) in sights.list.iter().zip(seen_by).enumerate() {
        if seen.stripes.iter().all(|share| *share == 0.0) {
            continue;
        }
        let Some(rows) = Rows::of(cell, (&plates, &shape), sight) else { continue };
        let of_shares = seen.stripes.iter().enumerate().filter(|(_, share)| **share > 0.0);
        frames.extend(of_shares.filter_map(|(which, share)| {
            let is_seen = [which != 1, which != 0];
            Some(FrameRows { sight: k, share: *share, ..rows.whitened(&left, is_seen)? })
        }));
    }
    evidence(frames)
}

/// The residuals of a frame as they are, in m.
struct Rows {
    columns: SMatrix<f64, ROWS, PLATES_ALL>,
    by_px: SMatrix<f64, ROWS, 2>,
    by_shift: SMatrix<f64, ROWS, 3>,
    by_turn: SMatrix<f64, ROWS, 3>,
    /// Own noise of each row, m.
    sigma_m: [f64; ROWS],
}

impl Rows {
    /// The stripes where the plates cut the sheet, in view or not; `None` where a plate lies along the sheet.
    fn of(cell: &Cell, (plates, shape): (&[Plate; 2], &SheetShape), sight: &Sight) -> Option<Self> {
        let camera_from_base = sight.placement.base_from_camera().rotation.inverse();
        let normals = plates.map(|plate| camera_from_base * plate.normal.into_inner());
        let mut rows = Self {
            columns: SMatrix::zeros(),
            by_px: SMatrix::zeros(),
            by_shift: SMatrix::zeros(),
            by_turn: SMatrix::zeros(),
            sigma_m: [NOT_THERE_M; ROWS],
        };
        for (number, ends) in ends(cell, &normals, &sight.point_in_camera).into_iter().enumerate() {
            let Stripe { places, noise } = stripe(cell, &ends?)?;
            let seen = StripeOnPlate { plate: &plates[number], sheet: &cell.sheet, shape: Some(shape) };
            for (k, place) in places.iter().enumerate() {
                let found = seen.linearize(&sight.placement, &cell.sheet.coordinates(place))?;
                let by_px = found.normal.transpose() * sheet_per_px(cell, place)?;
                let row = 2 * number + k;
                rows.set(row, number, &found, &sight.placement.base_from_tool.translation.vector);
                rows.by_px.set_row(row, &by_px);
                rows.sigma_m[row] = noise * feature_px(cell) * by_px.norm();
            }
        }
        Some(rows)
    }

    fn set(&mut self, row: usize, plate: usize, found: &StripeJacobian, tool_m: &Vector3<f64>) {
        let mut set = |first: usize, numbers: &[f64]| {
            numbers.iter().enumerate().for_each(|(k, number)| self.columns[(row, first + k)] = *number);
        };
        set(TIME_OFFSET, &[found.d_time_offset]);
        set(ROTATION, found.d_rotation.as_slice());
        set(TRANSLATION, found.d_translation.as_slice());
        set(PLANES + Plate::DIMENSION * plate, found.d_plate.as_slice());
        set(LOCAL_SURFACES + Plate::SURFACE * plate, found.d_surface.as_slice());
        set(LOCAL_SHAPE, found.d_shape.as_slice());
        let arm: Vector3<f64> = found.foot_in_base - tool_m;
        self.by_shift.set_row(row, &found.d_displacement.transpose());
        self.by_turn.set_row(row, &arm.cross(&found.d_displacement).transpose());
    }

    /// Whitened by Σ = D + σ_r² G Gᵀ + σ_ω² T Tᵀ + σ_t² ρ̇ ρ̇ᵀ, which all rows of a frame share; those of a plate that is not seen tell
    /// nothing.
    fn whitened(&self, left: &NoiseLeft, is_seen: [bool; 2]) -> Option<FrameRows<ROWS, PLATES_ALL>> {
        let rate = self.columns.column(TIME_OFFSET);
        let mut covariance = self.by_shift * self.by_shift.transpose() * left.levels.robot_sigma_m.powi(2)
            + self.by_turn * self.by_turn.transpose() * left.robot_rad.powi(2)
            + rate * rate.transpose() * left.levels.stamp_sigma_s.powi(2);
        for row in 0..ROWS {
            let own_m = if is_seen[row / 2] { self.sigma_m[row] } else { NOT_THERE_M };
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
        })
    }
}
