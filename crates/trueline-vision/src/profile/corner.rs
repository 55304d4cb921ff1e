//! The corner of a profile: where two straight faces meet.
//!
//! Every place where the profile could bend is tried: a robust line left of it, another right of it, and what is left over counted up
//! to three standard deviations, so that spatter cannot buy a bend. The faces are then the points on either side of
//! their own intersection, without the last millimetres before it.

use super::face::{Face, square_to};
use super::finder::{COUNTED_SIGMAS, FACE_POINTS, LEAST_ANGLE_SINE, LEAST_STRAIGHT, ProfileFinder};
use super::no_seam::NoSeam;
use super::seen_joint::{SeenJoint, SeenSeam};
use nalgebra::{Matrix2, Vector2};

/// Places that are tried first.
const PLACES: usize = 24;
/// Points among which the bend is searched.
const SEARCHED_POINTS: usize = 250;
/// Widest hole between the faces, as a part of the profile: what lies further away is no corner of these faces.
const WIDEST_HOLE: f64 = 0.2;

impl ProfileFinder {
    /// Two faces that meet.
    pub(super) fn meeting(&mut self, sigma_mm: f64) -> Result<SeenJoint, NoSeam> {
        let split = self.best_split(sigma_mm).ok_or(NoSeam::NotStraight)?;
        let faces = self.settled_faces(split).ok_or(NoSeam::NoAngle)?;
        self.checked(faces)
    }

    /// Index of the first point right of the bend, searched among a few hundred of the points: the faces settle it afterwards.
    pub(super) fn best_split(&mut self, sigma: f64) -> Option<usize> {
        let every = self.points.len().div_ceil(SEARCHED_POINTS);
        let all = std::mem::take(&mut self.points);
        self.points.extend(all.iter().step_by(every));
        let split = self.best_place(sigma);
        self.points = all;
        Some((split? * every).clamp(FACE_POINTS, self.points.len() - FACE_POINTS))
    }

    /// A coarse search, then the places between the neighbours of the best.
    fn best_place(&mut self, sigma: f64) -> Option<usize> {
        let last = self.points.len().checked_sub(FACE_POINTS).filter(|&last| last >= FACE_POINTS)?;
        let step = (last - FACE_POINTS).div_ceil(PLACES).max(1);
        let coarse = self.cheapest((FACE_POINTS..=last).step_by(step), sigma)?;
        let around = coarse.saturating_sub(step).max(FACE_POINTS)..=(coarse + step).min(last);
        self.cheapest(around.step_by(step.div_ceil(4)), sigma)
    }

    fn cheapest(&mut self, places: impl Iterator<Item = usize>, sigma: f64) -> Option<usize> {
        let priced = places.filter_map(|place| Some((self.cost(place, sigma)?, place)));
        priced.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, place)| place)
    }

    /// What two faces with the bend at a place leave unexplained.
    fn cost(&mut self, place: usize, sigma: f64) -> Option<f64> {
        let left = self.face(0, place)?;
        let right = self.face(place, self.points.len())?;
        let counted =
            |face: &Face, point: &Vector2<f64>| (face.off(point) / sigma).abs().min(COUNTED_SIGMAS).powi(2);
        let left: f64 = self.points[..place].iter().map(|point| counted(&left, point)).sum();
        let right: f64 = self.points[place..].iter().map(|point| counted(&right, point)).sum();
        Some(left + right)
    }

    /// Faces on either side of their own intersection; `None` for faces that are parallel.
    pub(super) fn settled_faces(&mut self, mut split: usize) -> Option<[Face; 2]> {
        let mut faces = [self.face(0, split)?, self.face(split, self.points.len())?];
        for _ in 0..3 {
            let corner = intersection(&faces)?;
            let next = self.points.partition_point(|point| point.x < corner.x);
            let next = next.clamp(FACE_POINTS, self.points.len() - FACE_POINTS);
            if next == split {
                break;
            }
            split = next;
            faces = [self.face(0, split)?, self.face(split, self.points.len())?];
        }
        Some(faces)
    }

    fn checked(&mut self, faces: [Face; 2]) -> Result<SeenJoint, NoSeam> {
        let corner = intersection(&faces).ok_or(NoSeam::NoAngle)?;
        let split = self.points.partition_point(|point| point.x < corner.x);
        for (face, run) in [(&faces[0], &self.points[..split]), (&faces[1], &self.points[split..])] {
            let limit = Self::limit_mm(&[*face], 0.0);
            let on_line = run.iter().filter(|point| face.off(point).abs() < limit).count();
            if run.len() < FACE_POINTS {
                return Err(NoSeam::Apart);
            }
            if (on_line as f64) < LEAST_STRAIGHT * run.len() as f64 {
                return Err(NoSeam::NotStraight);
            }
        }
        let ends = [self.points[0], self.points[self.points.len() - 1]];
        let hole = self.points[split].x - self.points[split - 1].x;
        if hole > WIDEST_HOLE * (ends[1].x - ends[0].x) {
            return Err(NoSeam::Apart);
        }
        let faces = self.beside(corner.x).ok_or(NoSeam::NotStraight)?;
        let corner = intersection(&faces).ok_or(NoSeam::NoAngle)?;
        let half_lengths_mm = ends.map(|end| 0.5 * (end - corner).norm());
        Ok(SeenJoint { faces: faces.map(Some), half_lengths_mm, seam: SeenSeam::Crossing(corner) })
    }

    /// The faces on either side of a place, without what lies next to it.
    pub(super) fn beside(&mut self, x_mm: f64) -> Option<[Face; 2]> {
        Some([self.face_between(None, Some(x_mm))?, self.face_between(Some(x_mm), None)?])
    }
}

/// Where two lines meet, unless they are nearly parallel.
fn intersection(faces: &[Face; 2]) -> Option<Vector2<f64>> {
    let normals = faces.map(|face| square_to(&face.direction()));
    let matrix = Matrix2::from_rows(&normals.map(|n| n.transpose()));
    if matrix.determinant().abs() < LEAST_ANGLE_SINE {
        return None;
    }
    let distances = Vector2::new(normals[0].dot(&faces[0].anchor()), normals[1].dot(&faces[1].anchor()));
    Some(matrix.try_inverse()? * distances)
}
