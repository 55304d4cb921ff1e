//! The edge of a lap or a step in a profile: where the face nearer to the sensor ends, of two that are parallel.
//!
//! Along the face the edge is known to the distance of two columns: it lies between the last that sees the upper face and the first that sees
//! the lower one, anywhere with the same chance. Where more than a few columns lie between, the lower face is in the shadow, and the edge is
//! right behind the upper one's last column.

use super::face::Face;
use super::face_end::{FaceEnd, Outward};
use super::finder::{COUNTED_SIGMAS, ProfileFinder, TIP_MM};
use super::no_seam::NoSeam;
use super::seen_joint::{SeenJoint, SeenSeam};
use crate::measure::regression::median;
use std::ops::Range;

/// Faces this many standard deviations of a point apart are two.
const STEP_SIGMAS: f64 = 8.0;
/// Columns of two faces that are further apart have a shadow between them: two columns may be lost by chance, and rounding decides nothing.
const COLUMNS_APART: f64 = 3.5;

impl ProfileFinder {
    /// Two parallel faces and the edge of the upper one.
    pub(super) fn lap(&mut self, sigma_mm: f64) -> Result<SeenJoint, NoSeam> {
        let split = self.best_split(sigma_mm).ok_or(NoSeam::NotStraight)?;
        if self.settled_lines(split).is_some() {
            return Err(NoSeam::NoStep);
        }
        self.stepped(split, sigma_mm).ok_or(NoSeam::NoStep)
    }

    /// The same with the bend at a place; `None` where they are one face, or not straight.
    fn stepped(&mut self, split: usize, sigma_mm: f64) -> Option<SeenJoint> {
        let faces = [self.face(0, split)?, self.face(split, self.points.len())?];
        let x_mm = 0.5 * (self.points[split - 1].x + self.points[split].x);
        let ends = [0, 1].map(|k| faces[k].at_x(x_mm));
        let [left, right] = [ends[0]?, ends[1]?];
        let limit = Self::limit_mm(&faces, sigma_mm);
        if faces[0].off(&right).abs() < STEP_SIGMAS / COUNTED_SIGMAS * limit {
            return None;
        }
        // Range grows away from the sensor.
        let upper = usize::from(right.y < left.y);
        let rough = self.edge_between(&faces, upper, limit, 0..self.points.len())?;
        // Bowed faces leave their lines before the edge: it lies between their tips.
        let outward = [Outward::Right, Outward::Left];
        let tips = [0, 1].map(|k| self.tip(&faces[k], limit, rough[k], outward[k]));
        let near = self.points.partition_point(|point| point.x < rough[0] - TIP_MM)
            ..self.points.partition_point(|point| point.x <= rough[1] + TIP_MM);
        let [from_x, to_x] = self.edge_between(&tips, upper, Self::limit_mm(&tips, sigma_mm), near)?;
        let x_mm = 0.5 * (from_x + to_x);
        let split = self.points.partition_point(|point| point.x < x_mm);
        for (face, run) in [(&faces[0], &self.points[..split]), (&faces[1], &self.points[split..])] {
            if !Self::is_straight(face, run, limit) {
                return None;
            }
        }
        let ends = [self.points[0], self.points[self.points.len() - 1]];
        let faces = self.beside(x_mm)?;
        let corner = faces[upper].at_x(x_mm)?;
        let half_lengths_mm = ends.map(|end| 0.5 * (end - corner).norm());
        let tip = self.tip(&faces[upper], limit, [from_x, to_x][upper], outward[upper]);
        let end = FaceEnd::within(tip, [from_x, to_x])?;
        let seam = SeenSeam::Edge { face: upper, end };
        Some(SeenJoint { faces: faces.map(Some), half_lengths_mm, seam })
    }

    /// Between which places the upper face ends, mm: of all places among a range of the points that with the fewest points of a face on the other
    /// one's side.
    fn edge_between(
        &mut self,
        faces: &[Face; 2],
        upper: usize,
        limit: f64,
        within: Range<usize>,
    ) -> Option<[f64; 2]> {
        let is_on = |face: usize, k: usize| faces[face].off(&self.points[k]).abs() < limit;
        let mut wrong = within.clone().filter(|&k| is_on(0, k)).count();
        let (mut split, mut fewest) = (within.start, wrong);
        for k in within.clone() {
            wrong = wrong + usize::from(is_on(1, k)) - usize::from(is_on(0, k));
            if wrong < fewest {
                (split, fewest) = (k + 1, wrong);
            }
        }
        let left = (within.start..split).rev().find(|&k| is_on(0, k))?;
        let right = (split..within.end).find(|&k| is_on(1, k))?;
        let [left, right] = [left, right].map(|k| self.points[k].x);
        self.spare.clear();
        self.spare.extend(self.points.windows(2).map(|pair| pair[1].x - pair[0].x));
        let pitch = median(&mut self.spare);
        if right - left <= COLUMNS_APART * pitch {
            return Some([left, right]);
        }
        let (end, outward) = if upper == 0 { (left, Outward::Right) } else { (right, Outward::Left) };
        let behind = end + outward.sign() * pitch;
        Some([end.min(behind), end.max(behind)])
    }
}
