//! Target of one joint: surfaces, and the line that is its seam.
//!
//! | joint | plates | edge | the seam |
//! |---|---|---|---|
//! | fillet, V, outside corner | two | none | where the plates meet |
//! | lap, step | two that are parallel | one | the edge, on the plate that bears it |
//! | butt | two in nearly one plane | one | the middle of the gap, at the mean height of both |
//! | edge of a plate, one plate of any joint | one | one | likewise |
//!
//! Parallel plates have no corner: across the seam only their edge is anything to be seen. An edge is a third surface, square to the
//! plate that bears it, and the measured point of the edge, or of the middle of a gap, is one support point of it: along the stripe it says where the edge
//! is, and across the stripe no more than the stripe itself, from whose light it is computed.

use nalgebra::UnitVector3;
use trueline_model::Plate;

/// Number of the edge among the surfaces of a joint; 0 and 1 are its plates.
pub const EDGE: usize = 2;

/// The surfaces of a joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Target {
    /// The plates; one that is not seen is held where it is, and has no information.
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
    /// Its carrier.
    pub on: Bearing,
}

/// The plate on which an edge lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bearing {
    /// The plate of this number.
    Plate(usize),
    /// Both, at their mean height: plates that end on either side of a gap.
    Both,
}

impl Target {
    /// Two plates that meet.
    #[must_use]
    pub fn meeting(plates: [Plate; 2]) -> Self {
        Self { plates, seen: [true; 2], edge: None }
    }

    /// The surfaces that meet in the seam, by number: those of the first side of it, which share it, and that of the second.
    #[must_use]
    pub(crate) fn at_seam(&self) -> ([Option<usize>; 2], usize) {
        match self.edge.map(|edge| edge.on) {
            Some(Bearing::Plate(number)) => ([Some(number), None], EDGE),
            Some(Bearing::Both) => ([Some(0), Some(1)], EDGE),
            None => ([Some(0), None], 1),
        }
    }

    /// The surface of a number.
    #[must_use]
    pub(crate) fn surface(&self, number: usize) -> Option<&Plate> {
        self.plates.get(number).or(self.edge.as_ref().map(|edge| &edge.surface))
    }

    /// The two surfaces that meet in the seam; of plates that share one side of it what they are in the mean, along the seam.
    #[must_use]
    pub(crate) fn pair_at_seam(&self) -> [Plate; 2] {
        match &self.edge {
            Some(Edge { surface, on: Bearing::Plate(number) }) => [self.plates[*number], *surface],
            Some(Edge { surface, on: Bearing::Both }) => [mean(&self.plates), *surface],
            None => self.plates,
        }
    }

    /// All surfaces, by number.
    pub fn surfaces(&self) -> impl Iterator<Item = (usize, &Plate)> {
        self.plates.iter().chain(self.edge.as_ref().map(|edge| &edge.surface)).enumerate()
    }

    /// The same with each surface moved by the value of its number.
    #[must_use]
    pub(crate) fn moved(&self, by: impl Fn(usize, &Plate) -> Plate) -> Self {
        Self {
            plates: [0, 1].map(|number| by(number, &self.plates[number])),
            edge: self.edge.map(|edge| Edge { surface: by(EDGE, &edge.surface), ..edge }),
            ..*self
        }
    }
}

/// The mean of two plates that lie in nearly one plane, whose numbers count from one place. Their normals may point to opposite sides.
fn mean([one, other]: &[Plate; 2]) -> Plate {
    let sign = one.normal.dot(&other.normal).signum();
    let mean = |a: f64, b: f64| 0.5 * (a + sign * b);
    let normal = one.normal.into_inner() + other.normal.into_inner() * sign;
    Plate {
        normal: UnitVector3::new_normalize(normal),
        offset_m: mean(one.offset_m, other.offset_m),
        surface_m: std::array::from_fn(|term| mean(one.surface_m[term], other.surface_m[term])),
        ..*one
    }
}
