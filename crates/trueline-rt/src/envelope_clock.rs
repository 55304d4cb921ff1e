//! The even clock behind stamps of arrival, on line: samples are dated by the line along the earliest arrivals.
//!
//! A queue or a busy network delays packets and never makes them early. Of each [`BLOCK`] samples the least delayed one counts; a line
//! through those of the last [`BLOCKS`] blocks, lowered until none is below it, follows the drift of the source's clock.

use crate::steps::Steps;

/// Number of samples in a block; the earliest counts.
const BLOCK: usize = 16;
/// Blocks that the line goes along.
const BLOCKS: usize = 32;
/// Samples from which the first line is made.
const LEARNT: usize = 4 * BLOCK;
/// A sample this part of a period before its tick belongs to the tick before.
const EARLY: f64 = 0.25;
/// A line through this many blocks is half as certain as one through many.
const FEW: f64 = 8.0;
/// Part of a sample's lateness by which the count of the first ones follows it.
const FOLLOW: f64 = 0.1;
/// A step of more periods than this is a silence: the data after it may be a queue.
const SILENCE: f64 = 1.75;
/// A block that is later than the line by this many times the scatter of blocks, and by [`JUMP_PERIODS`], shows a jump of
/// the clock.
const JUMP_SIGMAS: f64 = 8.0;
/// See [`JUMP_SIGMAS`].
const JUMP_PERIODS: f64 = 0.1;
/// How fast the usual lateness is forgotten, per block.
const FORGET: f64 = 0.95;

/// How far a sample's date can be relied upon.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Trust {
    /// It is that of its tick.
    Sure,
    /// It came after a silence: the next one shows whether samples were lost or late.
    AfterSilence,
    /// It came before its tick, which nothing does: those since the silence were late.
    QueuedBefore,
}

/// When a sample was taken.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Dated {
    /// Time, s from the clock's origin.
    pub time_s: f64,
    /// Standard deviation of it, s.
    pub sigma_s: f64,
    /// How late the sample arrived, s.
    pub late_s: f64,
    pub trust: Trust,
}

/// The earliest sample of a block: its tick, and its arrival less the tick's nominal time, s.
#[derive(Clone, Copy, Debug, Default)]
struct Earliest {
    tick: f64,
    residual_s: f64,
}

/// The clock. Times are seconds from an origin of the caller's.
#[derive(Clone, Debug)]
pub(crate) struct EnvelopeClock {
    arrivals: [f64; LEARNT],
    learnt: usize,
    /// Nominal time between ticks, s.
    period_s: f64,
    tick: f64,
    last_s: f64,
    blocks: [Earliest; BLOCKS],
    filled: usize,
    current: Earliest,
    in_current: usize,
    current_latest_s: f64,
    /// Residual of the line at tick 0, s, and its slope, s per tick.
    line: [f64; 2],
    scatter_s: f64,
    usual_late_s: f64,
    /// Whether a queue is being worked off since a silence.
    in_queue: bool,
    jumps: u32,
}

impl EnvelopeClock {
    pub(crate) fn new() -> Self {
        Self {
            arrivals: [0.0; LEARNT],
            learnt: 0,
            period_s: 0.0,
            tick: 0.0,
            last_s: f64::NEG_INFINITY,
            blocks: [Earliest::default(); BLOCKS],
            filled: 0,
            current: Earliest::default(),
            in_current: 0,
            current_latest_s: 0.0,
            line: [0.0; 2],
            scatter_s: 0.0,
            usual_late_s: 0.0,
            in_queue: false,
            jumps: 0,
        }
    }

    /// Forgets all but how often it jumped.
    fn restart(&mut self) {
        *self = Self { jumps: self.jumps + 1, ..Self::new() };
    }

    /// Whether the clock is known.
    pub(crate) fn is_settled(&self) -> bool {
        self.learnt == LEARNT
    }

    /// Time between ticks by the receiver's clock, s; zero if unknown yet.
    pub(crate) fn period_s(&self) -> f64 {
        self.period_s + self.line[1]
    }

    /// Largest usual delay of a sample, s.
    pub(crate) fn usual_late_s(&self) -> f64 {
        self.usual_late_s
    }

    /// Number of jumps of the clock.
    pub(crate) fn jumps(&self) -> u32 {
        self.jumps
    }

    /// Moves the origin of times later by this, s.
    pub(crate) fn rebase(&mut self, by_s: f64) {
        self.last_s -= by_s;
        self.line[0] -= by_s;
        self.current.residual_s -= by_s;
        self.blocks.iter_mut().for_each(|block| block.residual_s -= by_s);
        self.arrivals.iter_mut().for_each(|arrival| *arrival -= by_s);
    }

    /// The date of a sample that arrived now; `None` while the clock is being learnt.
    pub(crate) fn date(&mut self, arrival_s: f64) -> Option<Dated> {
        if arrival_s < self.last_s {
            self.restart();
        }
        let step_s = arrival_s - self.last_s;
        self.last_s = arrival_s;
        if !self.is_settled() {
            self.learn(arrival_s);
            return None;
        }
        let period_s = self.period_s();
        let ticks = (arrival_s - self.at(self.tick)) / period_s + EARLY;
        let is_before_its_tick = ticks < 1.0;
        self.tick += ticks.floor().max(1.0);
        let mut late_s = arrival_s - self.at(self.tick);
        let is_silence = step_s > SILENCE * period_s;
        self.in_queue = is_silence || (self.in_queue && step_s < (1.0 - EARLY) * period_s);
        let trust = match (is_before_its_tick, self.in_queue) {
            (true, _) => {
                // Recounted by the arrival itself, which is late at most.
                self.tick -= (1.0 - ticks.floor()).max(0.0);
                late_s = arrival_s - self.at(self.tick);
                self.in_queue = true;
                Trust::QueuedBefore
            }
            (false, true) => Trust::AfterSilence,
            (false, false) => Trust::Sure,
        };
        let time_s = self.at(self.tick);
        let sigma_s = self.scatter_s + (late_s - self.usual_late_s).max(0.0);
        self.note(arrival_s, late_s);
        Some(Dated { time_s, sigma_s, late_s, trust })
    }

    /// Time of a tick, s.
    fn at(&self, tick: f64) -> f64 {
        tick * self.period_s + self.line[0] + self.line[1] * tick
    }

    fn learn(&mut self, arrival_s: f64) {
        self.arrivals[self.learnt] = arrival_s;
        self.learnt += 1;
        if self.learnt < LEARNT {
            return;
        }
        let mut steps = Steps::new();
        self.arrivals.windows(2).for_each(|pair| steps.push(pair[1] - pair[0]));
        let Some(usual_s) = steps.median_s() else {
            self.learnt = 0;
            return;
        };
        let first_s = self.arrivals[0];
        let mut ticks = [0.0; LEARNT];
        // Ticks are counted from a place that follows the stamps slowly: a single late one moves it by little.
        let (mut tick, mut at_s) = (0.0, first_s);
        for (arrival_s, ticked) in self.arrivals.iter().zip(&mut ticks).skip(1) {
            let steps = ((arrival_s - at_s) / usual_s + EARLY).floor().max(1.0);
            tick += steps;
            at_s += steps * usual_s;
            at_s += FOLLOW * (arrival_s - at_s);
            *ticked = tick;
        }
        let (_, slope) = line_through(ticks.iter().copied().zip(self.arrivals.iter().copied()));
        self.period_s = slope;
        self.line = [0.0; 2];
        let arrivals = self.arrivals;
        for (tick, arrival_s) in ticks.into_iter().zip(arrivals) {
            self.tick = tick;
            let late_s = arrival_s - first_s - tick * slope;
            self.note_in_block(arrival_s, late_s);
        }
        self.fit();
        self.usual_late_s =
            ticks.iter().zip(&arrivals).map(|(tick, arrival)| arrival - self.at(*tick)).fold(0.0, f64::max);
    }

    fn note(&mut self, arrival_s: f64, late_s: f64) {
        if !self.note_in_block(arrival_s, late_s) {
            return;
        }
        let newest = self.newest();
        let late_s = newest.tick * self.period_s + newest.residual_s - self.at(newest.tick);
        if late_s > (JUMP_SIGMAS * self.scatter_s).max(JUMP_PERIODS * self.period_s) {
            self.restart();
            return;
        }
        self.fit();
        self.usual_late_s = (self.usual_late_s * FORGET).max(self.current_latest_s);
        self.current_latest_s = 0.0;
    }

    /// Whether the sample completed a block.
    fn note_in_block(&mut self, arrival_s: f64, late_s: f64) -> bool {
        let residual_s = arrival_s - self.tick * self.period_s;
        if self.in_current == 0 || residual_s < self.current.residual_s {
            self.current = Earliest { tick: self.tick, residual_s };
        }
        self.current_latest_s = self.current_latest_s.max(late_s);
        self.in_current += 1;
        if self.in_current < BLOCK {
            return false;
        }
        self.blocks[self.filled % BLOCKS] = self.current;
        self.filled += 1;
        self.in_current = 0;
        true
    }

    fn newest(&self) -> Earliest {
        self.blocks[(self.filled + BLOCKS - 1) % BLOCKS]
    }

    fn fit(&mut self) {
        let blocks = &self.blocks[..self.filled.min(BLOCKS)];
        let points = || blocks.iter().map(|block| (block.tick, block.residual_s));
        let (at_zero, slope) = line_through(points());
        let above = |(tick, residual_s): (f64, f64)| residual_s - (at_zero + slope * tick);
        let lowest = points().map(above).fold(f64::INFINITY, f64::min);
        let squares: f64 = points().map(|point| above(point).powi(2)).sum();
        let scatter_s = (squares / blocks.len().saturating_sub(2).max(1) as f64).sqrt();
        // A line through few blocks is less certain beyond them.
        self.scatter_s = scatter_s * (1.0 + FEW / blocks.len() as f64);
        self.line = [at_zero + lowest, slope];
    }
}

/// The least-squares line: its value at zero and its slope; level if all points are at one place.
fn line_through(points: impl Iterator<Item = (f64, f64)> + Clone) -> (f64, f64) {
    let (count, sum_x, sum_y) =
        points.clone().fold((0.0, 0.0, 0.0), |(n, sx, sy), (x, y)| (n + 1.0, sx + x, sy + y));
    let (mean_x, mean_y) = (sum_x / count, sum_y / count);
    let (xx, xy) = points
        .fold((0.0, 0.0), |(xx, xy), (x, y)| (xx + (x - mean_x).powi(2), xy + (x - mean_x) * (y - mean_y)));
    let slope = if xx > 0.0 { xy / xx } else { 0.0 };
    (mean_y - slope * mean_x, slope)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    const PERIOD_S: f64 = 0.004;
    const JITTER_S: f64 = 0.0005;

    /// Exponential delays, a drift of 50 ppm, one lost in 50.
    fn arrivals(count: usize, seed: u64) -> Vec<(f64, f64)> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut list = Vec::new();
        for k in 0..count {
            let taken_s = 3.0 + k as f64 * PERIOD_S * (1.0 + 50e-6);
            let delay_s = -JITTER_S * (1.0 - random.random::<f64>()).ln();
            if random.random::<f64>() > 0.02 {
                list.push((taken_s, taken_s + delay_s.min(0.7 * PERIOD_S)));
            }
        }
        list
    }

    /// The least of 512 exponential delays is 1 µs on average, of 16 it is 31 µs: the line is within a few of these.
    #[test]
    fn jitter_and_drift_are_taken_out() {
        let mut clock = EnvelopeClock::new();
        let mut errors = Vec::new();
        for (taken_s, arrival_s) in arrivals(20_000, 1) {
            if let Some(dated) = clock.date(arrival_s)
                && dated.trust == Trust::Sure
            {
                errors.push((dated.time_s - taken_s) / dated.sigma_s);
                assert!((dated.time_s - taken_s).abs() < 0.2 * JITTER_S, "{}", dated.time_s - taken_s);
            }
        }
        assert!(errors.len() > 18_000, "{}", errors.len());
        let outside = errors.iter().filter(|error| error.abs() > 3.0).count();
        assert!(outside < errors.len() / 100, "{outside} of {}", errors.len());
        assert!((clock.period_s() / PERIOD_S - 1.0 - 50e-6).abs() < 50e-6);
    }

    #[test]
    fn a_queue_after_a_silence_is_no_run_of_sure_samples() {
        let mut clock = EnvelopeClock::new();
        let mut all = arrivals(2_000, 2);
        // Eight samples wait until the last of them is there.
        let until_s = all[1_500].1;
        for (k, (_, arrival_s)) in all[1_490..1_500].iter_mut().enumerate() {
            *arrival_s = until_s - 1e-5 * (10 - k) as f64;
        }
        for (taken_s, arrival_s) in all {
            if let Some(dated) = clock.date(arrival_s)
                && dated.trust == Trust::Sure
            {
                assert!(
                    (dated.time_s - taken_s).abs() < 4.0 * dated.sigma_s + 0.2 * JITTER_S,
                    "{taken_s}: {}",
                    dated.time_s - taken_s
                );
            }
        }
    }

    #[test]
    fn a_jump_forward_is_found_within_a_block_and_a_half() {
        let mut clock = EnvelopeClock::new();
        let mut wrong = 0;
        for (k, (taken_s, arrival_s)) in arrivals(3_000, 3).into_iter().enumerate() {
            let jump_s = if k >= 1_500 { 0.001 } else { 0.0 };
            if let Some(dated) = clock.date(arrival_s + jump_s)
                && (dated.time_s - taken_s - jump_s).abs() > 4.0 * dated.sigma_s + 1e-4
                && dated.trust == Trust::Sure
            {
                wrong += 1;
            }
        }
        assert_eq!(clock.jumps(), 1);
        // Within the usual lateness a jump looks like a delay until a whole block shows it.
        assert!(wrong <= 2 * BLOCK, "{wrong}");
    }

    #[test]
    fn a_clock_that_goes_back_begins_anew() {
        let mut clock = EnvelopeClock::new();
        for (_, arrival_s) in arrivals(200, 4) {
            clock.date(arrival_s);
        }
        assert!(clock.is_settled());
        assert!(clock.date(1.0).is_none() && clock.jumps() == 1);
    }
}
