//! The regular clock of one stream's stamps, followed as long as the stream lasts.
//!
//! A calibration fits a line through stamps over ticks (see [`crate::input::clock_model`]). This module continues that line. Only the information of
//! old stamps is kept. New ones update the line as in Huber's estimate of the whole. A clock that restarts, after a pause or a step, keeps its rate
//! and gets a new phase.

use crate::input::clock_line::{FLOOR, HUBER_SIGMAS, LEAST_STEP_S, SILENCE_TICKS, STEP_SIGMAS, StreamClock};
use crate::order_statistics::{mad_sigma, median, quantile};
use nalgebra::{Matrix2, Vector2};

/// Stamps after a pause needed to verify that the clock continued. Fewer are not placed.
const FEWEST: usize = 5;
/// Number of independent stamps in a median. With more, the median follows the delays rather than the noise.
const INDEPENDENT: usize = 10;
/// A tick this far from the clock's other ticks, in periods, belongs to another phase.
const OTHER_PHASE: f64 = 0.01;

/// Maximum corners of a hull.
const MOST_CORNERS: usize = 1000;

/// A stamp: its reception, s since the scan's middle, and the device's own, s.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stamp {
    pub(super) received_s: f64,
    pub(super) device_s: Option<f64>,
}

/// A line through stamps.
#[derive(Clone, Debug)]
pub(super) struct EvenClock {
    /// Time of tick 0, s since the scan's middle.
    phase_s: f64,
    /// Tick period, s. With device stamps, a second of the device.
    period_s: f64,
    /// The device's stamp of tick 0, if ticks are device stamps, s.
    device_s: Option<f64>,
    /// Information on phase and period, in units of a stamp.
    information: Matrix2<f64>,
    /// Standard deviation of a stamp, s.
    sigma_s: f64,
    /// Lateness of the median stamp, s: the line of one-sided delays is their floor.
    late_s: f64,
    /// Lateness of the earliest tenth, s.
    least_s: f64,
    /// Start of the present phase, s.
    since_s: f64,
    /// Lower convex hull of the stamps over their ticks, with sum and number of ticks, if delays are one-sided.
    floor: Option<Floor>,
    /// The latest stamp used for an update, s.
    until_s: f64,
    /// Stamps since a pause, as long as they are too few.
    unsure: Option<Vec<Stamp>>,
}

#[derive(Clone, Debug, Default)]
struct Floor {
    hull: Vec<[f64; 2]>,
    ticks: f64,
    count: f64,
}

/// Motion of a line: all its ticks by `shift_s` at the scan's middle, plus `rate` times the time since then.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Moved {
    pub(super) shift_s: f64,
    pub(super) rate: f64,
    /// Whether it restarted. Earlier ticks do not move with it.
    pub(super) is_new: bool,
}

impl EvenClock {
    /// From a calibration: its stamps, and the sampling times, s since the scan's middle.
    pub(super) fn of(clock: &StreamClock, stamps: &[Stamp], regular_s: &[f64]) -> Option<Self> {
        let is_device = clock.device_drift_ppm.is_some();
        let device = |k: usize| stamps[k].device_s.filter(|_| is_device);
        let last = stamps.len() - 1;
        let rate = match (device(0), device(last)) {
            (Some(a), Some(b)) => (regular_s[last] - regular_s[0]) / (b - a),
            _ => clock.period_s,
        };
        // The last piece with one phase.
        let is_edge = |k: &usize| {
            let step_s = regular_s[*k] - regular_s[*k - 1];
            let ticks = match (device(*k - 1), device(*k)) {
                (Some(a), Some(b)) => b - a,
                _ => (step_s / rate).round(),
            };
            (step_s - ticks * rate).abs() > OTHER_PHASE * clock.period_s
        };
        let edge = (1..stamps.len()).rev().find(is_edge).unwrap_or(0);
        // Stamps before a removed step do not belong to this line.
        let since_s = regular_s[0] - clock.regular_s[0];
        let stepped_s = clock.steps.last().filter(|_| clock.step_taken_out).map(|(at_s, _)| at_s + since_s);
        let is_before = |stamp: &&Stamp| stepped_s.is_some_and(|at_s| stamp.received_s < at_s - 1e-9);
        let first = edge.max(stamps.iter().take_while(is_before).count());
        let about: Vec<f64> = (first..=last).map(|k| stamps[k].received_s - regular_s[k]).collect();
        let mut line = Self {
            phase_s: regular_s[first],
            period_s: rate,
            device_s: device(first),
            information: Matrix2::zeros(),
            sigma_s: mad_sigma(&about),
            late_s: 0.0,
            least_s: quantile(about.iter().copied(), FLOOR)?,
            since_s: stamps[first].received_s,
            floor: clock.is_one_sided().then(Floor::default),
            until_s: stamps[last].received_s,
            unsure: None,
        };
        if clock.is_one_sided() {
            line.late_s = median(about.iter().copied())?;
        }
        for (k, about_s) in (first..=last).zip(about) {
            let tick = (regular_s[k] - line.phase_s) / line.period_s;
            line.informed(tick, about_s);
            if let Some(floor) = &mut line.floor {
                floor.add(tick, stamps[k].received_s);
            }
        }
        Some(line).filter(|line| line.period_s.is_finite() && line.period_s > 0.0)
    }

    /// Distinct ticks of rising stamps.
    fn ticks(&self, stamps: &[Stamp]) -> Vec<f64> {
        let tick = |stamp: &Stamp| match (self.device_s, stamp.device_s) {
            (Some(first), Some(own)) => own - first,
            _ => ((stamp.received_s - self.late_s - self.phase_s) / self.period_s).round(),
        };
        let mut ticks: Vec<f64> = stamps.iter().map(tick).collect();
        if self.device_s.is_none() {
            set_apart(&mut ticks);
        }
        ticks
    }

    /// Whether it has had one phase since this stamp.
    pub(super) fn holds_since(&self, stamp: &Stamp) -> bool {
        self.since_s <= stamp.received_s
    }

    /// Whether stamps have the counters of its ticks.
    pub(super) fn can_place(&self, stamps: &[Stamp]) -> bool {
        self.device_s.is_none() || stamps.iter().all(|stamp| stamp.device_s.is_some())
    }

    /// Sampling times of these stamps, s since the scan's middle. `None` if this line does not determine them.
    pub(super) fn times_s(&self, stamps: &[Stamp]) -> Vec<Option<f64>> {
        let unsure_s = self.unsure.as_ref().and_then(|unsure| unsure.first()).map(|first| first.received_s);
        let is_known = |stamp: &Stamp| {
            stamp.received_s >= self.since_s && unsure_s.is_none_or(|first_s| stamp.received_s < first_s)
        };
        let time_s =
            |(tick, stamp): (f64, &Stamp)| is_known(stamp).then_some(self.phase_s + tick * self.period_s);
        self.ticks(stamps).into_iter().zip(stamps).map(time_s).collect()
    }

    /// Variance of its rate from the stamps' noise.
    pub(super) fn rate_variance(&self) -> f64 {
        let [a, b, c] = [self.information[(0, 0)], self.information[(0, 1)], self.information[(1, 1)]];
        let of_period = c - if a > 0.0 { b * b / a } else { 0.0 };
        self.sigma_s * self.sigma_s / of_period / (self.period_s * self.period_s)
    }

    /// Updates the line with the new ones among these rising stamps.
    pub(super) fn follow(&mut self, stamps: &[Stamp]) -> Moved {
        let new = &stamps[stamps.partition_point(|stamp| stamp.received_s <= self.until_s)..];
        let mut moved = Moved::default();
        let silence_s = SILENCE_TICKS * self.step_s(stamps);
        let mut run = Vec::new();
        for stamp in new {
            if stamp.received_s - self.until_s > silence_s {
                self.end_run(&mut run, &mut moved);
                self.unsure = Some(Vec::new());
            }
            run.push(*stamp);
            self.until_s = stamp.received_s;
        }
        self.end_run(&mut run, &mut moved);
        moved
    }

    fn step_s(&self, stamps: &[Stamp]) -> f64 {
        let steps = stamps.windows(2).map(|pair| pair[1].received_s - pair[0].received_s);
        median(steps).unwrap_or(self.period_s)
    }

    fn end_run(&mut self, run: &mut Vec<Stamp>, moved: &mut Moved) {
        let mut stamps = std::mem::take(run);
        if let Some(mut unsure) = self.unsure.take() {
            unsure.append(&mut stamps);
            if unsure.len() < FEWEST {
                self.unsure = Some(unsure);
                return;
            }
            stamps = unsure;
        }
        if stamps.is_empty() {
            return;
        }
        if let Some(height_s) = self.step_to(&stamps) {
            self.begin_anew(&stamps, height_s);
            *moved = Moved { is_new: true, ..Moved::default() };
        }
        let own = self.add(&stamps);
        *moved = Moved { shift_s: moved.shift_s + own.shift_s, rate: moved.rate + own.rate, ..*moved };
    }

    fn about_s(&self, stamps: &[Stamp]) -> Vec<f64> {
        let from = |(tick, stamp): (f64, &Stamp)| stamp.received_s - self.phase_s - tick * self.period_s;
        self.ticks(stamps).into_iter().zip(stamps).map(from).collect()
    }

    /// Distance of these stamps from the line, if significant.
    fn step_to(&self, stamps: &[Stamp]) -> Option<f64> {
        let about_s = self.about_s(stamps);
        let height_s = median(about_s.iter().copied())? - self.late_s;
        // A step moves the earliest stamps like the middle ones. Successive delays do not.
        let least_s = quantile(about_s.into_iter(), FLOOR)? - self.least_s;
        let count = stamps.len().min(INDEPENDENT) as f64;
        let limit_s = STEP_SIGMAS * (1.2533 * self.sigma_s / count.sqrt()).max(LEAST_STEP_S);
        let is_step = height_s.abs() > limit_s && least_s.abs() > 0.5 * limit_s;
        (stamps.len() >= FEWEST && is_step).then_some(height_s)
    }

    /// Keeps the rate with its information, and starts a new phase.
    fn begin_anew(&mut self, stamps: &[Stamp], height_s: f64) {
        let tick = self.ticks(stamps)[0];
        self.phase_s += tick * self.period_s + height_s;
        self.device_s = self.device_s.and(stamps[0].device_s);
        self.since_s = stamps[0].received_s;
        let [a, b, c] = [self.information[(0, 0)], self.information[(0, 1)], self.information[(1, 1)]];
        self.information = Matrix2::new(0.0, 0.0, 0.0, c - if a > 0.0 { b * b / a } else { 0.0 });
        // No floor lies under both phases. The new one is as far below its middle.
        self.floor = None;
    }

    fn informed(&mut self, tick: f64, about_s: f64) {
        if (about_s - self.late_s).abs() < HUBER_SIGMAS * self.sigma_s {
            self.information += Matrix2::new(1.0, tick, tick, tick * tick);
        }
    }

    /// Adds stamps of this phase.
    fn add(&mut self, stamps: &[Stamp]) -> Moved {
        let (ticks, about) = (self.ticks(stamps), self.about_s(stamps));
        let limit_s = HUBER_SIGMAS * self.sigma_s;
        let mut slope = Vector2::zeros();
        for (tick, about_s) in ticks.iter().zip(&about) {
            slope += Vector2::new(1.0, *tick) * (about_s - self.late_s).clamp(-limit_s, limit_s);
            self.informed(*tick, *about_s);
        }
        let before = [self.phase_s, self.period_s];
        let line = if let Some(floor) = &mut self.floor {
            ticks.iter().zip(stamps).for_each(|(tick, stamp)| floor.add(*tick, stamp.received_s));
            floor.line()
        } else {
            self.information.lu().solve(&slope).map(|step| [before[0] + step[0], before[1] + step[1]])
        };
        let Some(line) = line.filter(|line| line.iter().all(|x| x.is_finite()) && line[1] > 0.0) else {
            return Moved::default();
        };
        [self.phase_s, self.period_s] = line;
        // At time t the tick was (t − phase) / period.
        let rate = (line[1] - before[1]) / before[1];
        Moved { shift_s: line[0] - before[0] - rate * before[0], rate, is_new: false }
    }
}

/// If two stamps share one tick, the first was delayed if the previous tick is free. Otherwise the second came early.
fn set_apart(ticks: &mut [f64]) {
    for k in 1..ticks.len() {
        if ticks[k] > ticks[k - 1] {
            continue;
        }
        let is_free_below = k < 2 || ticks[k - 2] < ticks[k] - 1.0;
        let is_free_above = ticks.get(k + 1).is_none_or(|next| *next > ticks[k - 1] + 1.0);
        if is_free_below || !is_free_above {
            let below = ticks[..k]
                .iter()
                .rev()
                .zip(1..)
                .take_while(|(tick, back)| **tick > ticks[k] - f64::from(*back))
                .count();
            (1..=below).for_each(|back| ticks[k - back] = ticks[k] - back as f64);
        } else {
            ticks[k] = ticks[k - 1] + 1.0;
        }
    }
}

impl Floor {
    fn add(&mut self, tick: f64, stamp_s: f64) {
        self.ticks += tick;
        self.count += 1.0;
        while let [.., a, b] = self.hull[..] {
            if (b[0] - a[0]) * (stamp_s - a[1]) - (tick - a[0]) * (b[1] - a[1]) > 0.0 {
                break;
            }
            self.hull.pop();
        }
        self.hull.push([tick, stamp_s]);
        // Only a clock that keeps slowing down has this many corners. Half of them are sufficient.
        if self.hull.len() > MOST_CORNERS {
            let mut k = 0;
            self.hull.retain(|_| (k += 1, k % 2 == 1).1);
        }
    }

    /// Phase and period of the hull's edge above the middle tick.
    fn line(&self) -> Option<[f64; 2]> {
        let middle = self.ticks / self.count;
        let right = self.hull.iter().position(|point| point[0] >= middle)?.max(1);
        let (a, b) = (self.hull[right - 1], self.hull.get(right)?);
        let period_s = (b[1] - a[1]) / (b[0] - a[0]);
        Some([a[1] - a[0] * period_s, period_s])
    }
}
