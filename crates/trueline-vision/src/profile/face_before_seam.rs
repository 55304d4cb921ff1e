//! End of a face before a seam: a bead, a throat or a rounded edge may lie between.
//!
//! Two millimetres are always left out. If columns between the faces are assigned to a face, they bend it, or its last
//! columns leave it: columns are left out until the face is straight. A face with an even bend is not a straight one with
//! something beside it: the bend of the remaining stretch decides. If no stretch is straight, the likelihood decides. A
//! column on the face has a normal error, of the estimated size. One beyond the face's end may be anywhere. One on the face
//! that may be anywhere is false, and rare.

use super::face::Face;
use super::face_end::Outward;
use super::finder::{FACE_POINTS, ProfileFinder, left_out_mm};
use std::ops::Range;

/// Range of columns beyond the end of a face, mm.
const ANYWHERE_MM: f64 = 3.0;
/// Part of the columns of a face that are false.
const FALSE_PART: f64 = 0.03;
/// Logarithm of the root of 2π.
const LOG_NORMAL: f64 = 0.918_938_533_204_672_7;
/// Factor between the omitted parts of successive trials, at most this part of the face.
const STEP: f64 = 1.3;
const MOST_LEFT_OUT: f64 = 0.6;
/// A face with a scatter of more times its noise has columns of something else.
const SCATTER: f64 = 1.5;
/// False columns at the end of a face beyond which they are not chance.
const FALSE_AT_END: f64 = 2.0;
/// A stretch is straight, and not bent like all of the face, where the squares of both differ by more: three standard deviations.
const STRAIGHTER: f64 = 9.0;
/// Rounds in which the seam settles to this distance, mm.
const ROUNDS: usize = 3;
const NEAR_MM: f64 = 0.5;

/// The side of a seam that is roughly at a place.
#[derive(Clone, Copy)]
struct Side {
    x_mm: f64,
    outward: Outward,
    /// Length of the face along x, mm.
    length_mm: f64,
}

/// A face, and how much is left out between it and the seam, mm.
#[derive(Clone, Copy)]
struct Trial {
    left_out_mm: f64,
    face: Face,
}

impl ProfileFinder {
    /// The faces on either side of a seam at a rough place, up to their ends before it, and their crossing.
    pub(super) fn faces_before(&mut self, mut x_mm: f64, sigma_mm: f64) -> Option<([Face; 2], f64)> {
        let mut faces = self.both_before(x_mm, sigma_mm)?;
        for _ in 0..ROUNDS {
            // A bead draws the rough faces away from their crossing.
            let Some(corner) = faces[0].line.meets(&faces[1].line) else { break };
            if (corner.x - x_mm).abs() < NEAR_MM || !self.has_faces_beside(corner.x) {
                break;
            }
            x_mm = corner.x;
            faces = self.both_before(x_mm, sigma_mm)?;
        }
        Some((faces, x_mm))
    }

    fn has_faces_beside(&self, x_mm: f64) -> bool {
        let left = self.points.partition_point(|point| point.x < x_mm);
        left >= 2 * FACE_POINTS && left + 2 * FACE_POINTS <= self.points.len()
    }

    fn both_before(&mut self, x_mm: f64, sigma_mm: f64) -> Option<[Face; 2]> {
        let (first, last) = (self.points.first()?.x, self.points.last()?.x);
        let left = Side { x_mm, outward: Outward::Right, length_mm: x_mm - first };
        let right = Side { x_mm, outward: Outward::Left, length_mm: last - x_mm };
        Some([self.face_before(&left, sigma_mm)?, self.face_before(&right, sigma_mm)?])
    }

    /// The face on one side of a seam.
    fn face_before(&mut self, side: &Side, sigma_mm: f64) -> Option<Face> {
        let usual = self.trial(side, left_out_mm(side.length_mm))?;
        if self.is_straight_to_end(side, &usual, sigma_mm) {
            return Some(usual.face);
        }
        let mut trials = vec![usual];
        let straight = loop {
            let left_out_mm = trials[trials.len() - 1].left_out_mm * STEP;
            if left_out_mm > MOST_LEFT_OUT * side.length_mm {
                break None;
            }
            let Some(trial) = self.trial(side, left_out_mm) else { break None };
            trials.push(trial);
            if self.is_straight_but_for_the_end(side, &trials, trials.len() - 1, sigma_mm) {
                break Some(trials.len() - 1);
            }
        };
        let chosen = straight.unwrap_or_else(|| self.straightest(side, &trials, sigma_mm));
        if chosen == 0 {
            return Some(usual.face);
        }
        // A smooth deviation from the face begins before it is visible: one step more.
        let more = self.trial(side, trials[chosen].left_out_mm * STEP);
        Some(more.unwrap_or(trials[chosen]).face)
    }

    /// Number of the trial to take if none is straight by the noise of single columns: noise shared by neighbours exceeds
    /// their differences.
    fn straightest(&self, side: &Side, trials: &[Trial], sigma_mm: f64) -> usize {
        let least_mm = trials.iter().map(|trial| trial.face.spread_mm()).fold(f64::INFINITY, f64::min);
        let sigma_mm = sigma_mm.max(least_mm);
        let straight =
            (1..trials.len()).find(|&k| self.is_straight_but_for_the_end(side, trials, k, sigma_mm));
        match straight {
            _ if self.is_straight_to_end(side, &trials[0], sigma_mm) => 0,
            Some(straight) => straight,
            None if self.is_even(side, &trials[0], sigma_mm) => 0,
            None => self.likeliest(side, trials, sigma_mm),
        }
    }

    fn is_straight_to_end(&self, side: &Side, trial: &Trial, sigma_mm: f64) -> bool {
        !trial.face.is_bent() && self.is_even(side, trial, sigma_mm)
    }

    /// Whether a trial is straight, and no stretch of a face that is bent alike all along.
    fn is_straight_but_for_the_end(&self, side: &Side, trials: &[Trial], k: usize, sigma_mm: f64) -> bool {
        let (usual, face) = (&trials[0], &trials[k].face);
        let is_straight = self.is_straight_to_end(side, &trials[k], sigma_mm);
        let is_one_bend = || usual.face.is_bent() && face.is_bent_like(&usual.face);
        // Noise shared by neighbouring columns exceeds their differences, in both in the same way.
        let shared_mm = sigma_mm.max(face.spread_mm());
        is_straight && !(is_one_bend() && self.is_even(side, usual, shared_mm))
    }

    fn trial(&mut self, side: &Side, left_out_mm: f64) -> Option<Trial> {
        let run = self.run_before(side, left_out_mm);
        let end_x = Some(side.x_mm - side.outward.sign() * left_out_mm);
        let ends_x = match side.outward {
            Outward::Right => [None, end_x],
            Outward::Left => [end_x, None],
        };
        if run.len() < FACE_POINTS {
            return None;
        }
        let face = self.face_without_bow(run.start, run.end, ends_x)?;
        Some(Trial { left_out_mm, face })
    }

    /// The run of the points on one side of a seam, but for the last millimetres before it.
    fn run_before(&self, side: &Side, left_out_mm: f64) -> Range<usize> {
        let end_x = side.x_mm - side.outward.sign() * left_out_mm;
        let end = self.points.partition_point(|point| point.x < end_x);
        match side.outward {
            Outward::Right => 0..end,
            Outward::Left => end..self.points.len(),
        }
    }

    /// Whether a face scatters by its noise, to its end.
    fn is_even(&self, side: &Side, trial: &Trial, sigma_mm: f64) -> bool {
        let price = Price::of(&trial.face, sigma_mm);
        if price.spread_mm > SCATTER * sigma_mm {
            return false;
        }
        let run = self.run_before(side, trial.left_out_mm);
        let from_end = (0..run.len()).map(|k| match side.outward {
            Outward::Right => run.end - 1 - k,
            Outward::Left => run.start + k,
        });
        let (mut gained, mut most) = (0.0, 0.0_f64);
        for k in from_end {
            gained += price.on_face(trial.face.off_surface(&self.points[k])) - price.beyond;
            most = most.max(gained);
        }
        most < -FALSE_AT_END * FALSE_PART.ln()
    }

    /// Number of the trial that explains the columns best.
    fn likeliest(&self, side: &Side, trials: &[Trial], sigma_mm: f64) -> usize {
        let count = self.run_before(side, 0.0).len();
        let cost = |trial: &Trial| {
            let (price, run) = (Price::of(&trial.face, sigma_mm), self.run_before(side, trial.left_out_mm));
            let left_out = price.beyond * (count - run.len()) as f64;
            self.points[run].iter().map(|point| price.on_face(trial.face.off_surface(point))).sum::<f64>()
                + left_out
        };
        let costs = trials.iter().map(cost).enumerate();
        costs.min_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(k, _)| k)
    }
}

impl Face {
    /// Scatter of its columns about its surface, mm.
    pub(super) fn spread_mm(&self) -> f64 {
        self.bow.map_or(self.regression.sigma_px, |bow| bow.spread_mm)
    }

    /// Whether a stretch of a face may as well be bent like all of it as be straight.
    fn is_bent_like(&self, whole: &Self) -> bool {
        let (Some(own), Some(whole)) = (self.bow, whole.bow) else { return false };
        let variance_mm2 = self.regression.variance_at(own.place.middle);
        own.square_if_bent_like(&whole, variance_mm2) < own.squares(1.0, variance_mm2) + STRAIGHTER
    }
}

/// Negative logarithms of how likely a column is.
struct Price {
    spread_mm: f64,
    beyond: f64,
}

impl Price {
    fn of(face: &Face, sigma_mm: f64) -> Self {
        Self { spread_mm: face.spread_mm().max(sigma_mm), beyond: ANYWHERE_MM.ln() }
    }

    /// For a column of the face at this distance from it.
    fn on_face(&self, off_mm: f64) -> f64 {
        let normal = 0.5 * (off_mm / self.spread_mm).powi(2) + self.spread_mm.ln() + LOG_NORMAL;
        normal.min(self.beyond - FALSE_PART.ln())
    }
}
