//! The rectangle of the laser sheet that a scan visited, and the rigid part of a sheet's correction over it.
//!
//! A sensor without a correction is best described by the rigid motion nearest to the correction. Points q of a grid over the field are moved by the
//! correction to c(q). Of all motions q ↦ R(α) q + s in the sheet, the least-squares one is
//!
//! ```text
//! α = atan2(Σ q̃ × c̃, Σ q̃ · c̃),  s = c̄ − R(α) q̄
//! ```
//!
//! with q̃, c̃ counted from the means q̄, c̄ (Procrustes in the plane). Its residue is the sensor's own
//! distortion.

use crate::sheet::LaserSheet;
use crate::sheet_shape::SheetShape;
use nalgebra::{Matrix2x5, Rotation2, SMatrix, Vector2, Vector3};
use trueline_geometry::{Pose, se3, so3};

/// Points of the grid along each axis.
const GRID: usize = 5;

/// A rectangle in the sheet's coordinates, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SheetField {
    /// Range along the stripe.
    pub width_m: [f64; 2],
    /// Range in depth.
    pub depth_m: [f64; 2],
}

/// The rigid motion in the sheet that is nearest to a correction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RigidPart {
    /// Rotation about the origin of the sheet's coordinates, from the first axis to the second, rad.
    pub turn_rad: f64,
    /// Shift after it, sheet coordinates, m.
    pub shift_m: [f64; 2],
}

/// A rigid part with its derivative by h₁ … h₅, and the rest of the correction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RigidPartOfShape {
    /// The motion.
    pub part: RigidPart,
    /// d (turn, shift) / d h.
    pub d_shape: SMatrix<f64, 3, 5>,
    /// RMS over the field of the distance between a corrected point and the rigidly moved one, m.
    pub remains_m: f64,
}

impl SheetField {
    /// Points of a regular grid over it, including its corners, sheet coordinates, m.
    pub fn grid(&self) -> impl Iterator<Item = Vector2<f64>> {
        let on = |[from, to]: [f64; 2], k: usize| from + (to - from) * k as f64 / (GRID - 1) as f64;
        let (width, depth) = (self.width_m, self.depth_m);
        (0..GRID * GRID).map(move |k| Vector2::new(on(width, k % GRID), on(depth, k / GRID)))
    }

    /// Width and depth, m.
    #[must_use]
    pub fn size_m(&self) -> [f64; 2] {
        [self.width_m, self.depth_m].map(|[from, to]| to - from)
    }

    /// The rigid part of a shape's correction over the field. `None` for a field of one point, or a shape that turns it inside out.
    #[must_use]
    pub fn rigid_part(&self, shape: &SheetShape) -> Option<RigidPartOfShape> {
        let points: Vec<(Vector2<f64>, Vector2<f64>, Matrix2x5<f64>)> = self
            .grid()
            .map(|at| Some((at, shape.corrected(&at).0, shape.d_corrected_d_shape(&at)?)))
            .collect::<Option<_>>()?;
        let count = points.len() as f64;
        let zero = (Vector2::zeros(), Vector2::zeros(), Matrix2x5::zeros());
        let sum =
            points.iter().fold(zero, |sum, (at, there, slope)| (sum.0 + at, sum.1 + there, sum.2 + slope));
        let (middle, middle_there, middle_slope) = (sum.0 / count, sum.1 / count, sum.2 / count);
        let (mut cross, mut dot) = (0.0, 0.0);
        let (mut d_cross, mut d_dot) = (SMatrix::<f64, 1, 5>::zeros(), SMatrix::<f64, 1, 5>::zeros());
        for (at, there, slope) in &points {
            let (from, to) = (at - middle, there - middle_there);
            cross += from.perp(&to);
            dot += from.dot(&to);
            d_cross += Vector2::new(-from.y, from.x).transpose() * slope;
            d_dot += from.transpose() * slope;
        }
        let square = cross * cross + dot * dot;
        if square == 0.0 {
            return None;
        }
        let turn = Rotation2::new(cross.atan2(dot));
        let d_turn = (d_cross * dot - d_dot * cross) / square;
        let turned = turn * middle;
        let shift = middle_there - turned;
        // d R(α) q̄ = (q̄ rotated by another right angle) dα
        let d_shift = middle_slope - Vector2::new(-turned.y, turned.x) * d_turn;
        let mut d_shape = SMatrix::<f64, 3, 5>::zeros();
        d_shape.fixed_rows_mut::<1>(0).copy_from(&d_turn);
        d_shape.fixed_rows_mut::<2>(1).copy_from(&d_shift);
        let part = RigidPart { turn_rad: turn.angle(), shift_m: shift.into() };
        let squares = points.iter().map(|(at, there, _)| (there - (turn * at + shift)).norm_squared());
        let remains_m = (squares.sum::<f64>() / count).sqrt();
        Some(RigidPartOfShape { part, d_shape, remains_m })
    }
}

impl RigidPart {
    /// The same motion in the camera frame: a rotation about the normal of the sheet.
    #[must_use]
    pub fn in_camera(&self, sheet: &LaserSheet) -> Pose {
        let rotation = so3::exp(&(normal(sheet) * self.turn_rad));
        let shift = sheet.axes() * Vector2::from(self.shift_m);
        se3::from_parts(rotation, sheet.origin() + shift - rotation * sheet.origin())
    }

    /// d (left rotation, translation) of [`RigidPart::in_camera`] / d (turn, shift).
    #[must_use]
    pub fn d_in_camera(&self, sheet: &LaserSheet) -> SMatrix<f64, 6, 3> {
        let normal = normal(sheet);
        let turned = so3::exp(&(normal * self.turn_rad)) * sheet.origin();
        let mut slope = SMatrix::<f64, 6, 3>::zeros();
        slope.fixed_view_mut::<3, 1>(0, 0).copy_from(&normal);
        slope.fixed_view_mut::<3, 1>(3, 0).copy_from(&-normal.cross(&turned));
        slope.fixed_view_mut::<3, 2>(3, 1).copy_from(sheet.axes());
        slope
    }
}

impl RigidPartOfShape {
    /// d (left rotation, translation) of the motion in the camera frame / d h.
    #[must_use]
    pub fn d_in_camera(&self, sheet: &LaserSheet) -> SMatrix<f64, 6, 5> {
        self.part.d_in_camera(sheet) * self.d_shape
    }
}

/// From the first axis of the sheet's coordinates to the second.
fn normal(sheet: &LaserSheet) -> Vector3<f64> {
    let axes = sheet.axes();
    axes.column(0).cross(&axes.column(1))
}
