//! Target of one joint: surfaces, and the line that is its seam.
//!
//! | joint | plates | edge | the seam |
//! |---|---|---|---|
//! | fillet, V, outside corner | two | none | intersection of the plates |
//! | lap, step | two parallel | one | the edge, on the plate that bears it |
//! | butt | two in nearly one plane | one | the middle of the gap, at the mean height of both |
//! | edge of a plate, one plate of any joint | one | one | the edge, on that plate |
//!
//! Parallel plates have no corner: across the seam only their edge is visible. An edge is a third surface, perpendicular to the plate that bears it.
//! The measured point of the edge, or of the middle of a gap, is one support point of that surface. It locates the edge along the stripe. Across the
//! stripe it adds nothing, because it comes from the same light.

use nalgebra::UnitVector3;
use trueline_model::Plate;

/// Number of the edge among the surfaces of a joint; 0 and 1 are its plates.
pub const EDGE: usize = 2;

/// The surfaces of a joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Target {
    /// The plates. A plate that is not visible is held and has no information.
    pub plates: [Plate; 2],
    /// Whether each is visible.
    pub seen: [bool; 2],
    /// The edge; `None` where the plates meet.
    pub edge: Option<Edge>,
}

/// An edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Edge {
    /// The surface perpendicular to the plate. Its lean about the seam is held.
    pub surface: Plate,
    /// The plate or plates that bear it.
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

    /// The numbers of the surfaces that meet in the seam: one or two on the first side, and one on the second.
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

    /// The two surfaces that meet in the seam. Plates that share a side are averaged along the seam.
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

    /// The same with each surface mapped by its number.
    #[must_use]
    pub(crate) fn moved(&self, by: impl Fn(usize, &Plate) -> Plate) -> Self {
        Self {
            plates: [0, 1].map(|number| by(number, &self.plates[number])),
            edge: self.edge.map(|edge| Edge { surface: by(EDGE, &edge.surface), ..edge }),
            ..*self
        }
    }
}

/// The mean of two plates in nearly one plane, with a common origin. Their normals may point to opposite sides.
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
