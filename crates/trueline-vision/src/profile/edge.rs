//! The edge of a plate over nothing: the end of the only face.
//!
//! Every profile ends somewhere, most of them where the sensor's view does. One profile does not determine which end is the plate's;
//! all profiles of a scan do: see
//! [`view`](super::view).

use super::face_end::Outward;
use super::finder::ProfileFinder;
use super::no_seam::NoSeam;
use super::sight::Sight;

impl ProfileFinder {
    /// One face and its ends.
    pub(super) fn whole_face(&mut self, sigma_mm: f64) -> Result<Sight, NoSeam> {
        let count = self.points.len();
        let whole = self.face(0, count).ok_or(NoSeam::NotStraight)?;
        let limit = Self::limit_mm(&[whole], sigma_mm);
        if !Self::is_straight(&whole, &self.points, limit) {
            return Err(NoSeam::NotStraight);
        }
        let (first, last) = (self.points[0], self.points[count - 1]);
        let face = self.face_between(Some(first.x), Some(last.x)).ok_or(NoSeam::NotStraight)?;
        let limit = Self::limit_mm(&[face], sigma_mm);
        let ends =
            [Outward::Left, Outward::Right].map(|outward| self.face_end(&face, limit, 0..count, outward));
        Ok(Sight::Face { face, half_length_mm: 0.5 * (last - first).norm(), ends })
    }
}
