//! The unknowns of the plates' problem, and their order in the tangent.
//!
//! | block | numbers | there is one |
//! |---|---|---|
//! | time offset (s), hand-eye rotation (rad) and translation (m) | 7 | as for lines |
//! | planes: tilt along, tilt outward (rad), offset (m), of plate 0, of plate 1 and of the edge | 6 or 9 | for each joint |
//! | surfaces: β₁ … β₇ (m) of plate 0, of plate 1 and of the edge | 14 or 21 | for each joint |
//! | shape h₁ … h₅ | 5 | unless the sensor is held |
//!
//! The first two are estimated without a prior. The others have one. If one joint has an edge, all joints have its numbers. The numbers of a missing
//! edge are held.

use crate::problem::layout::Layout;
use crate::problem::unknowns::LINES;
use crate::stripe::target::EDGE;
use std::ops::Range;
use trueline_model::{Plate, SheetShape};

/// First index of the planes.
pub const PLANES: usize = LINES;
/// First index of the plates' surfaces among the local unknowns of a frame.
pub const LOCAL_SURFACES: usize = PLANES + 2 * Plate::DIMENSION;
/// First index of the shape among the local unknowns.
pub const LOCAL_SHAPE: usize = LOCAL_SURFACES + 2 * Plate::SURFACE;
/// First index of the edge's plane among the local unknowns.
pub const LOCAL_EDGE: usize = LOCAL_SHAPE + SheetShape::DIMENSION;
/// First index of the edge's surface among the local unknowns.
const LOCAL_EDGE_SURFACE: usize = LOCAL_EDGE + Plate::DIMENSION;
/// Number of local unknowns.
pub const LOCAL_ALL: usize = LOCAL_EDGE_SURFACE + Plate::SURFACE;

/// Index of the offset among the numbers of a plane.
pub(crate) const OFFSET_OF_PLANE: usize = 2;

/// First local index of a surface's plane and of its surface terms.
#[must_use]
pub(crate) fn local_of_surface(number: usize) -> [usize; 2] {
    match number {
        EDGE => [LOCAL_EDGE, LOCAL_EDGE_SURFACE],
        plate => [PLANES + Plate::DIMENSION * plate, LOCAL_SURFACES + Plate::SURFACE * plate],
    }
}

/// The blocks of a problem.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StripeUnknowns {
    /// Joints.
    pub joints: usize,
    /// Whether one of them has an edge.
    pub edged: bool,
    /// Whether the sensor's shape is estimated.
    pub shaped: bool,
}

impl Layout for StripeUnknowns {
    fn count(&self) -> usize {
        self.local()
    }

    fn index(&self, local: usize, joint: usize) -> Option<usize> {
        self.place(local, joint)
    }
}

impl StripeUnknowns {
    /// Surfaces of a joint.
    #[must_use]
    pub(crate) fn surfaces(&self) -> usize {
        EDGE + usize::from(self.edged)
    }

    /// Numbers of their planes.
    #[must_use]
    pub(crate) fn planes_of_joint(&self) -> usize {
        Plate::DIMENSION * self.surfaces()
    }

    /// Unknowns without a prior.
    #[must_use]
    pub fn asked_for(&self) -> usize {
        PLANES + self.planes_of_joint() * self.joints
    }

    /// All of them.
    #[must_use]
    pub fn dimension(&self) -> usize {
        let shape = if self.shaped { SheetShape::DIMENSION } else { 0 };
        self.asked_for() + Plate::SURFACE * self.surfaces() * self.joints + shape
    }

    /// Unknowns with a prior.
    #[must_use]
    pub(crate) fn known_before(&self) -> Range<usize> {
        self.asked_for()..self.dimension()
    }

    /// Indices of the plane of a surface.
    #[must_use]
    pub fn plane(&self, joint: usize, number: usize) -> Range<usize> {
        let first = PLANES + self.planes_of_joint() * joint + Plate::DIMENSION * number;
        first..first + Plate::DIMENSION
    }

    /// Indices of its surface terms.
    #[must_use]
    pub fn surface(&self, joint: usize, number: usize) -> Range<usize> {
        let first = self.asked_for() + Plate::SURFACE * (self.surfaces() * joint + number);
        first..first + Plate::SURFACE
    }

    /// Indices of the shape. Empty if the sensor is held.
    #[must_use]
    pub fn shape(&self) -> Range<usize> {
        let first = self.asked_for() + Plate::SURFACE * self.surfaces() * self.joints;
        first..self.dimension()
    }

    /// Number of local unknowns in this problem.
    #[must_use]
    pub fn local(&self) -> usize {
        match (self.edged, self.shaped) {
            (true, _) => LOCAL_ALL,
            (false, true) => LOCAL_EDGE,
            (false, false) => LOCAL_SHAPE,
        }
    }

    /// Global index of a local unknown of a frame of `joint`. `None` if the sensor is held and has none.
    #[must_use]
    pub fn place(&self, local: usize, joint: usize) -> Option<usize> {
        match local {
            0..PLANES => Some(local),
            PLANES..LOCAL_SURFACES => Some(self.plane(joint, 0).start + local - PLANES),
            LOCAL_SURFACES..LOCAL_SHAPE => Some(self.surface(joint, 0).start + local - LOCAL_SURFACES),
            LOCAL_SHAPE..LOCAL_EDGE => self.shaped.then(|| self.shape().start + local - LOCAL_SHAPE),
            LOCAL_EDGE..LOCAL_EDGE_SURFACE => Some(self.plane(joint, EDGE).start + local - LOCAL_EDGE),
            _ => Some(self.surface(joint, EDGE).start + local - LOCAL_EDGE_SURFACE),
        }
    }
}
