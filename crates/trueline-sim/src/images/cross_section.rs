//! The plates cut square to the seam: a few straight pieces, which run on along the seam.

use nalgebra::Vector2;

/// A piece of a plate's surface in the cross-section. Coordinates in m: x across the seam, y away from the
/// sensor; the seam is the origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Facet {
    /// Its start.
    pub from: Vector2<f64>,
    /// Its end.
    pub to: Vector2<f64>,
    /// How much light it scatters, relative to the brightest.
    pub reflectance: f64,
}

impl Facet {
    /// Unit normal in the cross-section.
    #[must_use]
    pub fn normal(&self) -> Vector2<f64> {
        let along = self.to - self.from;
        Vector2::new(-along.y, along.x).normalize()
    }
}

/// Crossing of a ray in the cross-section with a facet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Hit {
    /// The facet.
    pub facet: usize,
    /// How far along the ray, in lengths of its direction.
    pub distance: f64,
}

/// The first facet that a ray from `origin` meets further than `beyond` along it.
#[must_use]
pub(crate) fn first_hit(
    facets: &[Facet],
    origin: &Vector2<f64>,
    direction: &Vector2<f64>,
    beyond: f64,
) -> Option<Hit> {
    let mut first: Option<Hit> = None;
    for (facet, piece) in facets.iter().enumerate() {
        let along = piece.to - piece.from;
        let across = direction.perp(&along);
        let to_start = piece.from - origin;
        let distance = to_start.perp(&along) / across;
        let part = to_start.perp(direction) / across;
        let met = distance > beyond && (0.0..=1.0).contains(&part);
        if met && first.is_none_or(|hit| distance < hit.distance) {
            first = Some(Hit { facet, distance });
        }
    }
    first
}
