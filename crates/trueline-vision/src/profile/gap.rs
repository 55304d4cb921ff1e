//! The gap of a butt joint in a profile: the middle between the ends of two faces in line.
//!
//! A gap is the widest stretch of columns on neither face. Anything seen in it (its bottom, a backing bar, a wire) lies off
//! both. It is wider than the plates are out of line: otherwise it is the shadow of a step.

use super::face::Face;
use super::face_end::Outward;
use super::finder::ProfileFinder;
use super::no_seam::NoSeam;
use super::seen_joint::{SeenJoint, SeenSeam};
use super::straight_line::LEAST_ANGLE_SINE;
use crate::measure::regression::median;
use nalgebra::Vector2;

/// Narrowest gap, in distances of columns: three columns without a return are chance.
const NARROWEST_COLUMNS: f64 = 4.5;
/// A second gap of this part of the widest one's width makes it doubtful.
const RIVAL: f64 = 0.7;
/// Part of a hole filled by something nearer beyond which it is not a hole.
const FILLED: f64 = 0.5;
/// Rounds in which faces and gap settle.
const ROUNDS: usize = 3;

/// A stretch of columns on no face.
#[derive(Clone, Copy)]
struct Hole {
    /// Index of the last point on the left face, and of the first one on the right.
    points: [usize; 2],
    width_mm: f64,
}

impl ProfileFinder {
    /// Two faces in line and the gap between them.
    pub(super) fn gap(&mut self, sigma_mm: f64) -> Result<SeenJoint, NoSeam> {
        let split = self.best_split(sigma_mm).ok_or(NoSeam::NotStraight)?;
        let mut around = [split - 1, split];
        let mut faces = self.faces_around(around)?;
        for _ in 0..ROUNDS {
            let hole = self.widest_hole(&faces, Self::limit_mm(&faces, sigma_mm))?;
            if hole.points == around {
                break;
            }
            around = hole.points;
            faces = self.faces_around(around)?;
        }
        let limit = Self::limit_mm(&faces, sigma_mm);
        let [last, first] = self.widest_hole(&faces, limit)?.points;
        let runs = [&self.points[..=last], &self.points[first..]];
        if faces.iter().zip(runs).any(|(face, run)| !Self::is_straight(face, run, limit)) {
            return Err(NoSeam::NotStraight);
        }
        let [x_left, x_right] = [last, first].map(|k| self.points[k].x);
        if self.is_filled(&faces, limit, last + 1..first, x_right - x_left) {
            return Err(NoSeam::NoGap);
        }
        let (far_left, far_right) = (self.points[0], self.points[self.points.len() - 1]);
        let faces = [
            self.face_between(None, Some(x_left)).ok_or(NoSeam::NotStraight)?,
            self.face_between(Some(x_right), None).ok_or(NoSeam::NotStraight)?,
        ];
        let ends = [
            self.face_end(&faces[0], limit, 0..first, Outward::Right)?,
            self.face_end(&faces[1], limit, last + 1..self.points.len(), Outward::Left)?,
        ];
        let apart = ends[1].at() - ends[0].at();
        let parallel = faces[0].direction().perp(&faces[1].direction()).abs() < LEAST_ANGLE_SINE;
        // Out of line by less than the gap is wide.
        let out_of_line = faces[0].direction().perp(&apart).abs();
        if !parallel || out_of_line > faces[0].direction().dot(&apart) {
            return Err(NoSeam::NoGap);
        }
        let half_lengths_mm =
            [(far_left - ends[0].at()).norm(), (far_right - ends[1].at()).norm()].map(|length| 0.5 * length);
        Ok(SeenJoint { faces: faces.map(Some), half_lengths_mm, seam: SeenSeam::Gap(ends) })
    }

    /// Whether an object fills most of a hole, nearer to the sensor than the faces: a bead or a ball on a plate.
    fn is_filled(
        &self,
        faces: &[Face; 2],
        limit_mm: f64,
        within: std::ops::Range<usize>,
        width_mm: f64,
    ) -> bool {
        let pitch_mm = width_mm / within.len().max(1) as f64;
        let is_nearer = |point: &&Vector2<f64>| {
            faces.iter().all(|face| face.at_x(point.x).is_some_and(|at| point.y < at.y - limit_mm))
        };
        let nearer = self.points[within].iter().filter(is_nearer).count() as f64;
        nearer * pitch_mm > FILLED * width_mm && pitch_mm < FILLED * width_mm
    }

    /// The faces on either side of a hole.
    fn faces_around(&mut self, [last, first]: [usize; 2]) -> Result<[Face; 2], NoSeam> {
        let left = self.face(0, last + 1).ok_or(NoSeam::NotStraight)?;
        let right = self.face(first, self.points.len()).ok_or(NoSeam::NotStraight)?;
        Ok([left, right])
    }

    /// The widest stretch without a point on one of the faces.
    fn widest_hole(&mut self, faces: &[Face; 2], limit_mm: f64) -> Result<Hole, NoSeam> {
        self.spare.clear();
        self.spare.extend(self.points.windows(2).map(|pair| pair[1].x - pair[0].x));
        let pitch_mm = median(&mut self.spare);
        let mut holes: [Option<Hole>; 2] = [None; 2];
        let mut before: Option<usize> = None;
        for (k, point) in self.points.iter().enumerate() {
            if faces.iter().all(|face| face.off(point).abs() >= limit_mm) {
                continue;
            }
            if let Some(before) = before.replace(k) {
                let hole = Hole { points: [before, k], width_mm: point.x - self.points[before].x };
                let widest = |held: &Option<Hole>| held.is_none_or(|held| hole.width_mm > held.width_mm);
                if widest(&holes[0]) {
                    holes = [Some(hole), holes[0]];
                } else if widest(&holes[1]) {
                    holes[1] = Some(hole);
                }
            }
        }
        let best =
            holes[0].filter(|hole| hole.width_mm > NARROWEST_COLUMNS * pitch_mm).ok_or(NoSeam::NoGap)?;
        // A column less than the distance of the points is lost.
        let lost = |hole: &Hole| hole.width_mm - pitch_mm;
        if holes[1].is_some_and(|other| lost(&other) > RIVAL * lost(&best)) {
            return Err(NoSeam::SeveralGaps);
        }
        Ok(best)
    }
}
