//! Which unknowns the plates' problem has, and where they lie in the tangent.
//!
//! | block | numbers | there is one |
//! |---|---|---|
//! | time offset (s), hand-eye rotation (rad) and translation (m) | 7 | as for lines |
//! | planes: tilt along, tilt outward (rad), offset (m), of plate 0 and of plate 1 | 6 | for each joint |
//! | surfaces: β₁ … β₇ (m) of plate 0 and of plate 1 | 14 | for each joint |
//! | shape h₁ … h₅ | 5 | unless the sensor is held |
//!
//! The first two are asked for; of the others something is known beforehand.

use crate::problem::unknowns::LINES;
use std::ops::Range;
use trueline_model::{Plate, SheetShape};

/// First index of the planes.
pub const PLANES: usize = LINES;
/// Numbers of the two planes of a joint.
pub(crate) const PLANES_OF_JOINT: usize = 2 * Plate::DIMENSION;
/// Numbers of their surfaces.
pub(crate) const SURFACES_OF_JOINT: usize = 2 * Plate::SURFACE;
/// Where the surfaces begin among the unknowns that one frame depends on.
pub const LOCAL_SURFACES: usize = PLANES + PLANES_OF_JOINT;
/// Where the shape begins there.
pub const LOCAL_SHAPE: usize = LOCAL_SURFACES + SURFACES_OF_JOINT;
/// All that one frame can depend on.
pub const LOCAL_ALL: usize = LOCAL_SHAPE + SheetShape::DIMENSION;

/// The blocks of a problem.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StripeUnknowns {
    /// Joints of two plates.
    pub joints: usize,
    /// Whether the sensor's shape is estimated.
    pub shaped: bool,
}

impl StripeUnknowns {
    /// Those that are asked for.
    #[must_use]
    pub(crate) fn asked_for(&self) -> usize {
        PLANES + PLANES_OF_JOINT * self.joints
    }

    /// All of them.
    #[must_use]
    pub fn dimension(&self) -> usize {
        let shape = if self.shaped { SheetShape::DIMENSION } else { 0 };
        self.asked_for() + SURFACES_OF_JOINT * self.joints + shape
    }

    /// Those of which something is known beforehand.
    #[must_use]
    pub(crate) fn known_before(&self) -> Range<usize> {
        self.asked_for()..self.dimension()
    }

    /// Where the plane of a plate (0 or 1) lies.
    #[must_use]
    pub fn plane(&self, joint: usize, plate: usize) -> Range<usize> {
        let first = PLANES + PLANES_OF_JOINT * joint + Plate::DIMENSION * plate;
        first..first + Plate::DIMENSION
    }

    /// Where its surface lies.
    #[must_use]
    pub fn surface(&self, joint: usize, plate: usize) -> Range<usize> {
        let first = self.asked_for() + SURFACES_OF_JOINT * joint + Plate::SURFACE * plate;
        first..first + Plate::SURFACE
    }

    /// Where the shape lies; none of it where the sensor is held.
    #[must_use]
    pub fn shape(&self) -> Range<usize> {
        let first = self.asked_for() + SURFACES_OF_JOINT * self.joints;
        first..self.dimension()
    }

    /// Number of unknowns that one frame depends on.
    #[must_use]
    pub fn local(&self) -> usize {
        if self.shaped { LOCAL_ALL } else { LOCAL_SHAPE }
    }

    /// Index among all unknowns of one of those that a frame of `joint` depends on.
    #[must_use]
    pub fn place(&self, local: usize, joint: usize) -> usize {
        match local {
            0..PLANES => local,
            PLANES..LOCAL_SURFACES => self.plane(joint, 0).start + local - PLANES,
            LOCAL_SURFACES..LOCAL_SHAPE => self.surface(joint, 0).start + local - LOCAL_SURFACES,
            _ => self.shape().start + local - LOCAL_SHAPE,
        }
    }
}
