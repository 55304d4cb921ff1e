//! How an estimate has grown, and how fast pictures and poses come.

use std::collections::VecDeque;
use trueline_cell::Estimated;

/// Points of a growth; of more, every second one is dropped.
const MOST: usize = 512;
/// Rates are those of the last seconds, this many.
const RECENT_S: f64 = 5.0;

/// A plotted estimate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Point {
    /// Since the page began, s.
    pub at_s: f64,
    /// Time offset and its standard deviation, s; NaN if unknown yet.
    pub time_offset_s: [f64; 2],
    /// Largest standard deviation of the hand-eye translation, m; NaN if unknown yet.
    pub translation_sigma_m: f64,
    /// Largest standard deviation of the hand-eye rotation, rad; NaN if unknown yet.
    pub rotation_sigma_rad: f64,
}

/// An estimate as it grew.
#[derive(Clone, Debug, Default)]
pub(super) struct Growth {
    points: Vec<Point>,
    seam_points: usize,
}

impl Growth {
    /// Adds an estimate if it is another one than the last.
    pub(super) fn add(&mut self, at_s: f64, estimated: &Estimated) {
        if estimated.seam_points == self.seam_points {
            return;
        }
        self.seam_points = estimated.seam_points;
        if self.points.len() == MOST {
            let mut keep = false;
            self.points.retain(|_| {
                keep = !keep;
                keep
            });
        }
        self.points.push(Point {
            at_s,
            time_offset_s: estimated.time_offset_s.unwrap_or([f64::NAN; 2]),
            translation_sigma_m: estimated.translation_sigma_m.unwrap_or(f64::NAN),
            rotation_sigma_rad: estimated.rotation_sigma_rad.unwrap_or(f64::NAN),
        });
    }

    /// The points in order of time.
    #[must_use]
    pub(super) fn points(&self) -> &[Point] {
        &self.points
    }
}

/// A count as it grew lately.
#[derive(Clone, Debug, Default)]
pub(super) struct Rate {
    counts: VecDeque<(f64, u64)>,
}

impl Rate {
    /// Adds a counter's reading.
    pub(super) fn add(&mut self, at_s: f64, count: u64) {
        while self.counts.len() > 1
            && self.counts.front().is_some_and(|(first_s, _)| at_s - first_s > RECENT_S)
        {
            self.counts.pop_front();
        }
        self.counts.push_back((at_s, count));
    }

    /// How many a second; `None` before two looks.
    #[must_use]
    pub(super) fn hz(&self) -> Option<f64> {
        let ((first_s, first), (last_s, last)) = (self.counts.front()?, self.counts.back()?);
        (last_s > first_s).then(|| last.saturating_sub(*first) as f64 / (last_s - first_s))
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;

    #[test]
    fn a_rate_is_that_of_the_last_seconds() {
        let mut rate = Rate::default();
        assert_eq!(rate.hz(), None);
        // 100 Hz for 20 s, then nothing.
        (0..100).for_each(|k| rate.add(0.2 * f64::from(k), 20 * k as u64));
        assert!((rate.hz().unwrap() - 100.0).abs() < 1e-6);
        (100..140).for_each(|k| rate.add(0.2 * f64::from(k), 1980));
        assert_eq!(rate.hz(), Some(0.0));
    }

    #[test]
    fn a_long_growth_keeps_its_beginning_and_its_end() {
        let mut growth = Growth::default();
        for k in 0..5000_u32 {
            let estimated = Estimated {
                seam_points: 30 + k as usize / 2,
                time_offset_s: None,
                translation_sigma_m: None,
                rotation_sigma_rad: None,
                is_enough: None,
                advice: Vec::new(),
            };
            growth.add(f64::from(k), &estimated);
        }
        let points = growth.points();
        // Every second call brought nothing new.
        assert!((MOST / 2..=MOST).contains(&points.len()), "{}", points.len());
        assert_eq!((points[0].at_s, points.last().unwrap().at_s), (0.0, 4998.0));
    }
}
