//! Passes of the sensor over the curve, and the weave.
//!
//! If no place is seen twice, only the weave separates the curve from the hand-eye transform. The hand-eye transform is then not
//! determined, and the time offset only with knots that cannot follow the weave.

use crate::curve::equations::State;
use crate::curve::readings::Readings;
use crate::order_statistics::median;

/// A place is seen twice if two of its readings are this fraction of the scan's time apart.
const APART: f64 = 0.15;
/// The scan has one pass if less than this fraction of the places are seen twice.
const LEAST_TWICE: f64 = 0.4;
/// Length of a place, m.
const PLACE_M: f64 = 5e-3;
/// Range and step of the tested weave frequencies, Hz.
const WEAVES_HZ: (f64, f64, f64) = (0.6, 8.0, 0.02);
/// A weave causes most of the seam's motion in the sheet within this time, s …
const SWAYS_S: f64 = 1.5;
/// … at least this fraction of its variance.
const LEAST_OF_VARIANCE: f64 = 0.4;
/// A pass ends where the sensor goes back by this fraction of the curve: it sways by less.
const TURNED: f64 = 0.15;
/// A reading this fraction of the curve from the end of a pass may belong to the next: the sensor sways by that.
const NEAR_END: f64 = 0.04;
/// Knots nearer than this fraction of the length of a weave follow it.
const KNOTS_PER_WEAVE: f64 = 0.7;

/// The course of a scan along its curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Course {
    /// Whether no place is seen twice.
    pub is_one_pass: bool,
    /// Frequency of the weave, Hz; `None` without a weave.
    pub weave_hz: Option<f64>,
    /// Duration of the scan, s.
    pub lasts_s: f64,
}

impl Course {
    /// Of a scan at a state.
    #[must_use]
    pub(crate) fn of(readings: &Readings, state: &State) -> Self {
        Self {
            is_one_pass: is_one_pass(readings, state),
            weave_hz: weave_hz(readings),
            lasts_s: readings.lasts_s(),
        }
    }

    /// Travel of the sensor in one period of its weave over a curve of a length, m; `None` without a weave in a single pass.
    #[must_use]
    pub(crate) fn weave_m(&self, length_m: f64) -> Option<f64> {
        let is_single = self.is_one_pass && self.lasts_s > 0.0;
        is_single.then_some(length_m / self.lasts_s / self.weave_hz?)
    }

    /// Knots that do not follow the weave over a curve of a length, m; 0 if any knots may be used.
    #[must_use]
    pub(crate) fn least_knots_m(&self, length_m: f64) -> f64 {
        self.weave_m(length_m).map_or(0.0, |weave_m| KNOTS_PER_WEAVE * weave_m)
    }
}

/// Whether no place is seen twice.
#[must_use]
pub(crate) fn is_one_pass(readings: &Readings, state: &State) -> bool {
    twice(readings, state) < LEAST_TWICE
}

/// Fraction of the places that are seen twice.
fn twice(readings: &Readings, state: &State) -> f64 {
    let lasts_s = readings.lasts_s();
    let places = (state.spline.span_m() / PLACE_M).ceil().max(1.0) as usize;
    let mut last_s = vec![None::<f64>; places];
    let mut again = vec![false; places];
    for (reading, u_m) in readings.list.iter().zip(&state.u_m) {
        let place = ((u_m / PLACE_M) as usize).min(places - 1);
        again[place] |= last_s[place].is_some_and(|before_s| reading.stamp_s - before_s > APART * lasts_s);
        last_s[place] = Some(reading.stamp_s);
    }
    let seen = last_s.iter().filter(|last| last.is_some()).count().max(1);
    again.iter().filter(|again| **again).count() as f64 / seen as f64
}

/// Frequency of the weave, Hz; `None` if the seam does not sway in the sheet.
fn weave_hz(readings: &Readings) -> Option<f64> {
    let list = &readings.list;
    let sways = |axis: usize| -> Vec<(f64, f64)> {
        let about = |at_s: f64| {
            let from = list.partition_point(|r| r.stamp_s < at_s - 0.5 * SWAYS_S);
            let to = list.partition_point(|r| r.stamp_s <= at_s + 0.5 * SWAYS_S);
            median(list[from..to].iter().map(|r| r.in_sheet[axis])).unwrap_or(0.0)
        };
        list.iter().map(|r| (r.stamp_s, r.in_sheet[axis] - about(r.stamp_s))).collect()
    };
    let both = [sways(0), sways(1)];
    let variance = |series: &[(f64, f64)]| series.iter().map(|(_, v)| v * v).sum::<f64>();
    let all = variance(&both[0]) + variance(&both[1]);
    let power = |hz: f64| -> f64 {
        let of = |series: &[(f64, f64)]| {
            let (mut sine, mut cosine) = (0.0, 0.0);
            for (at_s, value) in series {
                let (s, c) = (std::f64::consts::TAU * hz * at_s).sin_cos();
                sine += s * value;
                cosine += c * value;
            }
            2.0 * (sine * sine + cosine * cosine) / series.len() as f64
        };
        of(&both[0]) + of(&both[1])
    };
    let (first_hz, last_hz, step_hz) = WEAVES_HZ;
    let steps = ((last_hz - first_hz) / step_hz) as usize;
    let tried = (0..=steps).map(|k| first_hz + k as f64 * step_hz).map(|hz| (hz, power(hz)));
    let (hz, strongest) = tried.max_by(|a, b| a.1.total_cmp(&b.1))?;
    (strongest > LEAST_OF_VARIANCE * all).then_some(hz)
}

/// Passes over a curve.
pub(crate) struct Passes {
    /// Pass of each reading.
    pub of: Vec<usize>,
    /// Whether a reading is so near the end of a pass that it may belong to the next.
    pub is_near_end: Vec<bool>,
}

impl Passes {
    /// From the place of each reading on the curve, m: there, back, and so on; on a closed curve each round.
    #[must_use]
    pub(crate) fn of(u_m: &[f64], span_m: f64, closed: bool) -> Self {
        if closed { Self::round(u_m, span_m) } else { Self::there_and_back(u_m, span_m) }
    }

    fn round(u_m: &[f64], span_m: f64) -> Self {
        let (mut round_m, mut before_m) = (0.0, u_m.first().copied().unwrap_or(0.0));
        let place = |u_m: &f64| {
            let step_m = u_m - before_m;
            round_m += step_m - span_m * (step_m / span_m).round();
            before_m = *u_m;
            let rounds: f64 = (round_m / span_m).abs();
            (rounds as usize, rounds > 0.5 && (rounds - rounds.round()).abs() < NEAR_END)
        };
        let (of, is_near_end) = u_m.iter().map(place).unzip();
        Self { of, is_near_end }
    }

    fn there_and_back(u_m: &[f64], span_m: f64) -> Self {
        let mut of = vec![0; u_m.len()];
        let mut ends_m = Vec::new();
        // The farthest reading in the present direction.
        let (mut farthest, mut forward, mut pass) = (0, None::<bool>, 0);
        for k in 0..u_m.len() {
            let gone_m = u_m[k] - u_m[farthest];
            match forward {
                None if gone_m.abs() > TURNED * span_m => (forward, farthest) = (Some(gone_m > 0.0), k),
                None => {}
                Some(ahead) if (gone_m > 0.0) == ahead => farthest = k,
                Some(ahead) if gone_m.abs() > TURNED * span_m => {
                    pass += 1;
                    of[farthest..k].fill(pass);
                    ends_m.push(u_m[farthest]);
                    (forward, farthest) = (Some(!ahead), k);
                }
                Some(_) => {}
            }
            of[k] = pass;
        }
        let is_near = |u_m: &f64| ends_m.iter().any(|end_m| (u_m - end_m).abs() < NEAR_END * span_m);
        Self { of, is_near_end: u_m.iter().map(is_near).collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn passes_end_where_the_sensor_turns_round() {
        let there = (0..100).map(|k| 0.2 * f64::from(k) / 99.0 + 0.004 * f64::from(k % 7) / 7.0);
        let there: Vec<f64> = there.collect();
        let back: Vec<f64> = there.iter().rev().copied().collect();
        let all = [there.clone(), back, there].concat();
        let found = Passes::of(&all, 0.2, false);
        for (k, pass) in found.of.iter().enumerate() {
            assert!(*pass == k / 100 || found.is_near_end[k], "{k}: {pass}");
            let from_end = (k % 100).min(99 - k % 100);
            assert!(!found.is_near_end[k] || from_end < 8, "{k}");
        }
        assert_eq!(found.of.last(), Some(&2));
        let round: Vec<f64> = (0..200).map(|k| (0.3 * f64::from(k) / 100.0 + 0.1).rem_euclid(0.3)).collect();
        let found = Passes::of(&round, 0.3, true);
        assert_eq!((found.of[50], found.of[90], found.of[150]), (0, 0, 1));
        assert!(
            found.is_near_end[99]
                && found.is_near_end[101]
                && !found.is_near_end[0]
                && !found.is_near_end[90]
        );
    }
}
