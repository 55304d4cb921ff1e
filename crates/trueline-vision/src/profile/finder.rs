//! Finds the seam in one profile after the other.

use super::face::{Face, LEAST_SIGMA_MM, RoughDirection, RoughFace};
use super::face_end::Outward;
use super::joint::ProfileJoint;
use super::no_seam::NoSeam;
use super::seen_joint::ProfileSeam;
use super::sight::Sight;
use crate::measure::regression::{Regressor, Shift, median};
use nalgebra::Vector2;

/// Fewest points of a face.
pub(super) const FACE_POINTS: usize = 10;
/// Part of a face's points that must lie on its line.
pub(super) const LEAST_STRAIGHT: f64 = 0.6;
/// Residuals count up to this many standard deviations.
pub(super) const COUNTED_SIGMAS: f64 = 3.0;
/// This part of a face next to the seam is left out, mm along x (a column's footprint is as wide in x on any face), ...
const LEFT_OUT_MM: f64 = 2.0;
/// ... and at most this part of the face.
const LEFT_OUT_PART: f64 = 0.2;
/// Length of a face's tip, mm along x. A bow of 0.2 mm at 25 mm from the end then leaves 0.006 mm of an end's height; with
/// all of the face it leaves 0.04 mm. And no fewer points than these.
pub(super) const TIP_MM: f64 = 8.0;
const TIP_POINTS: usize = 2 * FACE_POINTS;

/// Finds seams; memory is kept from one profile to the next.
#[derive(Clone, Debug, Default)]
pub struct ProfileFinder {
    pub(super) regressor: Regressor,
    pub(super) shifts: Vec<Shift>,
    pub(super) points: Vec<Vector2<f64>>,
    pub(super) spare: Vec<f64>,
}

impl ProfileFinder {
    /// The seam of a profile of points (x, z) in mm, in any order: where two faces meet, else the edge of a lap.
    ///
    /// # Errors
    /// The reason why there is none.
    pub fn find(&mut self, profile_mm: &[[f64; 2]]) -> Result<ProfileSeam, NoSeam> {
        match self.find_joint(profile_mm, ProfileJoint::Meeting) {
            Err(NoSeam::NoAngle) => {
                self.find_joint(profile_mm, ProfileJoint::Lap).map_err(|_| NoSeam::NoAngle)
            }
            found => found,
        }
    }

    /// The seam of a joint. Of a single plate it is its edge only where the other end is not seen; that is not known of one profile.
    ///
    /// # Errors
    /// The reason why there is none.
    pub fn find_joint(
        &mut self,
        profile_mm: &[[f64; 2]],
        joint: ProfileJoint,
    ) -> Result<ProfileSeam, NoSeam> {
        match self.sight(profile_mm, joint)? {
            Sight::Joint(joint) => joint.seam().ok_or(NoSeam::NoAngle),
            Sight::Face { .. } => Err(NoSeam::EndOfView),
        }
    }

    /// Findings in a profile of a joint.
    pub(super) fn sight(&mut self, profile_mm: &[[f64; 2]], joint: ProfileJoint) -> Result<Sight, NoSeam> {
        self.points.clear();
        self.points.extend(profile_mm.iter().map(|&point| Vector2::from(point)));
        self.points.sort_by(|a, b| a.x.total_cmp(&b.x));
        if self.points.len() < 2 * FACE_POINTS {
            return Err(NoSeam::TooFewPoints);
        }
        let sigma = self.noise_mm();
        match joint {
            ProfileJoint::Meeting => self.meeting(sigma).map(Sight::Joint),
            ProfileJoint::Lap => self.lap(sigma).map(Sight::Joint),
            ProfileJoint::Butt => self.gap(sigma).map(Sight::Joint),
            ProfileJoint::Edge => self.whole_face(sigma),
        }
    }

    /// Noise of one point: the median distance from the chord of its neighbours.
    fn noise_mm(&mut self) -> f64 {
        self.spare.clear();
        self.spare.extend(self.points.windows(3).filter_map(|three| {
            let width = three[2].x - three[0].x;
            let part = (three[1].x - three[0].x) / width;
            let chord = three[0].y + part * (three[2].y - three[0].y);
            // The variance of the difference, of three points with the same noise.
            let spread = (1.0 + part * part + (1.0 - part) * (1.0 - part)).sqrt();
            (width > 0.0).then(|| (three[1].y - chord).abs() / spread)
        }));
        // 1.4826: standard deviation over median of a normal distribution.
        (1.4826 * median(&mut self.spare)).max(LEAST_SIGMA_MM)
    }

    /// How far from the lines of faces their points are, mm.
    pub(super) fn limit_mm(faces: &[Face], sigma_mm: f64) -> f64 {
        let widest = faces.iter().map(|face| face.regression.sigma_px).fold(sigma_mm, f64::max);
        COUNTED_SIGMAS * widest.max(LEAST_SIGMA_MM)
    }

    /// Whether a run of the points is on a face.
    pub(super) fn is_straight(face: &Face, run: &[Vector2<f64>], limit_mm: f64) -> bool {
        let on_line = run.iter().filter(|point| face.off(point).abs() < limit_mm).count();
        run.len() >= FACE_POINTS && on_line as f64 >= LEAST_STRAIGHT * run.len() as f64
    }

    /// A robust line through a run of points, in coordinates along its rough direction, so that steep faces are like any other.
    pub(super) fn face(&mut self, from: usize, to: usize) -> Option<Face> {
        let about = self.take_run(from, to)?;
        Some(Face::of(about, self.regressor.fit(&self.shifts)?))
    }

    /// The same without knowledge of the line's noise.
    pub(super) fn rough_face(&mut self, from: usize, to: usize) -> Option<RoughFace> {
        let about = self.take_run(from, to)?;
        let line = self.regressor.rough_line(&self.shifts)?;
        let sigma_mm = self.regressor.spread(&line);
        Some(RoughFace { line: about.line([line.centre, line.shift_px], line.slope), sigma_mm })
    }

    /// Takes the shifts of a run of the points about its rough direction: from the medians of its first third to those of
    /// its last.
    pub(super) fn take_run(&mut self, from: usize, to: usize) -> Option<RoughDirection> {
        let points = &self.points[from..to];
        let third = (points.len() / 3).max(1);
        let mut middle_of = |run: &[Vector2<f64>]| {
            self.spare.clear();
            self.spare.extend(run.iter().map(|point| point.y));
            // The points are sorted along x.
            run.get(run.len() / 2).map(|point| Vector2::new(point.x, median(&mut self.spare)))
        };
        let (first, last) = (middle_of(points.get(..third)?)?, middle_of(&points[points.len() - third..])?);
        // For points above each other no column gives their place along it.
        let along = (last - first).try_normalize(1e-9).filter(|along| along.x > 0.0)?;
        let about = RoughDirection { origin: first, along };
        self.shifts.clear();
        self.shifts.extend(points.iter().map(|point| about.shift(point)));
        Some(about)
    }

    /// A face between two places without the parts next to them: there a column views more than the face, or a mirrored
    /// stripe, or the face is rounded. At an end where the face begins or continues beyond the profile nothing is left
    /// out.
    pub(super) fn face_between(&mut self, from: Option<f64>, to: Option<f64>) -> Option<Face> {
        let (first, last) = (self.points.first()?.x, self.points.last()?.x);
        let left_out = left_out_mm(to.unwrap_or(last) - from.unwrap_or(first));
        let ends_x = [from.map(|x| x + left_out), to.map(|x| x - left_out)];
        let before = |x: f64| self.points.partition_point(|point| point.x < x);
        let start = ends_x[0].map_or(0, before).min(self.points.len() - FACE_POINTS);
        let end = ends_x[1].map_or(self.points.len(), before).max(FACE_POINTS);
        (start + FACE_POINTS <= end).then(|| self.face_without_bow(start, end, ends_x)).flatten()
    }

    /// The last millimetres of a face before its end; all of it if they are too few, or not straight.
    pub(super) fn tip(&mut self, face: &Face, limit_mm: f64, end_x: f64, outward: Outward) -> Face {
        let left_out = LEFT_OUT_MM.min(LEFT_OUT_PART * TIP_MM);
        let [near, far] = [left_out, TIP_MM].map(|from_end| end_x - outward.sign() * from_end);
        let start = self.points.partition_point(|point| point.x < near.min(far));
        let end = self.points.partition_point(|point| point.x <= near.max(far));
        if end - start < TIP_POINTS {
            return *face;
        }
        let tip = self.face(start, end);
        tip.filter(|tip| Self::is_straight(tip, &self.points[start..end], limit_mm)).unwrap_or(*face)
    }
}

/// How much of a face is left out next to a seam, mm along x.
pub(super) fn left_out_mm(length_mm: f64) -> f64 {
    LEFT_OUT_MM.min(LEFT_OUT_PART * length_mm)
}
