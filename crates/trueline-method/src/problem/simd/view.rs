//! The measurement in the frame of the laser sheet, where it is shortest.
//!
//! Frame S: x and y the sheet's axes, z = x × y, origin the sheet's. A line with anchor c and axes u₁ u₂ u₃ seen from
//! there meets the sheet (z = 0) at q = c + α u₁ with α = −c_z / u₁_z. Both residuals are two rows b₁, b₂ of numbers per
//! displacement, and the point x at which displacements are taken:
//!
//! | | b₁, b₂ | x | residual |
//! |---|---|---|---|
//! | sheet | (1, 0, −u_x/u_z), (0, 1, −u_y/u_z) | q | s − q |
//! | point to line | u₂, u₃ | s | b·(s − c) |
//!
//! with s the measured point. Then the derivatives are, with a the lever from the camera and l that from the tool,
//! b·(l × ω − v) for the time offset, a × b for the rotation, b for the translation, and
//! (α b·u₃, −α b·u₂, −b·u₂, −b·u₃) for the line. The scalar form is `trueline_model::{sheet_residual, point_to_line}`.

use super::lanes::{Lanes, Quaternions, Rotations, Vectors, WIDTH};
use crate::problem::parameters::Parameters;
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use trueline_geometry::Line;
use trueline_model::LaserSheet;
use trueline_model::sheet_residual::MIN_SINE;

/// Where the sheet is in the tool frame: what all samples share.
#[derive(Clone, Copy, Debug)]
pub struct Mounting {
    /// `tool_from_sheet` rotation.
    pub tool_from_sheet: UnitQuaternion<f64>,
    /// Its inverse as a matrix.
    pub sheet_from_tool: Matrix3<f64>,
    /// `sheet_from_camera` rotation.
    pub sheet_from_camera: Matrix3<f64>,
    /// From the camera's origin to the sheet's, in S, m.
    pub from_camera: Vector3<f64>,
    /// From the tool's origin to the sheet's, in S, m.
    pub from_tool: Vector3<f64>,
}

impl Mounting {
    /// Of a sheet on a tool.
    pub fn new(sheet: &LaserSheet, at: &Parameters) -> Self {
        let (x, y) = (sheet.axes().column(0).into_owned(), sheet.axes().column(1).into_owned());
        let camera_from_sheet = Matrix3::from_columns(&[x, y, x.cross(&y)]);
        let rotation =
            UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(camera_from_sheet));
        let tool_from_sheet = at.tool_from_camera.rotation * rotation;
        let sheet_from_tool = tool_from_sheet.inverse().to_rotation_matrix().into_inner();
        let from_camera = camera_from_sheet.transpose() * sheet.origin();
        Self {
            tool_from_sheet,
            sheet_from_tool,
            sheet_from_camera: camera_from_sheet.transpose(),
            from_camera,
            from_tool: from_camera + sheet_from_tool * at.tool_from_camera.translation.vector,
        }
    }
}

/// Up to four measurements of one line, and the robot's motion about each.
#[derive(Clone, Copy, Debug)]
pub struct Samples {
    /// Index of each in the list.
    pub index: [u32; WIDTH],
    /// How many there are; the others repeat the first.
    pub count: usize,
    /// Time since the segment began, s.
    pub elapsed: [f64; WIDTH],
    /// `base_from_tool` at the segment's beginning, w x y z.
    pub rotation: [[f64; WIDTH]; 4],
    /// The same, m.
    pub position: [[f64; WIDTH]; 3],
    /// Body rate, rad/s.
    pub rate: [[f64; WIDTH]; 3],
    /// Velocity in base, m/s.
    pub velocity: [[f64; WIDTH]; 3],
    /// The point in the camera frame, m.
    pub point: [[f64; WIDTH]; 3],
}

/// What four samples say about the line and the unknowns.
#[derive(Clone, Copy, Debug)]
pub struct Seen<const FUSED: bool> {
    /// Residual, m.
    pub residual: [Lanes<FUSED>; 2],
    /// b₁, b₂ in S.
    pub rows: [Vectors<FUSED>; 2],
    /// Lever a from the camera, in S, m.
    pub lever: Vectors<FUSED>,
    /// d r / d t_d, m/s.
    pub d_time_offset: [Lanes<FUSED>; 2],
    /// b·u₂ and b·u₃ of each row.
    pub across: [[Lanes<FUSED>; 2]; 2],
    /// α: distance from the anchor along the line, m.
    pub along: Lanes<FUSED>,
    /// Whether the line meets the sheet.
    pub usable: [bool; WIDTH],
}

/// Which residual, as a type, so that no loop asks.
pub trait Residual {
    /// Rows, point x, residual and α of measured points and a line in S.
    fn at<const FUSED: bool>(
        measured: Vectors<FUSED>,
        anchor: Vectors<FUSED>,
        axes: [Vectors<FUSED>; 3],
    ) -> Located<FUSED>;
}

/// A residual with what its derivatives need.
#[derive(Clone, Copy, Debug)]
pub struct Located<const FUSED: bool> {
    rows: [Vectors<FUSED>; 2],
    at: Vectors<FUSED>,
    residual: [Lanes<FUSED>; 2],
    along: Lanes<FUSED>,
    usable: [bool; WIDTH],
}

/// Measured against predicted point in the sheet.
pub struct InSheet;

impl Residual for InSheet {
    #[inline(always)]
    fn at<const FUSED: bool>(
        measured: Vectors<FUSED>,
        anchor: Vectors<FUSED>,
        axes: [Vectors<FUSED>; 3],
    ) -> Located<FUSED> {
        let (zero, one) = (Lanes::splat(0.0), Lanes::splat(1.0));
        let u = axes[0].0;
        let mut usable = [true; WIDTH];
        let mut sine = u[2];
        if (sine * sine).min() < MIN_SINE * MIN_SINE {
            for lane in 0..WIDTH {
                usable[lane] = sine.0[lane].abs() >= MIN_SINE;
                // Where there is no intersection the numbers mean nothing, but they must be numbers.
                sine.0[lane] = if usable[lane] { sine.0[lane] } else { 1.0 };
            }
        }
        let inverse = one / sine;
        let along = (measured.0[2] - anchor.0[2]) * inverse;
        let at = anchor.plus_scaled(axes[0], along).0;
        Located {
            rows: [Vectors([one, zero, -(u[0] * inverse)]), Vectors([zero, one, -(u[1] * inverse)])],
            at: Vectors([at[0], at[1], measured.0[2]]),
            residual: [measured.0[0] - at[0], measured.0[1] - at[1]],
            along,
            usable,
        }
    }
}

/// Distance of the measured point from the line.
pub struct ToLine;

impl Residual for ToLine {
    #[inline(always)]
    fn at<const FUSED: bool>(
        measured: Vectors<FUSED>,
        anchor: Vectors<FUSED>,
        axes: [Vectors<FUSED>; 3],
    ) -> Located<FUSED> {
        let from_anchor = measured - anchor;
        Located {
            rows: [axes[1], axes[2]],
            at: measured,
            residual: [axes[1].dot(from_anchor), axes[2].dot(from_anchor)],
            along: axes[0].dot(from_anchor),
            usable: [true; WIDTH],
        }
    }
}

/// Everything four samples of a line have to say.
#[inline(always)]
pub fn see<const FUSED: bool, R: Residual>(mounting: &Mounting, line: &Line, s: &Samples) -> Seen<FUSED> {
    let elapsed = Lanes(s.elapsed);
    let rate = Vectors::from_components(&s.rate);
    let velocity = Vectors::from_components(&s.velocity);
    let half_elapsed = elapsed * Lanes::splat(0.5);
    let half = Vectors([rate.0[0] * half_elapsed, rate.0[1] * half_elapsed, rate.0[2] * half_elapsed]);
    let [w, x, y, z] = s.rotation;
    let start = Quaternions([Lanes(w), Lanes(x), Lanes(y), Lanes(z)]);
    let turned = start.times(&Quaternions::exp_of_half(half));
    let sheet_from_base = turned.times(&Quaternions::splat(&mounting.tool_from_sheet)).inverse_matrices();
    let tool = Vectors::from_components(&s.position).plus_scaled(velocity, elapsed);

    let from_tool = Vectors::splat(&mounting.from_tool);
    let from_camera = Vectors::splat(&mounting.from_camera);
    let anchor = sheet_from_base.apply(Vectors::splat(line.anchor()) - tool) - from_tool;
    let u = line.axes();
    let axes = [
        sheet_from_base.apply(Vectors::splat(&u.column(0).into_owned())),
        sheet_from_base.apply(Vectors::splat(&u.column(1).into_owned())),
        sheet_from_base.apply(Vectors::splat(&u.column(2).into_owned())),
    ];
    let measured =
        Rotations::splat(&mounting.sheet_from_camera).apply(Vectors::from_components(&s.point)) - from_camera;

    let located = R::at(measured, anchor, axes);
    let rate_in_sheet = Rotations::splat(&mounting.sheet_from_tool).apply(rate);
    let shift = (located.at + from_tool).cross(rate_in_sheet) - sheet_from_base.apply(velocity);
    Seen {
        residual: located.residual,
        rows: located.rows,
        lever: located.at + from_camera,
        d_time_offset: [located.rows[0].dot(shift), located.rows[1].dot(shift)],
        across: [
            [located.rows[0].dot(axes[1]), located.rows[0].dot(axes[2])],
            [located.rows[1].dot(axes[1]), located.rows[1].dot(axes[2])],
        ],
        along: located.along,
        usable: located.usable,
    }
}
