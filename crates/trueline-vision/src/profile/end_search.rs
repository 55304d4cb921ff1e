//! The search for the end of a face.

use super::face::Face;
use super::face_end::{COUNTED_COLUMNS, FaceEnd, Outward, lost_part};
use super::finder::ProfileFinder;
use super::no_seam::NoSeam;
use crate::measure::regression::median;
use nalgebra::Vector2;
use std::ops::Range;

/// Columns before the end; half must be on the face: a reflection on its line by chance is rejected.
const FOOTHOLD: usize = 10;
/// Columns further apart than this are not next to each other.
const NEXT_COLUMNS: f64 = 1.5;
/// And further apart than this they are not of one face that bends away.
const BENT_COLUMNS: f64 = 4.5;
/// An edge with a larger radius does not count as an end, mm.
const MOST_ROUNDED_MM: f64 = 1.0;
/// A face bends before its end if its last columns lean away from its line by more, and by this number of standard
/// deviations: 9°.
const MOST_LEAN: f64 = 0.15;
const LEAN_SIGMAS: f64 = 4.0;
/// Last columns used for that: those within this distance, mm, and at least this number.
const LEANING_MM: f64 = 1.0;
/// Columns from which their distance is taken.
const PITCH_COLUMNS: usize = 41;

/// A range of the points of a profile, from the far side on.
struct FromOutside {
    within: Range<usize>,
    outward: Outward,
}

impl FromOutside {
    /// Index of the k-th point.
    fn index(&self, k: usize) -> usize {
        match self.outward {
            Outward::Left => self.within.start + k,
            Outward::Right => self.within.end - 1 - k,
        }
    }
}

impl ProfileFinder {
    /// The end of a face to one side among a range of the points; points within `limit_mm` of its line are on it. The end of
    /// a bowed face does not lie on the line of all of it: it is where the face's tip ends.
    pub(super) fn face_end(
        &mut self,
        face: &Face,
        limit_mm: f64,
        within: Range<usize>,
        outward: Outward,
    ) -> Result<FaceEnd, NoSeam> {
        let from_outside = FromOutside { within, outward };
        let last_k = self.last_on(face, limit_mm, &from_outside)?;
        let last_x = self.points[from_outside.index(last_k)].x;
        let tip = self.tip(face, limit_mm, last_x, outward);
        self.end_of_tip(&tip, &from_outside)
    }

    /// Number of the last point on a face.
    fn last_on(&self, face: &Face, limit_mm: f64, from_outside: &FromOutside) -> Result<usize, NoSeam> {
        let count = from_outside.within.len();
        let on = |k: usize| face.off(&self.points[from_outside.index(k)]).abs() < limit_mm;
        let has_foothold = |k: usize| {
            let before = (k..(k + FOOTHOLD).min(count)).filter(|&k| on(k)).count();
            on(k) && 2 * before >= FOOTHOLD
        };
        (0..count).find(|&k| has_foothold(k)).ok_or(NoSeam::NotStraight)
    }

    /// How many of the columns before the last one of a face are lost.
    pub(super) fn lost_before(&self, tip: &Face, last_x: f64, outward: Outward, pitch_mm: f64) -> usize {
        let limit_mm = Self::limit_mm(&[*tip], 0.0);
        let inward = |columns: f64| last_x - outward.sign() * columns * pitch_mm;
        let [near_x, far_x] = [inward(0.5), inward(COUNTED_COLUMNS as f64 + 0.5)];
        let before = |x: f64| self.points.partition_point(|point| point.x < x);
        let near = &self.points[before(near_x.min(far_x))..before(near_x.max(far_x))];
        COUNTED_COLUMNS.saturating_sub(near.iter().filter(|point| tip.off(point).abs() < limit_mm).count())
    }

    fn end_of_tip(&self, tip: &Face, from_outside: &FromOutside) -> Result<FaceEnd, NoSeam> {
        let limit_mm = Self::limit_mm(&[*tip], 0.0);
        let last_k = self.last_on(tip, limit_mm, from_outside)?;
        let (count, outward) = (from_outside.within.len(), from_outside.outward);
        let index = |k: usize| from_outside.index(k);
        let is_on = |point: &Vector2<f64>| tip.off(point).abs() < limit_mm;
        let on = |k: usize| is_on(&self.points[index(k)]);
        let last_x = self.points[index(last_k)].x;
        let from_end = |k: usize| (self.points[index(k)].x - last_x) * outward.sign();
        let steps = last_k..(last_k + PITCH_COLUMNS).min(count - 1);
        let mut steps: Vec<f64> = steps.map(|k| from_end(k) - from_end(k + 1)).collect();
        let pitch_mm = median(&mut steps);
        let behind =
            (0..last_k).rev().map(|k| [from_end(k), tip.off(&self.points[index(k)]).abs() - limit_mm]);
        let (behind_mm, is_bounded) = behind_end(behind, pitch_mm);
        if behind_mm[1] > MOST_ROUNDED_MM + pitch_mm {
            return Err(NoSeam::RoundedEnd);
        }
        let leaning_mm = LEANING_MM.max(FOOTHOLD as f64 * pitch_mm);
        let before = (last_k..count).take_while(|&k| -from_end(k) < leaning_mm).filter(|&k| on(k));
        if leans(before.map(|k| [from_end(k), tip.off(&self.points[index(k)])])) {
            return Err(NoSeam::RoundedEnd);
        }
        let lost = self.lost_before(tip, last_x, outward, pitch_mm);
        let last = tip.at_x(last_x).ok_or(NoSeam::NotStraight)?;
        let far = tip.at_x(last_x + outward.sign()).ok_or(NoSeam::NotStraight)?;
        let lost_part = lost_part([lost, COUNTED_COLUMNS]);
        let outward = far - last;
        Ok(FaceEnd {
            tip: Box::new(*tip),
            last,
            outward,
            behind_mm,
            pitch_mm,
            is_bounded,
            lost,
            lost_part,
            scatter: 1.0,
        })
    }
}

/// Whether columns (place along the face, and distance from its line, mm) surely deviate from the line more than a straight
/// face does.
fn leans(columns: impl Iterator<Item = [f64; 2]>) -> bool {
    let columns: Vec<[f64; 2]> = columns.collect();
    let count = columns.len() as f64;
    if columns.len() < FOOTHOLD / 2 {
        return false;
    }
    let mean = |axis: usize| columns.iter().map(|column| column[axis]).sum::<f64>() / count;
    let (middle, height) = (mean(0), mean(1));
    let sum = |of: &dyn Fn(f64, f64) -> f64| -> f64 {
        columns.iter().map(|[x, off]| of(x - middle, off - height)).sum()
    };
    let spread = sum(&|x, _| x * x);
    let slope = sum(&|x, off| x * off) / spread;
    let variance = sum(&|x, off| (off - slope * x).powi(2)) / (count - 2.0) / spread;
    slope.abs() > MOST_LEAN && slope * slope > LEAN_SIGMAS.powi(2) * variance
}

/// Range behind the last column on a face in which its edge may be, mm, and whether a column limits it. Each column behind
/// gives its distance, and its excess over the allowed distance from the face, mm.
fn behind_end(mut columns: impl Iterator<Item = [f64; 2]>, pitch_mm: f64) -> ([f64; 2], bool) {
    let mut to_mm = pitch_mm;
    let mut before_mm = 0.0;
    while let Some([ahead_mm, off_mm]) = columns.next() {
        let is_steep = off_mm > ahead_mm;
        // A face that bends away is the same one behind a few columns that are lost.
        let most_apart = if is_steep { NEXT_COLUMNS } else { BENT_COLUMNS };
        if ahead_mm - before_mm > most_apart * pitch_mm {
            break;
        }
        if is_steep {
            let follow = columns.next().is_some_and(|[next, _]| next - ahead_mm <= NEXT_COLUMNS * pitch_mm);
            let from_mm = if follow || before_mm > 0.0 { 0.0 } else { ahead_mm - 0.5 * pitch_mm };
            return ([from_mm, ahead_mm + 0.5 * pitch_mm], true);
        }
        to_mm = ahead_mm + pitch_mm;
        before_mm = ahead_mm;
    }
    ([0.0, to_mm], false)
}
