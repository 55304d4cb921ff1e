//! The search for the end of a face.

use super::face::Face;
use super::face_end::{COUNTED_COLUMNS, FaceEnd, Outward, lost_part};
use super::finder::ProfileFinder;
use super::no_seam::NoSeam;
use crate::measure::regression::median;
use nalgebra::Vector2;
use std::ops::Range;

/// Columns before the end of which half must be on the face: a reflection that lies on its line by chance is not.
const FOOTHOLD: usize = 10;
/// Columns further apart than this are not next to each other.
const NEXT_COLUMNS: f64 = 1.5;
/// And further apart than this they are not of one face that bends away.
const BENT_COLUMNS: f64 = 4.5;
/// A rounded edge of more is none, mm.
const MOST_ROUNDED_MM: f64 = 1.0;
/// A face whose last columns lean away from its line by more, and by so many standard deviations, bends before its end: 9°.
const MOST_LEAN: f64 = 0.15;
const LEAN_SIGMAS: f64 = 4.0;
/// Last columns that are looked at for that: those within so many mm, and no fewer than so many.
const LEANING_MM: f64 = 1.0;
/// Columns from which their distance is taken.
const PITCH_COLUMNS: usize = 41;

impl ProfileFinder {
    /// The end of a face to one side among a range of the points; what is within `limit_mm` of its line is on it.
    pub(super) fn face_end(
        &self,
        face: &Face,
        limit_mm: f64,
        within: Range<usize>,
        outward: Outward,
    ) -> Result<FaceEnd, NoSeam> {
        let (start, count) = (within.start, within.len());
        // The k-th point from the far side.
        let index = |k: usize| match outward {
            Outward::Left => start + k,
            Outward::Right => start + count - 1 - k,
        };
        let is_on = |point: &Vector2<f64>| face.off(point).abs() < limit_mm;
        let on = |k: usize| is_on(&self.points[index(k)]);
        let has_foothold = |k: usize| {
            let before = (k..(k + FOOTHOLD).min(count)).filter(|&k| on(k)).count();
            on(k) && 2 * before >= FOOTHOLD
        };
        let last_k = (0..count).find(|&k| has_foothold(k)).ok_or(NoSeam::NotStraight)?;
        let last_x = self.points[index(last_k)].x;
        let from_end = |k: usize| (self.points[index(k)].x - last_x) * outward.sign();
        let steps = last_k..(last_k + PITCH_COLUMNS).min(count - 1);
        let mut steps: Vec<f64> = steps.map(|k| from_end(k) - from_end(k + 1)).collect();
        let pitch_mm = median(&mut steps);
        let behind =
            (0..last_k).rev().map(|k| [from_end(k), face.off(&self.points[index(k)]).abs() - limit_mm]);
        let (behind_mm, is_bounded) = behind_end(behind, pitch_mm);
        if behind_mm[1] > MOST_ROUNDED_MM + pitch_mm {
            return Err(NoSeam::RoundedEnd);
        }
        let leaning_mm = LEANING_MM.max(FOOTHOLD as f64 * pitch_mm);
        let before = (last_k..count).take_while(|&k| -from_end(k) < leaning_mm).filter(|&k| on(k));
        if leans(before.map(|k| [from_end(k), face.off(&self.points[index(k)])])) {
            return Err(NoSeam::RoundedEnd);
        }
        let reach_mm = (COUNTED_COLUMNS as f64 + 0.5) * pitch_mm;
        let near = (last_k + 1..count).take_while(|&k| -from_end(k) < reach_mm);
        let there = near.filter(|&k| is_on(&self.points[index(k)])).count();
        let lost = COUNTED_COLUMNS.saturating_sub(there);
        let last = face.at_x(last_x).ok_or(NoSeam::NotStraight)?;
        let far = face.at_x(last_x + outward.sign()).ok_or(NoSeam::NotStraight)?;
        let lost_part = lost_part([lost, COUNTED_COLUMNS]);
        let outward = far - last;
        Ok(FaceEnd { last, outward, behind_mm, pitch_mm, is_bounded, lost, lost_part, scatter: 1.0 })
    }
}

/// Whether columns (where along the face, and how far off its line, mm) surely lean away from the line by more than a straight face does.
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

/// From where to where behind the last column on a face its edge may be, mm, by the columns behind it (how far each is, and by how much more than the last may be it is off the face, mm); and
/// whether one of these says so.
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
