//! The edge of a lap or a step in a profile: where the face nearer to the sensor ends, of two that are parallel.
//!
//! Along the face the edge is known to the distance of two columns: it lies anywhere between the last on the upper face and
//! the first on the lower one, with equal chance. If more than a few columns lie between, the lower face is in the shadow,
//! and the edge is that of a face over nothing: see [`face_end`](super::face_end).

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
/// To which side each face ends.
const OUTWARD: [Outward; 2] = [Outward::Right, Outward::Left];

/// End of the upper of two faces.
struct StepEdge {
    /// Between which places of x, mm.
    x_mm: [f64; 2],
    /// Distance of columns, mm.
    pitch_mm: f64,
    /// If the lower face begins further away than the next column: the points before it.
    over_shadow: Option<Range<usize>>,
}

impl ProfileFinder {
    /// Two parallel faces and the edge of the upper one.
    pub(super) fn lap(&mut self, sigma_mm: f64) -> Result<SeenJoint, NoSeam> {
        let split = self.best_split(sigma_mm).ok_or(NoSeam::NotStraight)?;
        if self.settled_lines(split).is_some() {
            return Err(NoSeam::NoStep);
        }
        let (mut joint, over_shadow) = self.stepped(split, sigma_mm).ok_or(NoSeam::NoStep)?;
        if let (SeenSeam::Edge { face, end }, Some(upper)) = (&mut joint.seam, over_shadow)
            && let Some(whole) = &joint.faces[*face]
        {
            let limit = Self::limit_mm(&[*whole], sigma_mm);
            *end = self.face_end(whole, limit, upper, OUTWARD[*face])?;
        }
        Ok(joint)
    }

    /// The same with the bend at a place, and over a shadow the points of the upper face; `None` if they are one face, or
    /// not straight.
    fn stepped(&mut self, split: usize, sigma_mm: f64) -> Option<(SeenJoint, Option<Range<usize>>)> {
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
        let rough = self.edge_between(&faces, upper, limit, 0..self.points.len())?.x_mm;
        // Bowed faces leave their lines before the edge: it lies between their tips.
        let tips = [0, 1].map(|k| self.tip(&faces[k], limit, rough[k], OUTWARD[k]));
        let near = self.points.partition_point(|point| point.x < rough[0] - TIP_MM)
            ..self.points.partition_point(|point| point.x <= rough[1] + TIP_MM);
        let edge = self.edge_between(&tips, upper, Self::limit_mm(&tips, sigma_mm), near)?;
        let [from_x, to_x] = edge.x_mm;
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
        let last_x = [from_x, to_x][upper];
        let tip = self.tip(&faces[upper], limit, last_x, OUTWARD[upper]);
        let lost = self.lost_before(&tip, last_x, OUTWARD[upper], edge.pitch_mm);
        let end = FaceEnd { lost, ..FaceEnd::within(tip, [from_x, to_x])? };
        let seam = SeenSeam::Edge { face: upper, end };
        Some((SeenJoint { faces: faces.map(Some), half_lengths_mm, seam }, edge.over_shadow))
    }

    /// End of the upper face: the place in a range of the points with the fewest points of a face on the other one's side.
    fn edge_between(
        &mut self,
        faces: &[Face; 2],
        upper: usize,
        limit: f64,
        within: Range<usize>,
    ) -> Option<StepEdge> {
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
        let before_lower = if upper == 0 { 0..right } else { left + 1..self.points.len() };
        let [left, right] = [left, right].map(|k| self.points[k].x);
        self.spare.clear();
        self.spare.extend(self.points.windows(2).map(|pair| pair[1].x - pair[0].x));
        let pitch_mm = median(&mut self.spare);
        if right - left <= COLUMNS_APART * pitch_mm {
            return Some(StepEdge { x_mm: [left, right], pitch_mm, over_shadow: None });
        }
        let x_mm = if upper == 0 { [left, left + pitch_mm] } else { [right - pitch_mm, right] };
        Some(StepEdge { x_mm, pitch_mm, over_shadow: Some(before_lower) })
    }
}
