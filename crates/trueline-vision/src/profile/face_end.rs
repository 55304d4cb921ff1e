//! End of a face: its edge, along the face.
//!
//! The edge lies behind the last column on the face and before the next one off it, anywhere with the same chance. Three
//! things widen that:
//!
//! - A column without a return may be the first beyond the edge, or one of the face that was lost. If a share p of the columns is lost,
//!   k are with a chance of (1 − p) pᵏ: on average p/(1 − p) of them, with a variance of p/(1 − p)². Next to an edge more are lost than elsewhere: p is
//!   counted there, in neighbouring profiles together.
//! - A column that sees the edge itself may return anything. A single column steeply off the face, right behind it, is
//!   such a column: the edge is within its width. If more follow, it may be the plate's end face or the background as
//!   well, and the edge anywhere before its far side.
//! - Of a rounded edge the face bends away by and by. The edge is between the start of the deviation and the point at
//!   which it has grown by as much again.
//!
//! Perpendicular to the face the end lies on its last millimetres: the line through a whole bowed face misses its end by
//! the same amount in every profile.

use super::face::Face;
use nalgebra::Vector2;

/// Columns before the end among which lost ones are counted.
pub(super) const COUNTED_COLUMNS: usize = 4;

/// The end of a face.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct FaceEnd {
    /// The face at its end.
    pub(super) tip: Box<Face>,
    /// The last column's place on it, mm.
    pub(super) last: Vector2<f64>,
    /// Outward along it, per mm of x; of length 1 or more.
    pub(super) outward: Vector2<f64>,
    /// From where to where the edge may be, from the last column on, mm of x.
    pub(super) behind_mm: [f64; 2],
    /// Distance of columns, mm.
    pub(super) pitch_mm: f64,
    /// Whether a column right behind the end limits the position of the end.
    pub(super) is_bounded: bool,
    /// How many of the columns before the end are lost.
    pub(super) lost: usize,
    /// Part of the columns that is lost there.
    pub(super) lost_part: f64,
    /// Scatter of ends in this scan beyond the noise of their columns.
    pub(super) scatter: f64,
}

impl FaceEnd {
    /// An end in the middle of a stretch of a face's tip, and half of that.
    pub(super) fn within(tip: Face, [from_x, to_x]: [f64; 2]) -> Option<Self> {
        let (last, far) = (tip.at_x(from_x)?, tip.at_x(to_x)?);
        let width_mm = (to_x - from_x).abs();
        let outward = (far - last) / width_mm;
        let behind_mm = [0.0, width_mm];
        Some(Self {
            tip: Box::new(tip),
            last,
            outward,
            behind_mm,
            pitch_mm: width_mm,
            is_bounded: true,
            lost: 0,
            lost_part: 0.0,
            scatter: 1.0,
        })
    }

    /// Number of lost columns beside it, and number of all.
    pub(super) fn lost_of(&self) -> [usize; 2] {
        [self.lost, COUNTED_COLUMNS]
    }

    /// The last column on the face, mm.
    pub(super) fn last(&self) -> &Vector2<f64> {
        &self.last
    }

    /// How much the range grows outward along the face, per mm of x.
    pub(super) fn slope(&self) -> f64 {
        self.outward.y
    }

    /// Distance of columns beside it, mm.
    pub(super) fn pitch_mm(&self) -> f64 {
        self.pitch_mm
    }

    /// The middle between the columns that the edge is between, mm.
    pub(super) fn between(&self) -> Vector2<f64> {
        self.last + self.outward * (0.5 * (self.behind_mm[0] + self.behind_mm[1]))
    }

    /// Place of the edge, mm.
    pub(super) fn at(&self) -> Vector2<f64> {
        let lost = if self.is_bounded { 0.0 } else { self.lost_part / (1.0 - self.lost_part) };
        self.between() + self.outward * (self.pitch_mm * lost)
    }

    /// Its standard deviation along the face, mm.
    pub(super) fn sigma_mm(&self) -> f64 {
        let lost = if self.is_bounded { 0.0 } else { self.lost_part / (1.0 - self.lost_part).powi(2) };
        let [from_mm, to_mm] = self.behind_mm;
        let variance = (to_mm - from_mm).powi(2) / 12.0 + self.pitch_mm.powi(2) * lost;
        variance.sqrt() * self.outward.norm() * self.scatter
    }
}

/// Estimated share of lost columns: never 0 or 1 (Jeffreys' prior).
pub(super) fn lost_part([lost, of]: [usize; 2]) -> f64 {
    (lost as f64 + 0.5) / (of as f64 + 1.0)
}

/// To which side a face ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Outward {
    Left,
    Right,
}

impl Outward {
    pub(super) fn sign(self) -> f64 {
        match self {
            Self::Left => -1.0,
            Self::Right => 1.0,
        }
    }
}
