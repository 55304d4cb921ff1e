//! The corner of a laser profile: where two straight faces meet, with its covariance.
//!
//! Every place where the profile could bend is tried: a robust line left of it, another right of it, and what is left over counted up
//! to three standard deviations, so that spatter cannot buy a bend. The faces are then the points on either side of
//! their own intersection, without the last millimetres before it: there a column sees both faces at once, or a mirrored stripe.

use crate::measure::regression::{Regression, Regressor, Shift, median};
use nalgebra::{Matrix2, Vector2};

/// Fewest points of a face.
pub(super) const FACE_POINTS: usize = 10;
/// Places that are tried first.
const PLACES: usize = 24;
/// Points among which the bend is searched.
const SEARCHED_POINTS: usize = 250;
/// Two faces that differ in direction by less (sine) are one, or the plates of a lap joint: 10°.
const LEAST_ANGLE_SINE: f64 = 0.17;
/// Part of a face's points that must lie on its line.
pub(super) const LEAST_STRAIGHT: f64 = 0.6;
/// Residuals count up to this many standard deviations.
pub(super) const COUNTED_SIGMAS: f64 = 3.0;
/// Widest hole between the faces, as a part of the profile: what lies further away is no corner of these faces.
const WIDEST_HOLE: f64 = 0.2;
/// So much of a face next to the corner is left out, mm along x (what a column sees at once is as wide in x on any face), ...
const LEFT_OUT_MM: f64 = 2.0;
/// ... and no more than this part of the face.
const LEFT_OUT_PART: f64 = 0.2;
/// Noise is not taken to be smaller, mm: profilers print 0.1 µm.
pub(super) const LEAST_SIGMA_MM: f64 = 1e-4;

/// Where two faces meet, or the edge of the upper one of two that are parallel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProfileCorner {
    /// The corner or edge (x along the stripe, z range), mm.
    pub point_mm: Vector2<f64>,
    /// Its covariance, mm².
    pub covariance_mm2: Matrix2<f64>,
    /// Angle between the faces, rad.
    pub angle_rad: f64,
    /// The faces, the left one first.
    pub faces: [FaceSupport; 2],
}

/// All that a straight face says: two points of it, whose errors square to it are independent of each other and equally
/// large.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FaceSupport {
    /// The points (x, z), the one nearer to the corner first, mm.
    pub points_mm: [Vector2<f64>; 2],
    /// Standard deviation of each square to the face, mm.
    pub sigma_mm: f64,
}

/// Why a profile has no corner.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, thiserror::Error)]
pub enum NoCorner {
    /// Hardly any point came back.
    #[error("too few points")]
    TooFewPoints,
    /// One straight line, or two that are parallel.
    #[error("no two faces at an angle")]
    NoAngle,
    /// What lies beside the corner is no straight face.
    #[error("the faces are not straight")]
    NotStraight,
    /// The faces would meet far from both.
    #[error("the faces do not meet")]
    Apart,
}

/// Finds corners; memory is kept from one profile to the next.
#[derive(Clone, Debug, Default)]
pub struct CornerFinder {
    regressor: Regressor,
    shifts: Vec<Shift>,
    pub(super) points: Vec<Vector2<f64>>,
    pub(super) spare: Vec<f64>,
}

/// A straight face: a point, its direction and the regression of the shifts square to it.
#[derive(Clone, Copy)]
pub(super) struct Face {
    origin: Vector2<f64>,
    along: Vector2<f64>,
    pub(super) regression: Regression,
}

/// Two faces and the corner in which they meet, or the edge of the upper one; the left one first.
#[derive(Clone, Copy)]
pub(super) struct MeetingFaces {
    pub(super) faces: [Face; 2],
    pub(super) corner: Vector2<f64>,
    pub(super) half_lengths_mm: [f64; 2],
    pub(super) edge: Option<FaceEnd>,
}

/// The end of a face: its edge.
#[derive(Clone, Copy)]
pub(super) struct FaceEnd {
    /// Number of the face.
    pub face: usize,
    /// Standard deviation of its place along the face, mm.
    pub sigma_mm: f64,
}

impl MeetingFaces {
    /// Where they meet and what each says; `None` if they are parallel.
    pub(super) fn corner(&self) -> Option<ProfileCorner> {
        let Self { faces, corner, half_lengths_mm, edge } = self;
        let supports = [0, 1].map(|k| faces[k].support(corner, half_lengths_mm[k]));
        if let Some(end) = edge {
            let along = faces[end.face].direction();
            let across = square_to(&along);
            let variance = faces[end.face].variance_at(corner);
            let covariance_mm2 =
                along * along.transpose() * end.sigma_mm.powi(2) + across * across.transpose() * variance;
            return Some(ProfileCorner {
                point_mm: *corner,
                covariance_mm2,
                angle_rad: 0.0,
                faces: supports,
            });
        }
        let normals = Matrix2::from_rows(&faces.map(|face| square_to(&face.direction()).transpose()));
        let inverse = normals.try_inverse()?;
        let variances = faces.map(|face| face.variance_at(corner));
        let covariance_mm2 =
            inverse * Matrix2::from_diagonal(&Vector2::from(variances)) * inverse.transpose();
        let angle_rad = normals.determinant().abs().min(1.0).asin();
        Some(ProfileCorner { point_mm: *corner, covariance_mm2, angle_rad, faces: supports })
    }
}

impl Face {
    /// Variance of the line at a point of it, mm².
    fn variance_at(&self, point: &Vector2<f64>) -> f64 {
        let there = self.along.dot(&(point - self.origin));
        self.regression.variance_at(there).max(LEAST_SIGMA_MM.powi(2))
    }

    /// The line at a place along the profile.
    pub(super) fn at_x(&self, x_mm: f64) -> Option<Vector2<f64>> {
        let (anchor, direction) = (self.anchor(), self.direction());
        let steps = (x_mm - anchor.x) / direction.x;
        steps.is_finite().then(|| anchor + direction * steps)
    }

    /// Distance of a point from the line, signed.
    pub(super) fn off(&self, point: &Vector2<f64>) -> f64 {
        let from = point - self.origin;
        let slope = self.regression.slope;
        (square_to(&self.along).dot(&from) - self.regression.shift_at(self.along.dot(&from)))
            / slope.hypot(1.0)
    }

    /// Unit direction of the line.
    fn direction(&self) -> Vector2<f64> {
        (self.along + square_to(&self.along) * self.regression.slope).normalize()
    }

    /// The support points of the face, as of a stripe in a picture: errors of the line at two distances x, y from the middle of
    /// the regression covary by m₁₁ + m₁₂ (x + y) + m₂₂ x y, which vanishes for x, y = x₀ ± d with x₀ = −m₁₂/m₂₂ and
    /// d² = (m₁₁ − m₁₂²/m₂₂)/m₂₂. A profile without any noise says nothing of it: then those of an even face, ℓ/√3 from the
    /// middle.
    fn support(&self, corner: &Vector2<f64>, half_length_mm: f64) -> FaceSupport {
        let Regression { centre, covariance, slope, .. } = &self.regression;
        let middle = -covariance.m12 / covariance.m22;
        let variance = covariance.m11 - covariance.m12 * covariance.m12 / covariance.m22;
        let half = (variance / covariance.m22).sqrt();
        let (middle, half) = if half > 0.0 && half.is_finite() {
            (middle, half)
        } else {
            (0.0, half_length_mm / 3_f64.sqrt())
        };
        let at = |from_centre: f64| {
            let s = centre + from_centre;
            self.origin + self.along * s + square_to(&self.along) * self.regression.shift_at(s)
        };
        let mut points_mm = [at(middle - half), at(middle + half)];
        if (points_mm[0] - corner).norm_squared() > (points_mm[1] - corner).norm_squared() {
            points_mm.swap(0, 1);
        }
        let sigma_mm = ((2.0 * variance.max(0.0)).sqrt() / slope.hypot(1.0)).max(LEAST_SIGMA_MM);
        FaceSupport { points_mm, sigma_mm }
    }

    /// A point of the line.
    fn anchor(&self) -> Vector2<f64> {
        self.origin + self.along * self.regression.centre + square_to(&self.along) * self.regression.shift_px
    }
}

fn square_to(direction: &Vector2<f64>) -> Vector2<f64> {
    Vector2::new(-direction.y, direction.x)
}

impl CornerFinder {
    /// The corner of a profile of points (x, z) in mm, in any order.
    ///
    /// # Errors
    /// Why there is none.
    pub fn find(&mut self, profile_mm: &[[f64; 2]]) -> Result<ProfileCorner, NoCorner> {
        self.faces(profile_mm)?.corner().ok_or(NoCorner::NoAngle)
    }

    /// The faces that meet there.
    pub(super) fn faces(&mut self, profile_mm: &[[f64; 2]]) -> Result<MeetingFaces, NoCorner> {
        self.points.clear();
        self.points.extend(profile_mm.iter().map(|&point| Vector2::from(point)));
        self.points.sort_by(|a, b| a.x.total_cmp(&b.x));
        if self.points.len() < 2 * FACE_POINTS {
            return Err(NoCorner::TooFewPoints);
        }
        let sigma = self.noise_mm();
        let split = self.best_split(sigma).ok_or(NoCorner::NotStraight)?;
        match self.settled_faces(split) {
            Some(faces) => self.checked(faces),
            None => self.stepped(split, sigma).ok_or(NoCorner::NoAngle),
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

    /// Index of the first point right of the bend, searched among a few hundred of the points: the faces settle it afterwards.
    fn best_split(&mut self, sigma: f64) -> Option<usize> {
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

    /// A robust line through a run of points, in coordinates along its rough direction, so that steep faces are like any other.
    pub(super) fn face(&mut self, from: usize, to: usize) -> Option<Face> {
        let points = &self.points[from..to];
        let third = (points.len() / 3).max(1);
        let mut middle_of = |run: &[Vector2<f64>]| {
            let mut of = |axis: usize| {
                self.spare.clear();
                self.spare.extend(run.iter().map(|point| point[axis]));
                median(&mut self.spare)
            };
            Vector2::new(of(0), of(1))
        };
        let (first, last) = (middle_of(&points[..third]), middle_of(&points[points.len() - third..]));
        let along = (last - first).try_normalize(1e-9)?;
        let across = square_to(&along);
        self.shifts.clear();
        self.shifts.extend(points.iter().map(|point| {
            let from = point - first;
            Shift { s: along.dot(&from), shift_px: across.dot(&from), weight: 1.0, response: 1.0 }
        }));
        let regression = self.regressor.fit(&self.shifts)?;
        Some(Face { origin: first, along, regression })
    }

    /// Faces on either side of their own intersection, and how many points of each are on its line.
    fn settled_faces(&mut self, mut split: usize) -> Option<[Face; 2]> {
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

    fn checked(&mut self, faces: [Face; 2]) -> Result<MeetingFaces, NoCorner> {
        let corner = intersection(&faces).ok_or(NoCorner::NoAngle)?;
        let split = self.points.partition_point(|point| point.x < corner.x);
        for (face, run) in [(&faces[0], &self.points[..split]), (&faces[1], &self.points[split..])] {
            let limit = COUNTED_SIGMAS * face.regression.sigma_px.max(LEAST_SIGMA_MM);
            let on_line = run.iter().filter(|point| face.off(point).abs() < limit).count();
            if run.len() < FACE_POINTS {
                return Err(NoCorner::Apart);
            }
            if (on_line as f64) < LEAST_STRAIGHT * run.len() as f64 {
                return Err(NoCorner::NotStraight);
            }
        }
        let ends = [self.points[0], self.points[self.points.len() - 1]];
        let hole = self.points[split].x - self.points[split - 1].x;
        if hole > WIDEST_HOLE * (ends[1].x - ends[0].x) {
            return Err(NoCorner::Apart);
        }
        let faces = self.beside_corner(corner.x, ends.map(|end| end.x)).ok_or(NoCorner::NotStraight)?;
        let corner = intersection(&faces).ok_or(NoCorner::NoAngle)?;
        let half_lengths_mm = ends.map(|end| 0.5 * (end - corner).norm());
        Ok(MeetingFaces { faces, corner, half_lengths_mm, edge: None })
    }

    /// The same faces without what lies next to the corner.
    pub(super) fn beside_corner(&mut self, corner_x: f64, ends_x: [f64; 2]) -> Option<[Face; 2]> {
        let [left, right] = ends_x.map(|end| LEFT_OUT_MM.min(LEFT_OUT_PART * (end - corner_x).abs()));
        let last = self.points.partition_point(|point| point.x < corner_x - left).max(FACE_POINTS);
        let first = self.points.partition_point(|point| point.x < corner_x + right);
        let first = first.min(self.points.len() - FACE_POINTS);
        Some([self.face(0, last)?, self.face(first, self.points.len())?])
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
