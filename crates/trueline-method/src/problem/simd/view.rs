//! The measurement in the frame of the laser sheet, where the formulas are shortest.
//!
//! Frame S: x and y are the sheet's axes, z = x × y, and the origin is the sheet's. In S a line with anchor c and axes u₁ u₂ u₃ meets the sheet (z =
//! 0) at q = c + α u₁ with α = −c_z / u₁_z. Both residuals have two rows b₁, b₂ of derivatives by a displacement, and a point x at which
//! displacements are taken:
//!
//! | | b₁, b₂ | x | residual |
//! |---|---|---|---|
//! | sheet | (1, 0, −u_x/u_z), (0, 1, −u_y/u_z) | q | s − q |
//! | point to line | u₂, u₃ | s | b·(s − c) |
//!
//! with s the measured point. With a the lever from the camera and l that from the tool, the derivatives are b·(l × ω − v) for the time offset, a ×
//! b for the rotation, b for the translation, and (α b·u₃, −α b·u₂, −b·u₂, −b·u₃) for the line. The scalar form is `trueline_model::{sheet_residual,
//! point_to_line}`.

use super::bend::{Bowed, bend};
use super::displacement_rows::{DisplacementRows, FullRows, InSheetRows, WhitenedRows};
use super::distort::distort;
use super::lanes::{Lanes, Quaternions, Rotations, Vectors, WIDTH};
use super::located::{Located, beside_line, in_sheet};
use super::samples::Samples;
use crate::problem::parameters::Parameters;
use crate::problem::unknowns::LOCAL_ALL;
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector2, Vector3};
use trueline_geometry::Line;
use trueline_model::{Curvature, LaserSheet, SheetShape};

/// Pose of the sheet in the tool frame, shared by all samples.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Mounting {
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
    /// Image stamps minus robot stamps, s.
    pub time_offset_s: f64,
}

impl Mounting {
    /// For a sheet on a tool.
    pub(crate) fn new(sheet: &LaserSheet, at: &Parameters) -> Self {
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
            time_offset_s: at.time_offset_s,
        }
    }
}

/// Derivatives of four samples by the line and the unknowns. `B` are the residual's rows. Unmodelled parts are zero, and unused parts are not
/// computed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Seen<const FUSED: bool, B> {
    /// Residual, m.
    pub residual: [Lanes<FUSED>; 2],
    /// b₁, b₂ in S.
    pub rows: B,
    /// Whether the line meets the sheet.
    pub usable: [bool; WIDTH],
    /// Lever a from the camera, in S, m.
    lever: Vectors<FUSED>,
    /// l × ω − v, in S, m/s.
    shift: Vectors<FUSED>,
    /// Axes of the line in S.
    axes: [Vectors<FUSED>; 3],
    /// α, m.
    along: Lanes<FUSED>,
    bowed: Bowed<FUSED>,
    /// d r / d h of the sensor's shape.
    by_shape: ShapeColumns<FUSED>,
}

/// d r / d h of the sensor's shape.
type ShapeColumns<const FUSED: bool> = [[Lanes<FUSED>; 2]; SheetShape::DIMENSION];

impl<const FUSED: bool, B: DisplacementRows<FUSED>> Seen<FUSED, B> {
    /// d r / d t_d, m/s.
    #[inline(always)]
    pub(super) fn by_time_offset(&self) -> [Lanes<FUSED>; 2] {
        self.rows.of(self.shift)
    }

    /// The whitened Jacobian, column by column, in the order of [`Unknowns`](crate::problem::unknowns::Unknowns).
    #[inline(always)]
    pub(super) fn columns<M: Modelled>(&self, w: &[Lanes<FUSED>; 3]) -> [[Lanes<FUSED>; 2]; LOCAL_ALL] {
        let rows = self.rows.whitened(w);
        let [turn_x, turn_y, turn_z] = rows.about_axes(self.lever);
        let [shift_x, shift_y, shift_z] = rows.along_axes();
        let [a2, b2] = rows.of(self.axes[1]);
        let [a3, b3] = rows.of(self.axes[2]);
        let along = self.along;
        let mut line_turns = [[along * a3, along * b3], [-(along * a2), -(along * b2)]];
        let zero = Lanes::splat(0.0);
        let (mut bow, mut shape) = ([[zero; 2]; 2], [[zero; 2]; SheetShape::DIMENSION]);
        if M::BOWED {
            // u₂ × (α u₁ + φ (κ₂ u₂ + κ₃ u₃)) = −α u₃ + φ κ₃ u₁, and likewise for u₃. b·u₁ is not zero here.
            let [a1, b1] = rows.of(self.axes[0]);
            let Bowed { form, offset: [offset_2, offset_3] } = self.bowed;
            line_turns[0] = [line_turns[0][0] - offset_3 * a1, line_turns[0][1] - offset_3 * b1];
            line_turns[1] = [line_turns[1][0] + offset_2 * a1, line_turns[1][1] + offset_2 * b1];
            bow = [[-(form * a2), -(form * b2)], [-(form * a3), -(form * b3)]];
        }
        if M::SHAPED {
            for k in 0..SheetShape::DIMENSION {
                shape[k] = whiten(w, self.by_shape[k]);
            }
        }
        [
            rows.of(self.shift),
            turn_x,
            turn_y,
            turn_z,
            shift_x,
            shift_y,
            shift_z,
            line_turns[0],
            line_turns[1],
            [-a2, -b2],
            [-a3, -b3],
            bow[0],
            bow[1],
            shape[0],
            shape[1],
            shape[2],
            shape[3],
            shape[4],
        ]
    }
}

/// W times a column of two rows.
#[inline(always)]
pub(super) fn whiten<const FUSED: bool>(
    w: &[Lanes<FUSED>; 3],
    column: [Lanes<FUSED>; 2],
) -> [Lanes<FUSED>; 2] {
    [w[0] * column[0], (w[1] * column[0]).plus_product(w[2], column[1])]
}

/// The model, as a type, so that the loops have no branches.
pub(crate) trait Modelled {
    /// Rows of its residual.
    type Rows<const FUSED: bool>: DisplacementRows<FUSED>;
    /// Whether lines bow.
    const BOWED: bool;
    /// Whether the sensor's sheet has a shape.
    const SHAPED: bool;

    /// Intersections of four lines with their laser planes, and the residuals.
    fn located<const FUSED: bool>(
        measured: Vectors<FUSED>,
        anchor: Vectors<FUSED>,
        axes: [Vectors<FUSED>; 3],
        seam: &Seam<'_>,
    ) -> Modelling<FUSED, Self::Rows<FUSED>>;
}

/// Intersections with their bows and the effect of the sensor's shape.
pub(crate) struct Modelling<const FUSED: bool, B> {
    located: Located<FUSED, B>,
    bowed: Bowed<FUSED>,
    by_shape: ShapeColumns<FUSED>,
}

impl<const FUSED: bool, B> Modelling<FUSED, B> {
    #[inline(always)]
    fn straight(located: Located<FUSED, B>) -> Self {
        Self { located, bowed: Bowed::none(), by_shape: [[Lanes::splat(0.0); 2]; SheetShape::DIMENSION] }
    }
}

/// Straight lines, an exact sensor.
pub(crate) struct StraightLines;
/// Lines that may bow.
pub(crate) struct BowedLines;
/// Lines that may bow, and a sensor whose sheet has a shape.
pub(crate) struct ShapedSheet;
/// Straight lines and the distance of the measured point from them.
pub(crate) struct DistanceFromLines;

impl Modelled for StraightLines {
    type Rows<const FUSED: bool> = InSheetRows<FUSED>;
    const BOWED: bool = false;
    const SHAPED: bool = false;

    #[inline(always)]
    fn located<const FUSED: bool>(
        measured: Vectors<FUSED>,
        anchor: Vectors<FUSED>,
        axes: [Vectors<FUSED>; 3],
        _seam: &Seam<'_>,
    ) -> Modelling<FUSED, InSheetRows<FUSED>> {
        Modelling::straight(in_sheet(measured, anchor, axes))
    }
}

impl Modelled for BowedLines {
    type Rows<const FUSED: bool> = InSheetRows<FUSED>;
    const BOWED: bool = true;
    const SHAPED: bool = false;

    #[inline(always)]
    fn located<const FUSED: bool>(
        measured: Vectors<FUSED>,
        anchor: Vectors<FUSED>,
        axes: [Vectors<FUSED>; 3],
        seam: &Seam<'_>,
    ) -> Modelling<FUSED, InSheetRows<FUSED>> {
        let straight = Modelling::straight(in_sheet(measured, anchor, axes));
        let Some(bow) = seam.bow else { return straight };
        let (located, bowed) = bend(straight.located, measured, anchor, axes, bow);
        Modelling { located, bowed, ..straight }
    }
}

impl Modelled for ShapedSheet {
    type Rows<const FUSED: bool> = FullRows<FUSED>;
    const BOWED: bool = true;
    const SHAPED: bool = true;

    #[inline(always)]
    fn located<const FUSED: bool>(
        measured: Vectors<FUSED>,
        anchor: Vectors<FUSED>,
        axes: [Vectors<FUSED>; 3],
        seam: &Seam<'_>,
    ) -> Modelling<FUSED, FullRows<FUSED>> {
        let Modelling { located, bowed, .. } = BowedLines::located(measured, anchor, axes, seam);
        let exact = SheetShape::exact_about(&Vector2::zeros());
        let (located, by_shape) = distort(located, measured, seam.shape.unwrap_or(&exact));
        Modelling { located, bowed, by_shape }
    }
}

impl Modelled for DistanceFromLines {
    type Rows<const FUSED: bool> = FullRows<FUSED>;
    const BOWED: bool = false;
    const SHAPED: bool = false;

    #[inline(always)]
    fn located<const FUSED: bool>(
        measured: Vectors<FUSED>,
        anchor: Vectors<FUSED>,
        axes: [Vectors<FUSED>; 3],
        _seam: &Seam<'_>,
    ) -> Modelling<FUSED, FullRows<FUSED>> {
        Modelling::straight(beside_line(measured, anchor, axes))
    }
}

/// One line with its models.
#[derive(Clone, Copy)]
pub(crate) struct Seam<'a> {
    /// The straight part.
    pub line: &'a Line,
    /// Its bow, if modelled.
    pub bow: Option<&'a Curvature>,
    /// The sensor's shape, if modelled.
    pub shape: Option<&'a SheetShape>,
}

/// All quantities of four samples of a line.
#[inline(always)]
pub(super) fn see<const FUSED: bool, M: Modelled>(
    mounting: &Mounting,
    seam: &Seam<'_>,
    s: &Samples,
) -> Seen<FUSED, M::Rows<FUSED>> {
    let line = seam.line;
    let elapsed = s.elapsed::<FUSED>(mounting.time_offset_s);
    let rate = Vectors::from_components(&s.rate);
    let velocity = Vectors::from_components(&s.velocity);
    let half_elapsed = elapsed * Lanes::splat(0.5);
    let half = rate.scaled(half_elapsed);
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
    let Modelling { located, bowed, by_shape } = M::located(measured, anchor, axes, seam);
    let rate_in_sheet = Rotations::splat(&mounting.sheet_from_tool).apply(rate);
    let shift = (located.at + from_tool).cross(rate_in_sheet) - sheet_from_base.apply(velocity);
    Seen {
        residual: located.residual,
        rows: located.rows,
        usable: located.usable,
        lever: located.at + from_camera,
        shift,
        axes,
        along: located.along,
        bowed,
        by_shape,
    }
}
