//! What a scan sees of one joint: surfaces, and the line that is its seam.
//!
//! | joint | plates | edge | the seam |
//! |---|---|---|---|
//! | fillet, V, outside corner | two | none | where the plates meet |
//! | lap, step | two that are parallel | one | the edge, on the plate that bears it |
//! | edge of a plate, one plate of any joint | one | one | likewise |
//!
//! Parallel plates have no corner: across the seam only their edge is anything to be seen. An edge is a third surface, square to the
//! plate that bears it, and the measured edge point is one support point of it: along the stripe it says where the edge
//! is, and across the stripe no more than the stripe itself, of whose light it was made.

use trueline_model::Plate;

/// Number of the edge among the surfaces of a joint; 0 and 1 are its plates.
pub const EDGE: usize = 2;

/// The surfaces of a joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Target {
    /// The plates; one that is not seen is held where it is, and says nothing.
    pub plates: [Plate; 2],
    /// Whether each is seen.
    pub seen: [bool; 2],
    /// The edge; `None` where the plates meet.
    pub edge: Option<Edge>,
}

/// An edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Edge {
    /// The surface square to the plate; how far it leans about the seam is held.
    pub surface: Plate,
    /// Number of the plate that bears it.
    pub on: usize,
}

impl Target {
    /// Two plates that meet.
    #[must_use]
    pub fn meeting(plates: [Plate; 2]) -> Self {
        Self { plates, seen: [true; 2], edge: None }
    }

    /// The two surfaces that meet in the seam, by number.
    #[must_use]
    pub(crate) fn at_seam(&self) -> [(usize, &Plate); 2] {
        match &self.edge {
            Some(edge) => [(edge.on, &self.plates[edge.on]), (EDGE, &edge.surface)],
            None => [(0, &self.plates[0]), (1, &self.plates[1])],
        }
    }

    /// All surfaces, by number.
    pub fn surfaces(&self) -> impl Iterator<Item = (usize, &Plate)> {
        self.plates.iter().chain(self.edge.as_ref().map(|edge| &edge.surface)).enumerate()
    }

    /// The same with each surface moved by what is said of its number.
    #[must_use]
    pub(crate) fn moved(&self, by: impl Fn(usize, &Plate) -> Plate) -> Self {
        Self {
            plates: [0, 1].map(|number| by(number, &self.plates[number])),
            edge: self.edge.map(|edge| Edge { surface: by(EDGE, &edge.surface), ..edge }),
            ..*self
        }
    }
}
