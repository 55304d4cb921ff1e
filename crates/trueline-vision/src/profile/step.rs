//! The edge of a lap or a step in a profile: where the face nearer to the sensor ends, of two that are parallel.
//!
//! Along the face the edge is known to the distance of two columns: it lies between the last that sees the upper face and the first that sees
//! the lower one, anywhere with the same chance. Where more than a few columns lie between, the lower face is in the shadow, and the edge is
//! right behind the upper one's last column.

use super::corner::{
    COUNTED_SIGMAS, CornerFinder, FACE_POINTS, Face, FaceEnd, LEAST_SIGMA_MM, LEAST_STRAIGHT, MeetingFaces,
};
use crate::measure::regression::median;

/// Faces this many standard deviations of a point apart are two.
const STEP_SIGMAS: f64 = 8.0;
/// More columns without a face lie in a shadow.
const COLUMNS_APART: f64 = 3.0;

impl CornerFinder {
    /// Two parallel faces and the edge of the upper one, with the bend at a place; `None` where they are one face, or not straight.
    pub(super) fn stepped(&mut self, split: usize, sigma_mm: f64) -> Option<MeetingFaces> {
        let faces = [self.face(0, split)?, self.face(split, self.points.len())?];
        let x_mm = 0.5 * (self.points[split - 1].x + self.points[split].x);
        let ends = [0, 1].map(|k| faces[k].at_x(x_mm));
        let [left, right] = [ends[0]?, ends[1]?];
        let limit = COUNTED_SIGMAS
            * faces.iter().map(|face| face.regression.sigma_px).fold(sigma_mm.max(LEAST_SIGMA_MM), f64::max);
        if faces[0].off(&right).abs() < STEP_SIGMAS / COUNTED_SIGMAS * limit {
            return None;
        }
        // Range grows away from the sensor.
        let upper = usize::from(right.y < left.y);
        let (x_mm, width_mm) = self.edge_x(&faces, upper, limit)?;
        let split = self.points.partition_point(|point| point.x < x_mm);
        for (face, run) in [(&faces[0], &self.points[..split]), (&faces[1], &self.points[split..])] {
            let on_line = run.iter().filter(|point| face.off(point).abs() < limit).count();
            if run.len() < FACE_POINTS || (on_line as f64) < LEAST_STRAIGHT * run.len() as f64 {
                return None;
            }
        }
        let ends = [self.points[0], self.points[self.points.len() - 1]];
        let faces = self.beside_corner(x_mm, ends.map(|end| end.x))?;
        let corner = faces[upper].at_x(x_mm)?;
        let half_lengths_mm = ends.map(|end| 0.5 * (end - corner).norm());
        // Along the face; evenly spread over the width.
        let slant = (faces[upper].at_x(x_mm + width_mm)? - corner).norm();
        let edge = Some(FaceEnd { face: upper, sigma_mm: slant / 12_f64.sqrt() });
        Some(MeetingFaces { faces, corner, half_lengths_mm, edge })
    }

    /// Where the upper face ends, and how wide the place is that it may be in, mm: of all places that with the fewest points of a face on
    /// the other one's side.
    fn edge_x(&mut self, faces: &[Face; 2], upper: usize, limit: f64) -> Option<(f64, f64)> {
        let is_on = |face: usize, k: usize| faces[face].off(&self.points[k]).abs() < limit;
        let count = self.points.len();
        let mut wrong = (0..count).filter(|&k| is_on(0, k)).count();
        let (mut split, mut fewest) = (0, wrong);
        for k in 0..count {
            wrong = wrong + usize::from(is_on(1, k)) - usize::from(is_on(0, k));
            if wrong < fewest {
                (split, fewest) = (k + 1, wrong);
            }
        }
        let left = (0..split).rev().find(|&k| is_on(0, k))?;
        let right = (split..count).find(|&k| is_on(1, k))?;
        let (left, right) = (self.points[left].x, self.points[right].x);
        self.spare.clear();
        self.spare.extend(self.points.windows(2).map(|pair| pair[1].x - pair[0].x));
        let pitch = median(&mut self.spare);
        if right - left <= COLUMNS_APART * pitch {
            return Some((0.5 * (left + right), right - left));
        }
        let (end, outward) = if upper == 0 { (left, 1.0) } else { (right, -1.0) };
        Some((end + 0.5 * outward * pitch, pitch))
    }
}
