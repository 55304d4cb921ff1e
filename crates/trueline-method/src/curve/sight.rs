//! One reading as the sensor sees it: the residual in the sheet, and its derivatives by all unknowns.
//!
//! With f = R_BEᵀ(c(u) − p_BE) at the exposure and w(u) = R_ECᵀ(f − t) in the camera frame, u is where n·w(u) = d on the
//! sheet. The residual is Eᵀ(measured − w), with E the axes of the sheet. Eliminating du, every derivative of the prediction
//! is P times that of w, P = Eᵀ(I − τ nᵀ/(n·τ)), τ = w′(u):
//!
//! | unknown | ∂w |
//! |---|---|
//! | t_d | R_ECᵀ(ω × f + R_BEᵀ v) |
//! | φ (left, tool) | R_ECᵀ [f − t]× |
//! | t | −R_ECᵀ |
//! | a point c of the curve | R_ECᵀ R_BEᵀ |

use crate::curve::arrow::SHARED;
use crate::curve::motion::Moving;
use crate::curve::readings::{Reading, Readings};
use crate::curve::rows::{ROWS, Rows, Whitener};
use crate::curve::spline::{Basis, Spline};
use nalgebra::{Matrix3, Matrix3x2, SMatrix, Vector2, Vector3};
use trueline_dataset::Guess;
use trueline_geometry::{se3, so3};
use trueline_model::LaserSheet;

/// The crossing is undetermined if the curve runs along the sheet more than this (cosine to the sheet's normal).
const LEAST_CROSSING: f64 = 0.2;
/// Maximum number of Newton steps …
const STEPS: usize = 8;
/// … of at most this number of knots each …
const MOST_KNOTS: f64 = 2.0;
/// … until u moves by less, m.
const CONVERGED_M: f64 = 1e-9;

/// One reading against the target.
#[derive(Clone, Debug)]
pub(crate) struct Sight {
    /// Its place on the curve, u in m.
    pub u_m: f64,
    /// Number of its rows.
    pub rows: usize,
    /// Measured minus predicted in the sheet, m.
    pub residual: Rows,
    /// Derivatives of the prediction by t_d (s), φ (rad) and t (m).
    pub by_shared: SMatrix<f64, ROWS, SHARED>,
    /// Its derivative by a shift of the target in base.
    pub by_shift: SMatrix<f64, ROWS, 3>,
    /// Its derivative by a turn of the target about the origin of base, m/rad.
    pub by_turn: SMatrix<f64, ROWS, 3>,
    /// Its dependence on the form of the target.
    pub by_form: ByForm,
    /// Unit tangent of the curve in base.
    pub tangent: Vector3<f64>,
}

/// Dependence of a reading on the form of the target.
#[derive(Clone, Debug)]
pub(crate) enum ByForm {
    /// A seam point moves as the point of the curve with these weights of the control points.
    Point(Basis),
    /// Support points on plates, a row each.
    Feet(Box<[Foot; ROWS]>),
}

/// Dependence of a support point on the form of the target.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Foot {
    /// Weights of the control points of the seam at the foot.
    pub basis: Basis,
    /// Derivative of the prediction by the slope dc/du there, m.
    pub by_slope: Vector3<f64>,
    /// The plate: 0 or 1.
    pub plate: usize,
    /// Weights of the plate's angles there.
    pub angles: Basis,
    /// Derivative of the prediction by the plate's angle, m/rad.
    pub by_angle: f64,
    /// Unit normal of the stripe in the sheet.
    pub normal: Vector2<f64>,
}

impl Sight {
    /// The derivative by a turn of the target about a point of base (m), m/rad.
    #[must_use]
    pub(crate) fn turn_about(&self, point: &Vector3<f64>) -> SMatrix<f64, ROWS, 3> {
        self.by_turn + self.by_shift * so3::hat(point)
    }

    /// Residual of a seam point in the sheet, m; `None` for support points.
    #[must_use]
    pub(crate) fn of_point(&self) -> Option<Vector2<f64>> {
        matches!(self.by_form, ByForm::Point(_)).then(|| self.residual.xy())
    }

    /// Squared whitened residual for each two rows, so that one loss weighs readings of any number of rows.
    #[must_use]
    pub(crate) fn squared(&self, whitener: &Whitener) -> f64 {
        (whitener * self.residual).norm_squared() / self.pairs()
    }

    /// Half of the number of rows.
    #[must_use]
    pub(crate) fn pairs(&self) -> f64 {
        0.5 * self.rows as f64
    }
}

/// The hand-eye transform, prepared for all readings.
#[derive(Clone, Copy)]
pub(crate) struct HandEye {
    /// R_EC.
    pub rotation: Matrix3<f64>,
    /// t, m.
    pub translation: Vector3<f64>,
}

impl HandEye {
    /// From a state.
    #[must_use]
    pub(crate) fn of(at: &Guess) -> Self {
        Self {
            rotation: at.tool_from_camera.rotation.to_rotation_matrix().into_inner(),
            translation: at.tool_from_camera.translation.vector,
        }
    }

    /// A point of the camera frame in the tool, m.
    #[must_use]
    pub(crate) fn in_tool(&self, point: &Vector3<f64>) -> Vector3<f64> {
        self.rotation * point + self.translation
    }
}

/// A state moved by a step (t_d in s, φ in rad, t in m).
#[must_use]
pub(crate) fn moved(at: &Guess, step: &SMatrix<f64, SHARED, 1>) -> Guess {
    let (turn, shift) = (step.fixed_rows::<3>(1).into_owned(), step.fixed_rows::<3>(4).into_owned());
    Guess {
        time_offset_s: at.time_offset_s + step[0],
        tool_from_camera: se3::retract_decoupled(&at.tool_from_camera, &turn, &shift),
    }
}

/// The step from one state to another.
#[must_use]
pub(crate) fn step_between(from: &Guess, to: &Guess) -> SMatrix<f64, SHARED, 1> {
    let (turn, shift) = se3::difference_decoupled(&to.tool_from_camera, &from.tool_from_camera);
    let mut step = SMatrix::<f64, SHARED, 1>::zeros();
    step[0] = to.time_offset_s - from.time_offset_s;
    step.fixed_rows_mut::<3>(1).copy_from(&turn);
    step.fixed_rows_mut::<3>(4).copy_from(&shift);
    step
}

/// The curve in the camera frame at an exposure.
struct View<'a> {
    sheet: &'a LaserSheet,
    spline: &'a Spline,
    moving: &'a Moving,
    hand_eye: &'a HandEye,
    /// R_ECᵀ R_BEᵀ.
    camera_from_base: Matrix3<f64>,
}

impl View<'_> {
    /// w(u) and its derivative by u.
    fn curve(&self, basis: &Basis) -> (Vector3<f64>, Vector3<f64>) {
        let (point, tangent) = self.spline.at(basis);
        let back = self.hand_eye.rotation.tr_mul(&self.hand_eye.translation);
        let seen = self.camera_from_base * (point - self.moving.position) - back;
        (seen, self.camera_from_base * tangent)
    }

    /// u of the curve's crossing with the sheet, by Newton's method; `None` if it leaves the curve.
    fn crossing(&self, from_u_m: f64) -> Option<f64> {
        let (normal, offset_m) = (self.sheet.plane().normal(), self.sheet.plane().offset());
        let most_m = MOST_KNOTS * self.spline.spacing_m;
        let [from_m, to_m] = self.spline.ends_m(from_u_m);
        let mut u_m = from_u_m;
        for _ in 0..STEPS {
            let (point, tangent) = self.curve(&self.spline.basis(u_m));
            let along = normal.dot(&tangent);
            let step_m = (offset_m - normal.dot(&point)) / along;
            if !step_m.is_finite() {
                return None;
            }
            u_m += step_m.clamp(-most_m, most_m);
            if !self.spline.closed {
                // The last segment is extended by one knot.
                u_m = u_m.clamp(from_m - self.spline.spacing_m, to_m + self.spline.spacing_m);
            }
            if step_m.abs() < CONVERGED_M {
                let u_m = self.spline.wrapped(u_m);
                return self.spline.holds(u_m).then_some(u_m);
            }
        }
        None
    }
}

/// The robot at the exposure of a reading.
#[must_use]
pub(crate) fn moving(readings: &Readings, reading: &Reading, at: &Guess) -> Option<Moving> {
    readings.motion.at(reading.stamp_s - at.time_offset_s)
}

/// A reading against the curve, searched from `from_u_m`; `None` if the curve does not cross the sheet, or runs along it.
#[must_use]
pub(crate) fn sight(
    readings: &Readings,
    reading: &Reading,
    at: &Guess,
    spline: &Spline,
    from_u_m: f64,
) -> Option<Sight> {
    let moving = moving(readings, reading, at)?;
    let hand_eye = HandEye::of(at);
    let camera_from_base = hand_eye.rotation.tr_mul(&moving.attitude.transpose());
    let view =
        View { sheet: &readings.sheet, spline, moving: &moving, hand_eye: &hand_eye, camera_from_base };
    let u_m = view.crossing(from_u_m)?;
    let basis = spline.basis(u_m);
    let (seen, tangent) = view.curve(&basis);
    let (normal, axes) = (readings.sheet.plane().normal(), readings.sheet.axes());
    let along = normal.dot(&tangent);
    if along.abs() < LEAST_CROSSING * tangent.norm() {
        return None;
    }
    let across: Matrix3x2<f64> = axes - normal.into_inner() * (tangent.tr_mul(axes) / along);
    let projector = across.transpose();
    let by_point = projector * camera_from_base;
    let in_tool = hand_eye.rotation * seen;
    let in_flight =
        moving.body_rate.cross(&(in_tool + hand_eye.translation)) + moving.attitude.tr_mul(&moving.velocity);
    let back = projector * hand_eye.rotation.transpose();
    let mut by_shared = SMatrix::<f64, ROWS, SHARED>::zeros();
    by_shared.fixed_view_mut::<2, 1>(0, 0).copy_from(&(back * in_flight));
    by_shared.fixed_view_mut::<2, 3>(0, 1).copy_from(&(back * so3::hat(&in_tool)));
    by_shared.fixed_view_mut::<2, 3>(0, 4).copy_from(&-back);
    let mut by_shift = SMatrix::<f64, ROWS, 3>::zeros();
    by_shift.fixed_rows_mut::<2>(0).copy_from(&by_point);
    let (point, along) = spline.at(&basis);
    let residual = axes.tr_mul(&(reading.point - seen));
    Some(Sight {
        u_m,
        rows: 2,
        residual: Rows::new(residual.x, residual.y, 0.0, 0.0) - reading.off_m,
        by_shared,
        by_turn: by_shift * -so3::hat(&point),
        by_shift,
        by_form: ByForm::Point(basis),
        tangent: along.normalize(),
    })
}

/// A reading in base, m.
#[must_use]
pub(crate) fn in_base(readings: &Readings, reading: &Reading, at: &Guess) -> Option<Vector3<f64>> {
    let moving = moving(readings, reading, at)?;
    Some(moving.position + moving.attitude * HandEye::of(at).in_tool(&reading.point))
}
