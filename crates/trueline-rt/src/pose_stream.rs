//! The received poses, and the properties of their stream.

use crate::envelope_clock::{EnvelopeClock, Trust};
use crate::error::PoseError;
use crate::repeats::Repeats;
use crate::settings::{Settings, StampRule};
use crate::stamps::{self, is_stamp, seconds};
use crate::steps::Steps;
use trueline_geometry::smooth::{self, SmoothedSample};
use trueline_geometry::trajectory::GAP_PERIODS;
use trueline_geometry::{Pose, so3};

/// If the next pose comes within this part of a period, the pose waited in a queue: the next one is right then.
const QUEUED: f64 = 0.1;
/// Standard deviation of an even distribution over 1: 1/√12.
const UNIFORM: f64 = 0.288_675;
/// Stamps that go back by more periods than this are of another clock; by less, packets overtook each other.
const REORDERED_PERIODS: f64 = 8.0;
/// Samples over which the noise is averaged.
const NOISE_SAMPLES: f64 = 256.0;
/// Largest weight of one residual, in standard deviations, once [`NOISE_KNOWN`] are known.
const MOST_SIGMAS: f64 = 5.0;
/// Number of residuals that give the noise.
const NOISE_KNOWN: usize = 16;
/// Poses before anything is placed.
pub(crate) const FEWEST_POSES: usize = 32;

/// One sample of the robot.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sample {
    /// Its state after the local fit, and whether later poses change that.
    pub smoothed: SmoothedSample,
    pub is_final: bool,
    /// Standard deviation of its time, s.
    pub sigma_s: f64,
    pub trust: Trust,
}

/// The stream. Times are seconds from an origin that moves along.
#[derive(Debug)]
pub(crate) struct PoseStream {
    pub origin_ns: i64,
    pub times_s: Vec<f64>,
    pub poses: Vec<Pose>,
    pub samples: Vec<Sample>,
    kept: usize,
    half_window_s: f64,
    clock: Option<EnvelopeClock>,
    steps: Steps,
    repeats: Repeats,
    /// Samples from here on have a fit that is not final.
    open_from: usize,
    residuals: usize,
    variance_m2: f64,
    variance_rad2: f64,
    is_started: bool,
}

/// Memory is allocated once, for twice the kept samples: then half of them is moved at a time.
const ROOM: usize = 2;

impl PoseStream {
    pub(crate) fn new(settings: &Settings) -> Self {
        let room = ROOM * settings.poses_kept;
        Self {
            origin_ns: 0,
            times_s: Vec::with_capacity(room),
            poses: Vec::with_capacity(room),
            samples: Vec::with_capacity(room),
            kept: settings.poses_kept,
            half_window_s: settings.half_window_s,
            clock: (settings.pose_stamps == StampRule::LowerEnvelope).then(EnvelopeClock::new),
            steps: Steps::new(),
            repeats: Repeats::default(),
            open_from: 0,
            residuals: 0,
            variance_m2: 0.0,
            variance_rad2: 0.0,
            is_started: false,
        }
    }

    /// Forgets the poses, not the memory, nor the clock.
    fn forget_all(&mut self) {
        self.times_s.clear();
        self.poses.clear();
        self.samples.clear();
        self.steps = Steps::new();
        self.repeats = Repeats::default();
        self.open_from = 0;
        self.residuals = 0;
        (self.variance_m2, self.variance_rad2) = (0.0, 0.0);
    }

    /// Usual time between poses, s; zero if unknown yet.
    pub(crate) fn period_s(&self) -> f64 {
        self.steps.median_s().unwrap_or(0.0)
    }

    /// Longest time between two poses that is bridged, s.
    pub(crate) fn gap_limit_s(&self) -> f64 {
        GAP_PERIODS * self.period_s()
    }

    /// Noise of a pose per axis, m and rad.
    pub(crate) fn noise(&self) -> [f64; 2] {
        [self.variance_m2.sqrt(), self.variance_rad2.sqrt()]
    }

    pub(crate) fn clock(&self) -> Option<&EnvelopeClock> {
        self.clock.as_ref()
    }

    /// Whether period and noise are known.
    pub(crate) fn is_settled(&self) -> bool {
        self.times_s.len() >= FEWEST_POSES && self.steps.median_s().is_some()
    }

    /// Takes a pose that has arrived.
    pub(crate) fn push(&mut self, stamp_ns: i64, pose: &Pose) -> Result<(), PoseError> {
        if !is_stamp(stamp_ns) || !crate::calibration::is_pose(pose) {
            return Err(PoseError::NotFinite);
        }
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
            self.expect_later(stamp_ns, time_s - last_s, pose)?;
            if self.only_repeats(time_s, pose) {
                return Ok(());
            }
            if time_s - last_s < QUEUED * self.period_s() {
                self.drop_last();
            }
        }
        if trust == Trust::QueuedBefore {
            self.distrust_queue();
        }
        let asked_s = if self.repeats.is_repeating() { self.repeats.poll_s * UNIFORM } else { 0.0 };
        self.append(time_s, pose, sigma_s.hypot(asked_s), trust);
        Ok(())
    }

    /// Time of a sample that arrived now (s), its uncertainty (s) and how far it can be relied upon; `None`
    /// while the clock is being learnt.
    fn dated(&mut self, arrival_s: f64) -> Option<(f64, f64, Trust)> {
        let Some(clock) = &mut self.clock else { return Some((arrival_s, 0.0, Trust::Sure)) };
        let jumps = clock.jumps();
        let dated = clock.date(arrival_s);
        if clock.jumps() != jumps {
            // Samples dated by the clock before do not agree with the new ones.
            self.forget_all();
            return None;
        }
        dated.map(|dated| (dated.time_s, dated.sigma_s, dated.trust))
    }

    fn expect_later(&mut self, stamp_ns: i64, step_s: f64, pose: &Pose) -> Result<(), PoseError> {
        if step_s > 0.0 {
            return Ok(());
        }
        let behind_ns = stamps::stamp(-step_s, 0);
        if self.clock.is_some() || -step_s <= REORDERED_PERIODS * self.period_s() {
            return Err(PoseError::NotLater { behind_ns });
        }
        self.forget_all();
        self.origin_ns = stamp_ns;
        self.append(0.0, pose, 0.0, Trust::Sure);
        Err(PoseError::ClockWentBack { behind_ns })
    }

    /// Whether a pose is a repetition: the controller is polled more often than it updates its pose.
    fn only_repeats(&mut self, time_s: f64, pose: &Pose) -> bool {
        let was_repeating = self.repeats.is_repeating();
        let is_same = self.poses.last() == Some(pose);
        let only_repeats = self.repeats.note(time_s, is_same);
        if self.repeats.is_repeating() != was_repeating {
            // The kind of stream was wrong for the samples so far.
            let repeats = self.repeats;
            self.forget_all();
            self.repeats = repeats;
        }
        only_repeats
    }

    fn drop_last(&mut self) {
        self.times_s.pop();
        self.poses.pop();
        self.samples.pop();
        self.open_from = self.open_from.min(self.times_s.len());
    }

    /// Those since the last silence were late by an unknown time.
    fn distrust_queue(&mut self) {
        for sample in self.samples.iter_mut().rev() {
            if sample.trust == Trust::Sure {
                break;
            }
            sample.trust = Trust::QueuedBefore;
        }
    }

    fn append(&mut self, time_s: f64, pose: &Pose, sigma_s: f64, trust: Trust) {
        if let Some(last_s) = self.times_s.last() {
            self.steps.push(time_s - last_s);
        }
        // A sample on its tick after one that came after a silence: that one was on its tick as well.
        if trust == Trust::Sure
            && let Some(before) = self.samples.last_mut()
            && before.trust == Trust::AfterSilence
        {
            before.trust = Trust::Sure;
        }
        self.times_s.push(time_s);
        self.poses.push(*pose);
        let smoothed = SmoothedSample { pose: *pose, variance_left: 1.0 };
        self.samples.push(Sample { smoothed, is_final: false, sigma_s, trust });
        self.fit_open();
    }

    /// Forgets the older half of the samples, and moves the origin of times to the first one that is left.
    fn forget(&mut self) {
        let from = self.times_s.len() - self.kept;
        self.times_s.copy_within(from.., 0);
        self.poses.copy_within(from.., 0);
        self.samples.copy_within(from.., 0);
        self.times_s.truncate(self.kept);
        self.poses.truncate(self.kept);
        self.samples.truncate(self.kept);
        self.open_from = self.open_from.saturating_sub(from);
        let new_origin_ns = stamps::stamp(self.times_s[0], self.origin_ns);
        let by_s = seconds(new_origin_ns, self.origin_ns);
        self.origin_ns = new_origin_ns;
        self.times_s.iter_mut().for_each(|time_s| *time_s -= by_s);
        self.repeats.rebase(by_s);
        if let Some(clock) = &mut self.clock {
            clock.rebase(by_s);
        }
    }

    /// Makes fits final when no later pose can enter their window.
    fn fit_open(&mut self) {
        let gap_limit_s = self.gap_limit_s();
        if gap_limit_s == 0.0 {
            return;
        }
        let Some(newest_s) = self.times_s.last().copied() else { return };
        while self.open_from < self.times_s.len()
            && newest_s - self.times_s[self.open_from] > self.half_window_s.max(gap_limit_s)
        {
            let k = self.open_from;
            let smoothed = self.fit(k);
            self.note_residual(k, &smoothed);
            self.samples[k].smoothed = smoothed;
            self.samples[k].is_final = true;
            self.open_from += 1;
        }
    }

    /// The local fit at a sample with the poses that are there.
    fn fit(&self, k: usize) -> SmoothedSample {
        smooth::smoothed_sample(&self.times_s, &self.poses, k, self.gap_limit_s(), self.half_window_s)
    }

    fn note_residual(&mut self, k: usize, smoothed: &SmoothedSample) {
        let left = smoothed.variance_left;
        let moves = k == 0 || self.poses[k].translation != self.poses[k - 1].translation;
        if left >= 1.0 || !moves {
            return;
        }
        // Of the residual of a sample that is in its own fit, 1 − w₀ of the variance is left; w₀ = Σw² for least squares.
        let shift = self.poses[k].translation.vector - smoothed.pose.translation.vector;
        let turn = so3::log(&(smoothed.pose.rotation.inverse() * self.poses[k].rotation));
        let per_axis = |square: f64| square / (3.0 * (1.0 - left));
        let part = (1.0 / (self.residuals + 1) as f64).max(1.0 / NOISE_SAMPLES);
        let known = self.residuals >= NOISE_KNOWN;
        let averaged = |variance: f64, new: f64| {
            let most = if known { MOST_SIGMAS.powi(2) * variance } else { f64::INFINITY };
            variance + part * (new.min(most.max(TINY)) - variance)
        };
        self.variance_m2 = averaged(self.variance_m2, per_axis(shift.norm_squared()));
        self.variance_rad2 = averaged(self.variance_rad2, per_axis(turn.norm_squared()));
        self.residuals += 1;
    }

    /// The local fit at a sample, final or not.
    pub(crate) fn smoothed(&self, k: usize) -> SmoothedSample {
        if self.samples[k].is_final { self.samples[k].smoothed } else { self.fit(k) }
    }
}

/// A variance below this (m², rad²) counts as zero: 1 nm squared.
const TINY: f64 = 1e-18;
