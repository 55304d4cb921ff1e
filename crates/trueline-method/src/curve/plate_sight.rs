//! The support points of a frame against the plates beside the seam.
//!
//! X is a support point in base, u its foot on the seam, c′·x = 0 with x = X − c(u). With φ of the plate there, g its gradient along the sheet and
//! D = |c′|² − c″·x, the residual is φ/|g|, and
//!
//! ```text
//! ∇φ = n + τ c′/D,  τ = (dn/du)·x
//! ∂φ = −∇φ·∂c + (τ/D) x·∂c′ − r (∂ψ + ∂α),  r = d·x
//! ```
//!
//! with ∂α the turn of e₁ about the seam by ∂c′.

use crate::curve::arrow::{CUBIC, SHARED};
use crate::curve::motion::Moving;
use crate::curve::plates::Plates;
use crate::curve::readings::{Reading, Readings, SupportPoint};
use crate::curve::rows::{ROWS, Rows};
use crate::curve::sight::{ByForm, Foot, HandEye, Sight, moving};
use crate::curve::spline::{Basis, Spline};
use nalgebra::{Matrix3, Matrix3x2, SMatrix, Vector3};
use trueline_dataset::Guess;
use trueline_geometry::so3;

/// A plate nearer to the sheet than this (sine of the angle) has no usable stripe.
const LEAST_SINE: f64 = 0.1;
/// Nearer to the centre of curvature of the seam than this fraction of its radius a point has no clear foot.
const LEAST_SPREAD: f64 = 0.4;
/// Maximum number of Newton steps to the foot …
const STEPS: usize = 12;
/// … of at most this number of knots each …
const MOST_KNOTS: f64 = 1.0;
/// … until u moves by less, m.
const CONVERGED_M: f64 = 1e-9;

/// The seam at the foot of a point.
struct OnSeam {
    u_m: f64,
    basis: Basis,
    slope: Vector3<f64>,
    second: Vector3<f64>,
    /// From the foot to the point, m.
    from: Vector3<f64>,
    /// D.
    spread: f64,
}

/// Foot of a point of base on the seam, from `from_u_m`. `None` beyond its ends, and near a centre of its curvature.
fn on_seam(spline: &Spline, point: &Vector3<f64>, from_u_m: f64) -> Option<OnSeam> {
    let most_m = MOST_KNOTS * spline.spacing_m;
    let at = |u_m: f64| {
        let basis = spline.basis(u_m);
        let (place, slope) = spline.at(&basis);
        let (from, second) = (point - place, spline.second(&basis, u_m));
        let spread = slope.norm_squared() - second.dot(&from);
        OnSeam { u_m, basis, slope, second, from, spread }
    };
    let mut u_m = from_u_m;
    for _ in 0..STEPS {
        let here = at(u_m);
        // Far from the foot the curve counts as straight.
        let spread = here.spread.max(LEAST_SPREAD * here.slope.norm_squared());
        let step_m = here.slope.dot(&here.from) / spread;
        u_m = spline.wrapped(u_m + step_m.clamp(-most_m, most_m));
        if step_m.abs() < CONVERGED_M {
            let foot = at(u_m);
            let is_clear = foot.spread > LEAST_SPREAD * foot.slope.norm_squared();
            return (is_clear && spline.holds(u_m)).then_some(foot);
        }
        if !step_m.is_finite() {
            return None;
        }
    }
    None
}

/// The sensor at an exposure.
struct View<'a> {
    moving: &'a Moving,
    hand_eye: &'a HandEye,
    /// Axes of the sheet in base.
    axes: Matrix3x2<f64>,
}

/// One row of a frame.
struct Row {
    u_m: f64,
    residual_m: f64,
    by_shared: [f64; SHARED],
    by_shift: Vector3<f64>,
    by_turn: Vector3<f64>,
    foot: Foot,
    tangent: Vector3<f64>,
}

impl View<'_> {
    fn row(
        &self,
        support: &SupportPoint,
        plate: usize,
        (plates, spline, from_u_m): (&Plates, &Spline, f64),
    ) -> Option<Row> {
        let in_tool = self.hand_eye.in_tool(&support.point);
        let point = self.moving.position + self.moving.attitude * in_tool;
        let OnSeam { u_m, basis, slope, second, from, spread } = on_seam(spline, &point, from_u_m)?;
        let across = plates.across((spline, &basis), u_m, (&slope, &second), plate);
        let reach_m = across.outward.dot(&from);
        let turning = -across.twist * reach_m;
        let gradient = across.normal + slope * (turning / spread);
        let in_sheet = self.axes.tr_mul(&gradient);
        let steepness = in_sheet.norm();
        if steepness < LEAST_SINE || reach_m <= 0.0 {
            return None;
        }
        let by_shift = gradient / steepness;
        let by_slope = (from * (turning / spread) + across.by_slope * reach_m) / -steepness;
        let back = self.moving.attitude.tr_mul(&by_shift);
        let in_flight = by_shift
            .dot(&(self.moving.attitude * self.moving.body_rate.cross(&in_tool) + self.moving.velocity));
        let by_rotation = back.tr_mul(&so3::hat(&(in_tool - self.hand_eye.translation)));
        let mut by_shared = [0.0; SHARED];
        by_shared[0] = in_flight;
        for axis in 0..3 {
            by_shared[1 + axis] = by_rotation[axis];
            by_shared[4 + axis] = -back[axis];
        }
        Some(Row {
            u_m,
            residual_m: across.normal.dot(&from) / steepness,
            by_shared,
            by_shift,
            by_turn: point.cross(&by_shift),
            foot: Foot {
                basis,
                by_slope,
                plate,
                angles: across.angles,
                by_angle: reach_m / steepness,
                normal: in_sheet / steepness,
            },
            tangent: slope.normalize(),
        })
    }
}

/// The support points of a reading against the plates, searched from `from_u_m`. `None` where a plate runs along the sheet, beyond the ends of the
/// seam, or near a centre of its curvature.
#[must_use]
pub(crate) fn plate_sight(
    (readings, reading, supports): (&Readings, &Reading, &[SupportPoint; ROWS]),
    at: &Guess,
    (plates, spline): (&Plates, &Spline),
    from_u_m: f64,
) -> Option<Sight> {
    let moving = moving(readings, reading, at)?;
    let hand_eye = HandEye::of(at);
    let base_from_camera: Matrix3<f64> = moving.attitude * hand_eye.rotation;
    let axes = base_from_camera * readings.sheet.axes();
    let view = View { moving: &moving, hand_eye: &hand_eye, axes };
    let row = |k: usize| view.row(&supports[k], k / 2, (plates, spline, from_u_m));
    let rows: [Row; ROWS] = [row(0)?, row(1)?, row(2)?, row(3)?];
    let mut sight = Sight {
        u_m: from_u_m,
        rows: ROWS,
        residual: Rows::zeros(),
        by_shared: SMatrix::zeros(),
        by_shift: SMatrix::zeros(),
        by_turn: SMatrix::zeros(),
        by_form: ByForm::Feet(Box::new(rows.each_ref().map(|row| row.foot))),
        tangent: rows[0].tangent,
    };
    for (k, row) in rows.iter().enumerate() {
        sight.residual[k] = row.residual_m - reading.off_m[k];
        sight.by_shift.set_row(k, &row.by_shift.transpose());
        sight.by_turn.set_row(k, &row.by_turn.transpose());
        for (shared, by) in row.by_shared.iter().enumerate() {
            sight.by_shared[(k, shared)] = *by;
        }
    }
    sight.u_m = middle_m(&rows.each_ref().map(|row| row.u_m), spline);
    (reach(&sight, spline)? <= plates.reach).then_some(sight)
}

/// Number of neighbouring control points on which the feet of a sight depend; `None` for a seam point.
#[must_use]
pub(crate) fn reach(seen: &Sight, spline: &Spline) -> Option<usize> {
    let ByForm::Feet(feet) = &seen.by_form else { return None };
    let (count, firsts) = (spline.control.len(), feet.each_ref().map(|foot| foot.basis.first));
    let ahead = |k: usize, other: &usize| (other + count - k) % count;
    let ahead_of = |k: usize| firsts.iter().map(move |other| ahead(k, other)).max();
    let is_first = |k: &&usize| spline.closed || firsts.iter().all(|other| *k <= other);
    Some(firsts.iter().filter(is_first).filter_map(|k| ahead_of(*k)).min()? + CUBIC)
}

/// The middle of places on the seam, m.
fn middle_m(places_m: &[f64; ROWS], spline: &Spline) -> f64 {
    let [first_m, ..] = *places_m;
    let span_m = spline.span_m();
    let near = |u_m: &f64| {
        let off_m = u_m - first_m;
        if spline.closed { off_m - (off_m / span_m).round() * span_m } else { off_m }
    };
    spline.wrapped(first_m + places_m.iter().map(near).sum::<f64>() / ROWS as f64)
}
