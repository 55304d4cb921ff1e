//! The values of an external axis that have arrived, and its value between them.
//!
//! Cubic pieces through the values give value and rate, as in the estimate. The distance of a value from the
//! cubic through its neighbours measures the noise of the stream (encoder, stamps). A value with a larger
//! distance is an outlier, and the ± around it contain it.

use crate::envelope_clock::{EnvelopeClock, Trust};
use crate::error::{AxisError, AxisProblem};
use crate::settings::{Settings, StampRule};
use crate::stamps::{self, is_stamp, seconds};
use crate::steps::Steps;
use trueline_geometry::AxisKind;
use trueline_geometry::trajectory::GAP_PERIODS;

/// Values before anything is placed.
const FEWEST_VALUES: usize = 9;
/// A step of more periods than this bridges lost values.
const LOST: f64 = 1.5;
/// A value further off its neighbours than this many times the noise is an outlier.
const OUTLYING: f64 = 6.0;
/// Residuals over which the noise is averaged.
const NOISE_VALUES: f64 = 256.0;
/// Number of residuals that give the noise.
const NOISE_KNOWN: usize = 16;
/// Largest weight of one residual, in standard deviations, once [`NOISE_KNOWN`] are known.
const MOST_SIGMAS: f64 = 5.0;
/// A variance below this (rad², m²) counts as zero.
const TINY: f64 = 1e-18;
/// Variance of a value's distance from the cubic through four neighbours, for values of variance 1: 1 + (1 + 16 + 16 +
/// 1)/36.
const BY_CUBIC: f64 = 1.944;
/// The same of the middle of two neighbours: 1 + 2/4.
const BY_CHORD: f64 = 1.5;
/// The same of the line through the two values before: 1 + 4 + 1.
const BY_LINE: f64 = 6.0;
/// Stamps that go back by more periods than this are of another clock; by less, packets overtook each other.
const REORDERED_PERIODS: f64 = 8.0;
/// No value is larger, rad or m.
const MOST_VALUE: f64 = 1e6;
/// Memory is allocated once, for twice the kept values: then half of them is moved at a time.
const ROOM: usize = 2;

/// One value.
#[derive(Clone, Copy, Debug)]
struct Sample {
    value: f64,
    /// Standard deviation of its time, s.
    sigma_s: f64,
    trust: Trust,
}

/// The value of an axis at a time.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct AxisAt {
    /// Angle (rad) or way (m).
    pub value: f64,
    /// Its change, 1/s.
    pub rate: f64,
    /// Standard deviation of the value.
    pub sigma: f64,
    /// Standard deviation of the times of the values, s.
    pub sigma_s: f64,
    /// Time before the last value, s; negative if it is predicted.
    pub age_s: f64,
}

/// The stream. Times are seconds from an origin that moves along.
#[derive(Debug)]
pub(crate) struct AxisStream {
    pub origin_ns: i64,
    times_s: Vec<f64>,
    samples: Vec<Sample>,
    kept: usize,
    clock: Option<EnvelopeClock>,
    steps: Steps,
    residuals: usize,
    variance: f64,
    is_started: bool,
    last_arrival_ns: Option<i64>,
    /// By which it may leave its present motion, 1/s².
    acceleration: f64,
    /// Largest possible speed, 1/s.
    fastest: f64,
    longest_prediction_s: f64,
}

impl AxisStream {
    pub(crate) fn new(settings: &Settings, kind: AxisKind) -> Self {
        let (acceleration, fastest) = match kind {
            AxisKind::Rotary => (settings.angular_acceleration_rad_s2, settings.fastest_rad_s),
            AxisKind::Linear => (settings.acceleration_m_s2, settings.fastest_m_s),
        };
        let room = ROOM * settings.poses_kept;
        Self {
            origin_ns: 0,
            times_s: Vec::with_capacity(room),
            samples: Vec::with_capacity(room),
            kept: settings.poses_kept,
            clock: (settings.axis_stamps == StampRule::LowerEnvelope).then(EnvelopeClock::new),
            steps: Steps::new(),
            residuals: 0,
            variance: 0.0,
            is_started: false,
            last_arrival_ns: None,
            acceleration,
            fastest,
            longest_prediction_s: settings.longest_prediction_s,
        }
    }

    /// Usual time between values, s; zero if unknown yet.
    pub(crate) fn period_s(&self) -> f64 {
        self.steps.median_s().unwrap_or(0.0)
    }

    /// Longest time between two values that is bridged, s.
    pub(crate) fn gap_limit_s(&self) -> f64 {
        GAP_PERIODS * self.period_s()
    }

    /// Noise of a value, rad or m.
    pub(crate) fn noise(&self) -> f64 {
        self.variance.sqrt()
    }

    pub(crate) fn clock(&self) -> Option<&EnvelopeClock> {
        self.clock.as_ref()
    }

    pub(crate) fn last_arrival_ns(&self) -> Option<i64> {
        self.last_arrival_ns
    }

    /// Whether its period is known.
    pub(crate) fn is_settled(&self) -> bool {
        self.times_s.len() >= FEWEST_VALUES && self.steps.median_s().is_some()
    }

    fn forget_all(&mut self) {
        self.times_s.clear();
        self.samples.clear();
        self.steps = Steps::new();
        (self.residuals, self.variance) = (0, 0.0);
    }

    /// Takes a value that has arrived.
    pub(crate) fn push(&mut self, stamp_ns: i64, value: f64) -> Result<(), AxisError> {
        // NaN passes no comparison.
        if !is_stamp(stamp_ns) || value.is_nan() || value.abs() > MOST_VALUE {
            return Err(AxisError::NotFinite);
        }
        self.last_arrival_ns = Some(stamp_ns);
        if !self.is_started {
            self.origin_ns = stamp_ns;
            self.is_started = true;
        }
        if self.times_s.len() == ROOM * self.kept {
            self.forget();
        }
        let arrival_s = seconds(stamp_ns, self.origin_ns);
        let Some((time_s, sigma_s, trust)) = self.dated(arrival_s) else { return Ok(()) };
        if let Some(last_s) = self.times_s.last().copied() {
            self.expect_later(stamp_ns, time_s - last_s, value)?;
        }
        if trust == Trust::QueuedBefore {
            for sample in self.samples.iter_mut().rev().take_while(|sample| sample.trust != Trust::Sure) {
                sample.trust = Trust::QueuedBefore;
            }
        }
        self.append(time_s, Sample { value, sigma_s, trust });
        Ok(())
    }

    fn dated(&mut self, arrival_s: f64) -> Option<(f64, f64, Trust)> {
        let Some(clock) = &mut self.clock else { return Some((arrival_s, 0.0, Trust::Sure)) };
        let jumps = clock.jumps();
        let dated = clock.date(arrival_s);
        if clock.jumps() != jumps {
            self.forget_all();
            return None;
        }
        dated.map(|dated| (dated.time_s, dated.sigma_s, dated.trust))
    }

    fn expect_later(&mut self, stamp_ns: i64, step_s: f64, value: f64) -> Result<(), AxisError> {
        if step_s > 0.0 {
            return Ok(());
        }
        let behind_ns = stamps::stamp(-step_s, 0);
        if self.clock.is_some() || -step_s <= REORDERED_PERIODS * self.period_s() {
            return Err(AxisError::NotLater { behind_ns });
        }
        self.forget_all();
        self.origin_ns = stamp_ns;
        self.append(0.0, Sample { value, sigma_s: 0.0, trust: Trust::Sure });
        Err(AxisError::ClockWentBack { behind_ns })
    }

    fn append(&mut self, time_s: f64, sample: Sample) {
        if let Some(last_s) = self.times_s.last() {
            self.steps.push(time_s - last_s);
        }
        // A value on its tick after one that came after a silence: that one was on its tick as well.
        if sample.trust == Trust::Sure
            && let Some(before) = self.samples.last_mut()
            && before.trust == Trust::AfterSilence
        {
            before.trust = Trust::Sure;
        }
        self.times_s.push(time_s);
        self.samples.push(sample);
        self.note_residual();
    }

    /// Forgets the older half of the values, and moves the origin of times to the first one that is left.
    fn forget(&mut self) {
        let from = self.times_s.len() - self.kept;
        self.times_s.copy_within(from.., 0);
        self.samples.copy_within(from.., 0);
        self.times_s.truncate(self.kept);
        self.samples.truncate(self.kept);
        let new_origin_ns = stamps::stamp(self.times_s[0], self.origin_ns);
        let by_s = seconds(new_origin_ns, self.origin_ns);
        self.origin_ns = new_origin_ns;
        self.times_s.iter_mut().for_each(|time_s| *time_s -= by_s);
        if let Some(clock) = &mut self.clock {
            clock.rebase(by_s);
        }
    }

    /// Learns the noise from the newest value that has two neighbours to either side.
    fn note_residual(&mut self) {
        let count = self.samples.len();
        if count < 5 || self.gap_limit_s() == 0.0 {
            return;
        }
        let k = count - 3;
        let around = &self.samples[k - 2..];
        let stands = around.windows(2).all(|pair| pair[0].value == pair[1].value);
        if stands || self.times_s[count - 1] - self.times_s[k - 2] > 2.0 * self.gap_limit_s() {
            return;
        }
        let new = self.off_cubic(k).powi(2) / BY_CUBIC;
        let part = (1.0 / (self.residuals + 1) as f64).max(1.0 / NOISE_VALUES);
        let most = MOST_SIGMAS.powi(2) * self.variance.max(TINY);
        let new = if self.residuals >= NOISE_KNOWN { new.min(most) } else { new };
        self.variance += part * (new - self.variance);
        self.residuals += 1;
    }

    /// Distance of a value from the cubic through two neighbours on either side.
    fn off_cubic(&self, k: usize) -> f64 {
        let nodes = [k - 2, k - 1, k + 1, k + 2];
        let weight = |i: usize| {
            let others = nodes.iter().filter(|j| **j != i);
            others.fold(1.0, |product, j| {
                product * (self.times_s[k] - self.times_s[*j]) / (self.times_s[i] - self.times_s[*j])
            })
        };
        let there: f64 = nodes.iter().map(|i| weight(*i) * self.samples[*i].value).sum();
        self.samples[k].value - there
    }

    /// Distance of a value from its neighbours, beyond its noise and the axis's possible motion.
    fn outlying(&self, k: usize) -> f64 {
        let (noise, last) = (self.noise(), self.samples.len() - 1);
        if k >= 2 && k + 2 <= last {
            return (self.off_cubic(k).abs() - OUTLYING * BY_CUBIC.sqrt() * noise).max(0.0);
        }
        let line = |from: usize, to: usize| {
            let slope =
                (self.samples[to].value - self.samples[from].value) / (self.times_s[to] - self.times_s[from]);
            self.samples[k].value - self.samples[from].value - slope * (self.times_s[k] - self.times_s[from])
        };
        let (off, by, step_s) = if k >= 1 && k < last {
            (line(k - 1, k + 1), BY_CHORD, self.times_s[k + 1] - self.times_s[k - 1])
        } else if k == last {
            (line(k - 2, k - 1), BY_LINE, self.times_s[k] - self.times_s[k - 2])
        } else {
            (line(1, 2), BY_LINE, self.times_s[2] - self.times_s[0])
        };
        let allowed = 0.25 * self.acceleration * step_s * step_s;
        (off.abs() - OUTLYING * by.sqrt() * noise - allowed).max(0.0)
    }

    /// The value at a time, s from the origin.
    pub(crate) fn at(&self, time_s: f64) -> Result<AxisAt, AxisProblem> {
        if !self.is_settled() {
            return Err(AxisProblem::Unsettled { values: self.samples.len(), needed: FEWEST_VALUES });
        }
        let (first_s, last_s) = (self.times_s[0], self.times_s[self.times_s.len() - 1]);
        if time_s < first_s {
            return Err(AxisProblem::BeforeValues { by_s: first_s - time_s });
        }
        if time_s > last_s {
            return self.after(time_s - last_s);
        }
        let next = self.times_s.partition_point(|sample_s| *sample_s <= time_s).min(self.times_s.len() - 1);
        self.between(next - 1, time_s)
    }

    fn between(&self, j: usize, time_s: f64) -> Result<AxisAt, AxisProblem> {
        let last = self.samples.len() - 1;
        let span_s = self.expect_joined(j)?;
        let u = (time_s - self.times_s[j]) / span_s;
        let (from, to) = (self.samples[j].value, self.samples[j + 1].value);
        let [out, into] = [j, j + 1].map(|k| self.slope(k) * span_s);
        let (u2, u3) = (u * u, u * u * u);
        let value = from * (2.0 * u3 - 3.0 * u2 + 1.0)
            + out * (u3 - 2.0 * u2 + u)
            + to * (3.0 * u2 - 2.0 * u3)
            + into * (u3 - u2);
        let rate = (from * (6.0 * u2 - 6.0 * u)
            + out * (3.0 * u2 - 4.0 * u + 1.0)
            + to * (6.0 * u - 6.0 * u2)
            + into * (3.0 * u2 - 2.0 * u))
            / span_s;
        let nodes = j.saturating_sub(1)..=(j + 2).min(last);
        let outlying = nodes.map(|k| self.outlying(k)).fold(0.0, f64::max);
        // At either end, and beside a gap, nothing shows how the axis bends.
        let is_open = self.before(j).is_none() || self.behind(j + 1).is_none();
        let open_s = if is_open { span_s } else { 0.0 };
        let lost_s2 = if span_s > LOST * self.period_s() { span_s * span_s / 8.0 } else { 0.0 };
        let bent = self.acceleration * (0.5 * open_s * open_s).max(lost_s2);
        Ok(AxisAt {
            value,
            rate,
            sigma: self.noise().hypot(outlying).hypot(bent),
            sigma_s: self.samples[j].sigma_s.max(self.samples[j + 1].sigma_s),
            age_s: self.times_s[last] - time_s,
        })
    }

    /// A value after the last one: the last step continues.
    fn after(&self, by_s: f64) -> Result<AxisAt, AxisProblem> {
        let limit_s = self.longest_prediction_s;
        if by_s > limit_s {
            return Err(AxisProblem::ValuesEnded { by_s, limit_s });
        }
        let last = self.samples.len() - 1;
        let span_s = self.expect_joined(last - 1)?;
        let rate = (self.samples[last].value - self.samples[last - 1].value) / span_s;
        let outlying = (last - 2..=last).map(|k| self.outlying(k)).fold(0.0, f64::max);
        // An outlier and the noise of the last step are carried on with it.
        let carried = 1.0 + by_s / span_s;
        let since_s = by_s + span_s;
        Ok(AxisAt {
            value: self.samples[last].value + rate * by_s,
            rate,
            sigma: ((self.noise() + outlying) * carried.hypot(by_s / span_s))
                .hypot(0.5 * self.acceleration * since_s * since_s),
            sigma_s: self.samples[last].sigma_s,
            age_s: -by_s,
        })
    }

    /// The time from a value to the next, s, if the two can be joined.
    fn expect_joined(&self, j: usize) -> Result<f64, AxisProblem> {
        let span_s = self.times_s[j + 1] - self.times_s[j];
        if span_s > self.gap_limit_s() {
            return Err(AxisProblem::InGap { gap_s: span_s });
        }
        let is_sure = self.samples[j..=j + 1].iter().all(|sample| sample.trust == Trust::Sure);
        let moved = (self.samples[j + 1].value - self.samples[j].value).abs();
        if !is_sure || moved > self.fastest * span_s {
            return Err(AxisProblem::Doubtful);
        }
        Ok(span_s)
    }

    /// The value before one, if no gap is between.
    fn before(&self, k: usize) -> Option<usize> {
        let before = k.checked_sub(1)?;
        (self.times_s[k] - self.times_s[before] <= self.gap_limit_s()).then_some(before)
    }

    /// The value behind one, if no gap is between.
    fn behind(&self, k: usize) -> Option<usize> {
        let behind = k + 1;
        let time_s = self.times_s.get(behind)?;
        (time_s - self.times_s[k] <= self.gap_limit_s()).then_some(behind)
    }

    /// Slope of the parabola through a value and its neighbours, or of the line through it and the only one.
    fn slope(&self, k: usize) -> f64 {
        let over = |from: usize, to: usize| {
            let step_s = self.times_s[to] - self.times_s[from];
            ((self.samples[to].value - self.samples[from].value) / step_s, step_s)
        };
        match (self.before(k), self.behind(k)) {
            (Some(before), Some(behind)) => {
                let ((back, back_s), (on, on_s)) = (over(before, k), over(k, behind));
                (back * on_s + on * back_s) / (back_s + on_s)
            }
            (Some(before), None) => over(before, k).0,
            (None, Some(behind)) => over(k, behind).0,
            (None, None) => 0.0,
        }
    }
}
