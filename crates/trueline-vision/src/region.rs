//! The search region of the picture.

use nalgebra::Vector2;

/// A polygon in distorted pixels, its border included.
#[derive(Clone, Debug, PartialEq)]
pub struct PictureRegion {
    corners: Vec<Vector2<f64>>,
}

impl PictureRegion {
    /// A polygon through corners, px. `None` with fewer than three of them, or with NaN.
    #[must_use]
    pub fn polygon(corners: &[[f64; 2]]) -> Option<Self> {
        let finite = corners.iter().flatten().all(|x| x.is_finite());
        (corners.len() >= 3 && finite)
            .then(|| Self { corners: corners.iter().map(|corner| Vector2::from(*corner)).collect() })
    }

    /// Columns and rows between two of each, px. `None` if they do not rise.
    #[must_use]
    pub fn rectangle([u0, u1]: [f64; 2], [v0, v1]: [f64; 2]) -> Option<Self> {
        let rising = u0 < u1 && v0 < v1;
        rising.then(|| Self::polygon(&[[u0, v0], [u1, v0], [u1, v1], [u0, v1]])).flatten()
    }

    /// Its corners, px.
    #[must_use]
    pub fn corners(&self) -> &[Vector2<f64>] {
        &self.corners
    }

    /// The same region in a picture with `factor` × `factor` pixels made one.
    #[must_use]
    pub(crate) fn binned(&self, factor: usize) -> Option<Self> {
        let k = factor as f64;
        let corners: Vec<[f64; 2]> =
            self.corners.iter().map(|corner| (corner.add_scalar(-0.5 * (k - 1.0)) / k).into()).collect();
        Self::polygon(&corners)
    }

    /// Whether any of it may lie in pictures of a size, px.
    #[must_use]
    pub fn overlaps(&self, size: [u32; 2]) -> bool {
        (0..2).all(|axis| {
            let mut places = self.corners.iter().map(|corner| corner[axis]);
            places.clone().any(|x| x > 0.0) && places.any(|x| x < f64::from(size[axis]))
        })
    }

    /// Whether a pixel lies in it: a ray to the right of it crosses the border an odd number of times.
    #[must_use]
    pub fn contains(&self, u: f64, v: f64) -> bool {
        let mut inside = false;
        let mut before = self.corners[self.corners.len() - 1];
        for corner in &self.corners {
            if (corner.y > v) != (before.y > v) {
                let crossing = before.x + (v - before.y) * (corner.x - before.x) / (corner.y - before.y);
                inside ^= u < crossing;
            }
            before = *corner;
        }
        inside
    }
}

#[cfg(test)]
mod tests {
    use super::PictureRegion;

    #[test]
    fn a_polygon_contains_what_lies_between_its_sides() {
        // A notch is cut into the upper side.
        let region = PictureRegion::polygon(&[[0.0, 0.0], [10.0, 0.0], [5.0, 5.0], [0.0, 10.0]]);
        let contains = |u, v| region.as_ref().is_some_and(|region| region.contains(u, v));
        assert!(contains(1.0, 1.0) && contains(4.0, 4.0) && contains(8.0, 1.0));
        assert!(region.as_ref().is_some_and(|region| region.overlaps([5, 5]) && !region.overlaps([0, 0])));
        assert!(!contains(6.0, 6.0) && !contains(-1.0, 1.0) && !contains(11.0, 1.0));
        assert_eq!(PictureRegion::rectangle([5.0, 5.0], [0.0, 1.0]), None);
        assert_eq!(PictureRegion::polygon(&[[0.0, 0.0], [1.0, f64::NAN], [1.0, 0.0]]), None);
    }
}
