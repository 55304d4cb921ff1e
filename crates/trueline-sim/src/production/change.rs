//! Changes of a production.

use nalgebra::{Matrix3, Vector2, Vector3};
use trueline_geometry::{Pose, se3};
use trueline_model::LaserSheet;

/// A change of one thing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Change {
    /// Images come later by this, s.
    Timing(f64),
    /// The sensor moves on the tool: turned about its own origin (rad, tool axes) and shifted (m).
    Bracket {
        /// Rotation vector, rad.
        rotation_rad: Vector3<f64>,
        /// Shift, m.
        translation_m: Vector3<f64>,
    },
    /// The sensor's sheet is stretched: h₁ … h₅ (h₄, h₅ per metre) lead from its report to the truth, about the middle
    /// of its field.
    Sensor([f64; 5]),
    /// The fixture moves: turned about the middle of the part (rad, base axes) and shifted (m).
    Seam {
        /// Rotation vector, rad.
        rotation_rad: Vector3<f64>,
        /// Shift, m.
        translation_m: Vector3<f64>,
    },
}

/// A change and when it happens.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScheduledChange {
    /// The change.
    pub change: Change,
    /// The first piece that is affected, from 0.
    pub piece: usize,
    /// Part of that piece's weld that is still as before, 0 to 1.
    pub after: f64,
}

impl ScheduledChange {
    /// The change at a moment of a piece, given as the part of its weld that is done.
    #[must_use]
    pub fn at(&self, piece: usize, done: f64) -> Option<&Change> {
        let happened = piece > self.piece || (piece == self.piece && done >= self.after);
        happened.then_some(&self.change)
    }
}

impl Change {
    /// How much later images come, s.
    #[must_use]
    pub fn late_s(&self) -> f64 {
        if let Self::Timing(late_s) = self { *late_s } else { 0.0 }
    }

    /// The hand-eye transform after the change.
    #[must_use]
    pub fn tool_from_camera(&self, before: &Pose) -> Pose {
        match self {
            Self::Bracket { rotation_rad, translation_m } => {
                se3::retract_decoupled(before, rotation_rad, translation_m)
            }
            _ => *before,
        }
    }

    /// Pose of the part in the fixture: rotation about its middle and shift.
    #[must_use]
    pub fn fixture(&self) -> (Vector3<f64>, Vector3<f64>) {
        match self {
            Self::Seam { rotation_rad, translation_m } => (*rotation_rad, *translation_m),
            _ => (Vector3::zeros(), Vector3::zeros()),
        }
    }

    /// The point that the sensor takes a true point of its sheet for, m in the camera frame.
    #[must_use]
    pub fn reported(&self, sheet: &LaserSheet, middle: &Vector3<f64>, point: &Vector3<f64>) -> Vector3<f64> {
        let Self::Sensor([h1, h2, h3, h4, h5]) = *self else { return *point };
        let true_from_reported = Matrix3::new(1.0 + h1, h3, 0.0, 0.0, 1.0 + h2, 0.0, h4, h5, 1.0);
        let Some(reported_from_true) = true_from_reported.try_inverse() else { return *point };
        let origin = sheet.coordinates(middle);
        let homogeneous = reported_from_true * (sheet.coordinates(point) - origin).push(1.0);
        sheet.point(&(origin + Vector2::new(homogeneous.x, homogeneous.y) / homogeneous.z))
    }
}
