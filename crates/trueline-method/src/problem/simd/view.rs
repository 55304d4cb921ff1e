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

use super::bend::{Bowed, bend};
use super::distort::distort;
use super::lanes::{Lanes, Quaternions, Rotations, Vectors, WIDTH};
use super::located::Residual;
use super::samples::Samples;
use crate::problem::parameters::Parameters;
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use trueline_geometry::Line;
use trueline_model::{Curvature, LaserSheet, SheetShape};

/// Where the sheet is in the tool frame: what all samples share.
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
    /// How much later than the robot's the camera's stamps are, s.
    pub time_offset_s: f64,
}

impl Mounting {
    /// Of a sheet on a tool.
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

/// What four samples say about the line and the unknowns. What a scan does not model is zero, and costs nothing: what a
/// visitor does not use is not computed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Seen<const FUSED: bool> {
    /// Residual, m.
    pub residual: [Lanes<FUSED>; 2],
    /// b₁, b₂ in S.
    pub rows: [Vectors<FUSED>; 2],
    /// Lever a from the camera, in S, m.
    pub lever: Vectors<FUSED>,
    /// d r / d t_d, m/s.
    pub d_time_offset: [Lanes<FUSED>; 2],
    /// d r / d (θ₂, θ₃, δ₂, δ₃) of the line.
    pub line: [[Lanes<FUSED>; 2]; 4],
    /// d r / d (κ₂, κ₃) of its bow.
    pub bow: [[Lanes<FUSED>; 2]; 2],
    /// d r / d h of the sensor's shape.
    pub shape: [[Lanes<FUSED>; 2]; 5],
    /// Whether the line meets the sheet.
    pub usable: [bool; WIDTH],
}

/// How much is modelled, as a type, so that no loop asks.
pub(crate) trait Modelled {
    /// Whether lines bow.
    const BOWED: bool;
    /// Whether the sensor's sheet has a shape.
    const SHAPED: bool;
}

/// Straight lines, an exact sensor.
pub(crate) struct StraightLines;
/// Lines that may bow.
pub(crate) struct BowedLines;
/// The same, and a sensor whose sheet has a shape.
pub(crate) struct ShapedSheet;

impl Modelled for StraightLines {
    const BOWED: bool = false;
    const SHAPED: bool = false;
}

impl Modelled for BowedLines {
    const BOWED: bool = true;
    const SHAPED: bool = false;
}

impl Modelled for ShapedSheet {
    const BOWED: bool = true;
    const SHAPED: bool = true;
}

/// One line as the samples are held against it.
#[derive(Clone, Copy)]
pub(super) struct Seam<'a> {
    /// The straight part.
    pub line: &'a Line,
    /// Its bow, where that is modelled.
    pub bow: Option<&'a Curvature>,
    /// The sensor's shape, where that is modelled.
    pub shape: Option<&'a SheetShape>,
}

/// Everything four samples of a line have to say.
#[inline(always)]
pub(super) fn see<const FUSED: bool, R: Residual, M: Modelled>(
    mounting: &Mounting,
    seam: &Seam<'_>,
    s: &Samples,
) -> Seen<FUSED> {
    let line = seam.line;
    let elapsed = s.elapsed::<FUSED>(mounting.time_offset_s);
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

    let zero = Lanes::splat(0.0);
    let mut located = R::at(measured, anchor, axes);
    let mut bowed = Bowed::none();
    if let (true, Some(bow)) = (M::BOWED, seam.bow) {
        (located, bowed) = bend(located, measured, anchor, axes, bow);
    }
    let mut shape_columns = [[zero; 2]; 5];
    if let (true, Some(shape)) = (M::SHAPED, seam.shape) {
        shape_columns = distort(&mut located, measured, shape);
    }
    let rate_in_sheet = Rotations::splat(&mounting.sheet_from_tool).apply(rate);
    let shift = (located.at + from_tool).cross(rate_in_sheet) - sheet_from_base.apply(velocity);
    let rows = located.rows;
    let [[a2, a3], [b2, b3]] =
        [[rows[0].dot(axes[1]), rows[0].dot(axes[2])], [rows[1].dot(axes[1]), rows[1].dot(axes[2])]];
    let along = located.along;
    let mut turns = [[along * a3, along * b3], [-(along * a2), -(along * b2)]];
    let mut bow_columns = [[zero; 2]; 2];
    if M::BOWED {
        // u₂ × (α u₁ + φ (κ₂ u₂ + κ₃ u₃)) = −α u₃ + φ κ₃ u₁, and likewise for u₃; b·u₁ is no longer zero.
        let [a1, b1] = [rows[0].dot(axes[0]), rows[1].dot(axes[0])];
        let [offset_2, offset_3] = bowed.offset;
        turns[0] = [turns[0][0] - offset_3 * a1, turns[0][1] - offset_3 * b1];
        turns[1] = [turns[1][0] + offset_2 * a1, turns[1][1] + offset_2 * b1];
        let form = bowed.form;
        bow_columns = [[-(form * a2), -(form * b2)], [-(form * a3), -(form * b3)]];
    }
    Seen {
        residual: located.residual,
        rows,
        lever: located.at + from_camera,
        d_time_offset: [rows[0].dot(shift), rows[1].dot(shift)],
        line: [turns[0], turns[1], [-a2, -b2], [-a3, -b3]],
        bow: bow_columns,
        shape: shape_columns,
        usable: located.usable,
    }
}
