//! The corner of a profile: where two straight faces meet.
//!
//! Every possible place of the bend is tried: a robust line left of it, another right of it, and the residuals clipped at
//! three standard deviations, so spatter cannot cause a bend. The faces are then the points on either side of their own
//! intersection, without the last millimetres before it.

use super::face::{Face, LEAST_SIGMA_MM, RoughFace};
use super::finder::{COUNTED_SIGMAS, FACE_POINTS, LEAST_STRAIGHT, ProfileFinder};
use super::no_seam::NoSeam;
use super::round_face::{between_x, round, round_as_a_whole};
use super::seen_joint::{SeenJoint, SeenSeam};
use nalgebra::Vector2;

/// Places that are tried first.
const PLACES: usize = 24;
/// Points among which the bend is searched.
const SEARCHED_POINTS: usize = 250;
/// Bowed faces have converged if a round moves them by less, mm. The rest is a hundredth of that; for faces bent more than
/// usual plates a tenth. And most rounds.
const SETTLED_MM: f64 = 1e-3;
const MOST_ROUNDS: usize = 8;
/// Widest hole between the faces, as a part of the profile: beyond it these faces have no corner.
const WIDEST_HOLE: f64 = 0.2;

impl ProfileFinder {
    /// Two faces that meet.
    pub(super) fn meeting(&mut self, sigma_mm: f64) -> Result<SeenJoint, NoSeam> {
        let split = self.best_split(sigma_mm).ok_or(NoSeam::NotStraight)?;
        let faces = self.settled_lines(split).ok_or(NoSeam::NoAngle);
        let joint = faces.and_then(|faces| self.checked(&faces, sigma_mm));
        joint.map_err(|reason| self.one_round_face(sigma_mm).unwrap_or(reason))
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

    /// Residuals of two faces with the bend at a place.
    fn cost(&mut self, place: usize, sigma: f64) -> Option<f64> {
        let [left, right] = self.rough_faces(place)?.map(|face| face.line);
        let limit_mm = COUNTED_SIGMAS * sigma;
        let (before, after) = self.points.split_at(place);
        Some(left.squares_up_to(before, limit_mm) + right.squares_up_to(after, limit_mm))
    }

    /// Why all columns are of one round face, if they are.
    fn one_round_face(&mut self, sigma_mm: f64) -> Option<NoSeam> {
        let face = self.face_without_bow(0, self.points.len(), [None, None])?;
        round_as_a_whole(&face, sigma_mm)
    }

    /// Lines on either side of their own intersection; `None` for such that are parallel.
    pub(super) fn settled_lines(&mut self, mut split: usize) -> Option<[RoughFace; 2]> {
        let mut faces = self.rough_faces(split)?;
        for _ in 0..3 {
            let corner = faces[0].line.meets(&faces[1].line)?;
            let next = self.points.partition_point(|point| point.x < corner.x);
            let next = next.clamp(FACE_POINTS, self.points.len() - FACE_POINTS);
            if next == split {
                break;
            }
            split = next;
            faces = self.rough_faces(split)?;
        }
        Some(faces)
    }

    fn rough_faces(&mut self, split: usize) -> Option<[RoughFace; 2]> {
        Some([self.rough_face(0, split)?, self.rough_face(split, self.points.len())?])
    }

    fn checked(&mut self, faces: &[RoughFace; 2], sigma_mm: f64) -> Result<SeenJoint, NoSeam> {
        let corner = faces[0].line.meets(&faces[1].line).ok_or(NoSeam::NoAngle)?;
        let split = self.points.partition_point(|point| point.x < corner.x);
        for (face, run) in faces.iter().zip([&self.points[..split], &self.points[split..]]) {
            if run.len() < FACE_POINTS {
                return Err(NoSeam::Apart);
            }
            let limit_mm = COUNTED_SIGMAS * face.sigma_mm.max(LEAST_SIGMA_MM);
            let on_line = run.iter().filter(|point| face.line.off(point).abs() < limit_mm).count();
            if (on_line as f64) < LEAST_STRAIGHT * run.len() as f64 {
                return Err(NoSeam::NotStraight);
            }
        }
        let ends = [self.points[0], self.points[self.points.len() - 1]];
        let hole = self.points[split].x - self.points[split - 1].x;
        if hole > WIDEST_HOLE * (ends[1].x - ends[0].x) {
            return Err(NoSeam::Apart);
        }
        let (faces, x_mm) = self.faces_before(corner.x, sigma_mm).ok_or(NoSeam::NotStraight)?;
        if let Some(reason) = round(&faces, sigma_mm) {
            return Err(reason);
        }
        let [from_x, to_x] = between_x(&faces);
        let (faces, corner) = settled_ends(faces, x_mm).ok_or(NoSeam::NoAngle)?;
        let is_beyond = !(from_x..=to_x).contains(&corner.x);
        if is_beyond || self.steepest_drop_mm(from_x, to_x) > WIDEST_HOLE * (ends[1].x - ends[0].x) {
            return Err(NoSeam::Apart);
        }
        let half_lengths_mm = ends.map(|end| 0.5 * (end - corner).norm());
        Ok(SeenJoint { faces: faces.map(Some), half_lengths_mm, seam: SeenSeam::Crossing(corner) })
    }

    /// Largest change of the range from three columns to the next three between two places, mm: a single false column is not
    /// one of three.
    fn steepest_drop_mm(&self, from_x: f64, to_x: f64) -> f64 {
        let before = |x: f64| self.points.partition_point(|point| point.x < x);
        let middle = |three: &[Vector2<f64>]| {
            let [a, b, c] = [0, 1, 2].map(|k| three[k].y);
            a.max(b).min(a.min(b).max(c))
        };
        let between = &self.points[before(from_x)..before(to_x).max(before(from_x))];
        let drops = between.windows(6).map(|six| (middle(&six[3..]) - middle(&six[..3])).abs());
        drops.fold(0.0, f64::max)
    }

    /// The faces on either side of a place, without the part next to it.
    pub(super) fn beside(&mut self, x_mm: f64) -> Option<[Face; 2]> {
        Some([self.face_between(None, Some(x_mm))?, self.face_between(Some(x_mm), None)?])
    }
}

/// Faces with the same distance of their ends from their meeting point as from a place near it, and this place; `None` for
/// parallel faces. Bowed faces meet where their surfaces do: their lines cross beside it, by more than the bow itself, and
/// in every profile alike.
fn settled_ends(mut faces: [Face; 2], mut x_mm: f64) -> Option<([Face; 2], Vector2<f64>)> {
    let mut corner = faces[0].line.meets(&faces[1].line)?;
    for _ in 0..MOST_ROUNDS {
        let [left, right] = faces.map(|face| face.tangent_beside(&corner));
        corner = left.meets(&right)?;
        let by_x_mm = corner.x - x_mm;
        faces = [faces[0].with_end_moved(1, by_x_mm), faces[1].with_end_moved(0, by_x_mm)];
        x_mm = corner.x;
        if by_x_mm.abs() < SETTLED_MM {
            break;
        }
    }
    let [left, right] = faces.map(|face| face.tangent_beside(&corner));
    Some((faces, left.meets(&right)?))
}
