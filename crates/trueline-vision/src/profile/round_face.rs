//! Round faces: their bend does not end at the expected corner.
//!
//! Two straight faces turn at the seam, and a round one everywhere. If a face is bent by more than usual plates, the bend
//! continues between the faces, unless something else is visible there. Only a clearly larger turn there is a seam.

use super::bow::Place;
use super::face::Face;
use super::no_seam::{NoSeam, RadiusUm};
use super::straight_line::LEAST_ANGLE_SINE;
use nalgebra::Vector2;

/// A seam turns by this multiple of the turn from the bend of the faces between them: a bend may be half as much again there.
const CLEARLY: f64 = 3.0;

/// A point of a face and its unit direction there.
struct Tangent {
    point: Vector2<f64>,
    along: Vector2<f64>,
}

/// How a stretch of a surface turns, rad, over how much of it, mm.
#[derive(Clone, Copy)]
struct Bend {
    turn_rad: f64,
    length_mm: f64,
}

impl Bend {
    fn between(first: &Tangent, last: &Tangent) -> Self {
        let turn_rad = first.along.perp(&last.along).atan2(first.along.dot(&last.along));
        let chord_mm = (last.point - first.point).norm();
        // An arc over its chord.
        let half = 0.5 * turn_rad;
        let longer = if half.abs() > 1e-6 { half / half.sin() } else { 1.0 };
        Self { turn_rad, length_mm: chord_mm * longer }
    }

    fn curvature_per_mm(&self) -> f64 {
        self.turn_rad / self.length_mm
    }

    fn round_face(&self) -> NoSeam {
        NoSeam::RoundFace(RadiusUm::of_mm(1.0 / self.curvature_per_mm().abs()))
    }
}

/// A bent face with a larger scatter about its bow, in units of its noise, has another form.
const KNOWN_BEND: f64 = 3.0;

/// Why a face that is all of a profile is round, if it is.
pub(super) fn round_as_a_whole(face: &Face, sigma_mm: f64) -> Option<NoSeam> {
    let [first, last] = face.tangents()?;
    let is_round = face.is_bent() && face.spread_mm() < KNOWN_BEND * sigma_mm;
    is_round.then(|| Bend::between(&first, &last).round_face())
}

/// Why two faces are round and no seam, if they are.
pub(super) fn round(faces: &[Face; 2], sigma_mm: f64) -> Option<NoSeam> {
    let [left, right] = faces.each_ref().map(Face::tangents);
    let (left, right) = (left?, right?);
    let bends = [Bend::between(&left[0], &left[1]), Bend::between(&right[0], &right[1])];
    let sharpest = (0..2)
        .filter(|&k| faces[k].is_bent())
        .map(|k| bends[k])
        .max_by(|a, b| a.curvature_per_mm().abs().total_cmp(&b.curvature_per_mm().abs()))?;
    let between = Bend::between(&left[1], &right[0]);
    let going_on = sharpest.curvature_per_mm() * between.length_mm;
    // Turned to the other side it is a seam if it is one between straight faces.
    let turned = between.turn_rad * going_on.signum();
    let goes_on = -LEAST_ANGLE_SINE..(CLEARLY * going_on.abs()).max(LEAST_ANGLE_SINE);
    let is_unknown = faces.iter().any(|face| face.is_bent() && face.spread_mm() > KNOWN_BEND * sigma_mm);
    (is_unknown || goes_on.contains(&turned)).then(|| sharpest.round_face())
}

/// End of the left face and start of the right one, along x; anywhere if no bow is known.
pub(super) fn between_x(faces: &[Face; 2]) -> [f64; 2] {
    let [left, right] = faces.each_ref().map(Face::tangents);
    [
        left.map_or(f64::NEG_INFINITY, |[_, end]| end.point.x),
        right.map_or(f64::INFINITY, |[end, _]| end.point.x),
    ]
}

impl Face {
    /// Whether it is bent by more than plates are.
    pub(super) fn is_bent(&self) -> bool {
        self.bow.is_some_and(|bow| bow.excess(1.0, self.regression.variance_at(bow.place.middle)) > 1.0)
    }

    /// How far a point is off its surface, mm, signed.
    pub(super) fn off_surface(&self, point: &Vector2<f64>) -> f64 {
        let shift = self.about.shift(point);
        let bowed_mm = self.bow.map_or(0.0, |bow| bow.at(bow.place.of_one(shift.s))[0]);
        shift.shift_px - self.regression.shift_at(shift.s) - bowed_mm
    }

    /// Its tangents at both ends, the left one first; of its line without a known bow none.
    fn tangents(&self) -> Option<[Tangent; 2]> {
        let bow = self.bow?;
        let Place { middle, half } = bow.place;
        Some([-1.0, 1.0].map(|at| {
            let s = middle + half * at;
            let [off_mm, turned] = bow.at(at);
            let point = self.about.at(s, self.regression.shift_at(s) + off_mm);
            Tangent { point, along: self.about.direction(self.regression.slope + turned) }
        }))
    }
}
