//! A robot's recorded poses as a function of time \[Yang2025, Eqs. 4–6\].
//!
//! Between two recorded samples the rotation has a constant body rate ω and the position a constant velocity v. Both use the recorded time
//! difference, never a nominal period:
//!
//! | symbol | code | unit |
//! |---|---|---|
//! | ω = Log(R_jᵀ R_{j+1}) / (t_{j+1} − t_j) | [`Segment::body_rate`] | rad/s, tool frame |
//! | v = (p_{j+1} − p_j) / (t_{j+1} − t_j) | [`Segment::velocity`] | m/s, base frame |
//! | R(t) = R_j Exp(ω (t − t_j)), p(t) = p_j + v (t − t_j) | [`Segment::pose_at`] | |
//!
//! Outside the recording, and inside a gap, there is no pose. The answer is `None` and never a clamped value.

use crate::statistics::median;
use crate::{Pose, se3, so3};
use nalgebra::Vector3;
use std::ops::Range;
use std::sync::Arc;

/// A gap is a time between samples longer than this many median periods.
///
/// Four: EGM at 4 ms may lose one or two datagrams in a row, and the motion in between is still linear to far
/// below a robot's noise. A longer silence is not a sampled motion.
pub const GAP_PERIODS: f64 = 4.0;

/// The motion between two neighbouring samples.
#[derive(Clone, Copy, Debug)]
pub struct Segment {
    /// Time of the first sample, s.
    pub start: f64,
    /// Time between the samples, s.
    pub duration: f64,
    /// Pose at the first sample.
    pub base_from_tool: Pose,
    /// Body rate ω in the tool frame, rad/s.
    pub body_rate: Vector3<f64>,
    /// Velocity v of the tool origin in base, m/s.
    pub velocity: Vector3<f64>,
}

impl Segment {
    fn between(start: f64, from: &Pose, end: f64, to: &Pose) -> Self {
        let duration = end - start;
        let turn = so3::log(&(from.rotation.inverse() * to.rotation));
        Self {
            start,
            duration,
            base_from_tool: *from,
            body_rate: turn / duration, // Eq. (4)
            velocity: (to.translation.vector - from.translation.vector) / duration, // Eq. (4)
        }
    }

    /// Pose at a time in this segment, s.
    #[must_use]
    pub fn pose_at(&self, time: f64) -> Pose {
        let elapsed = time - self.start;
        se3::from_parts(
            self.base_from_tool.rotation * so3::exp(&(self.body_rate * elapsed)), // Eq. (5)
            self.base_from_tool.translation.vector + self.velocity * elapsed,     // Eq. (5)
        )
    }
}

/// Reason that a trajectory cannot be built.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TrajectoryError {
    /// Fewer than two samples.
    TooFewSamples,
    /// The number of times and of poses differ.
    LengthsDiffer,
    /// Time decreases, or is not finite, at this sample or the previous one.
    TimeRunsBackwards {
        /// Index of the sample.
        index: usize,
    },
}

impl std::fmt::Display for TrajectoryError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::TooFewSamples => write!(f, "fewer than two samples of rising time"),
            Self::LengthsDiffer => write!(f, "there are not as many times as poses"),
            Self::TimeRunsBackwards { index } => write!(f, "time runs backwards at sample {index}"),
        }
    }
}

/// Sampled poses over time. Copies share them.
#[derive(Clone, Debug)]
pub struct Trajectory {
    times: Arc<Vec<f64>>,
    segments: Arc<Vec<Segment>>,
    table: Arc<SampleTable>,
    median_period: f64,
    is_unbroken: bool,
}

impl Trajectory {
    /// Builds a trajectory from sample times (s, not decreasing) and poses.
    ///
    /// Two samples with the same time are allowed. From that time on the second one is used.
    ///
    /// # Errors
    /// [`TrajectoryError`] with the invalid sample.
    pub fn new(times: Vec<f64>, poses: &[Pose]) -> Result<Self, TrajectoryError> {
        if times.len() != poses.len() {
            return Err(TrajectoryError::LengthsDiffer);
        }
        let median_period = median_period_s(&times)?;
        let pairs = times.windows(2).zip(poses.windows(2));
        let segments: Vec<_> = pairs.map(|(t, p)| Segment::between(t[0], &p[0], t[1], &p[1])).collect();
        let is_bridged = |s: &Segment| s.duration > 0.0 && s.duration <= GAP_PERIODS * median_period;
        let is_unbroken = segments.iter().all(is_bridged);
        let table = Arc::new(SampleTable::of(&times));
        let (times, segments) = (Arc::new(times), Arc::new(segments));
        Ok(Self { times, segments, table, median_period, is_unbroken })
    }

    /// Whether there is a pose at every time from the first sample to the last.
    #[must_use]
    pub fn is_unbroken(&self) -> bool {
        self.is_unbroken
    }

    /// Sample times, s.
    #[must_use]
    pub fn times(&self) -> &[f64] {
        &self.times
    }

    /// The segments between neighbouring samples, including gaps: see [`Trajectory::segment`].
    #[must_use]
    #[inline]
    pub fn segments(&self) -> &[Segment] {
        &self.segments
    }

    /// Median time between samples, s.
    #[must_use]
    pub fn median_period(&self) -> f64 {
        self.median_period
    }

    /// Longest time between two samples that is interpolated, s.
    #[must_use]
    pub fn gap_limit(&self) -> f64 {
        GAP_PERIODS * self.median_period
    }

    /// First and last sample time, s.
    #[must_use]
    pub fn span(&self) -> (f64, f64) {
        (self.times[0], self.times[self.times.len() - 1])
    }

    /// Index j with t_j ≤ time < t_{j+1}. At the very end the last segment with a duration. `None` outside the recording.
    ///
    /// O(1) if samples are as dense as on average, else O(log n).
    #[must_use]
    #[inline]
    pub fn bracket(&self, time: f64) -> Option<usize> {
        let samples = self.table.samples_about(time)?;
        let mut index = samples.start;
        // An interval of the table contains a few samples, or more in a burst.
        for _ in 0..NEAR {
            match self.times.get(index + 1) {
                Some(after) if time < *after => return (self.times[index] <= time).then_some(index),
                Some(_) => index += 1,
                None => break,
            }
        }
        self.search(time, samples)
    }

    #[inline(never)]
    fn search(&self, time: f64, samples: Range<usize>) -> Option<usize> {
        let last = self.times.len() - 1;
        if !(time >= self.times[0] && time <= self.times[last]) {
            return None;
        }
        // The last sample at or before `time`. At the very end the segment that ends there.
        let after = samples.start + self.times[samples].partition_point(|t| *t <= time);
        let mut index = (after - 1).min(last - 1);
        // Only a recording that ends with equal times can have a segment without duration here.
        while index > 0 && self.times[index + 1] <= self.times[index] {
            index -= 1;
        }
        Some(index)
    }

    /// The segment from sample `index`. `None` if it bridges a gap or has no duration.
    #[must_use]
    #[inline]
    pub fn segment(&self, index: usize) -> Option<&Segment> {
        self.segments.get(index).filter(|s| s.duration > 0.0 && s.duration <= self.gap_limit())
    }

    /// The segment at `time`. `None` outside the recording or in a gap.
    #[must_use]
    #[inline]
    pub fn segment_at(&self, time: f64) -> Option<&Segment> {
        self.segment(self.bracket(time)?)
    }

    /// Pose at `time` (s). `None` outside the recording or in a gap.
    #[must_use]
    pub fn pose_at(&self, time: f64) -> Option<Pose> {
        Some(self.segment_at(time)?.pose_at(time))
    }
}

/// Samples that are checked one after the other before a binary search.
const NEAR: usize = 4;

/// Places of samples, by equal intervals of time, as many as there are samples.
#[derive(Debug)]
struct SampleTable {
    start: f64,
    intervals_per_s: f64,
    /// For each interval the last sample in earlier ones, or the first.
    before: Vec<u32>,
}

impl SampleTable {
    fn of(times: &[f64]) -> Self {
        let (start, count) = (times[0], times.len());
        let intervals_per_s = (count - 1) as f64 / (times[count - 1] - start);
        let mut table = Self { start, intervals_per_s, before: vec![0; count] };
        let mut sample = 0;
        for interval in 0..count {
            while sample + 1 < count && table.interval(times[sample + 1]) < interval {
                sample += 1;
            }
            table.before[interval] = sample as u32;
        }
        table
    }

    /// Increases with time, so that a sample in an earlier interval is earlier.
    #[inline]
    fn interval(&self, time: f64) -> usize {
        ((time - self.start) * self.intervals_per_s) as usize
    }

    /// The samples among which is the last at or before this time; `None` before the first and long after the last.
    #[inline]
    fn samples_about(&self, time: f64) -> Option<Range<usize>> {
        if time < self.start {
            return None;
        }
        let interval = self.interval(time);
        let first = *self.before.get(interval)? as usize;
        let last = self.before.get(interval + 1).map_or(self.before.len() - 1, |sample| *sample as usize);
        Some(first..last + 1)
    }
}

/// Median time between samples at these times, s, without samples of equal time.
///
/// # Errors
/// Times that are invalid for a trajectory.
pub fn median_period_s(times: &[f64]) -> Result<f64, TrajectoryError> {
    if times.len() < 2 {
        return Err(TrajectoryError::TooFewSamples);
    }
    if let Some(k) = times.windows(2).position(|w| !(w[0].is_finite() && w[1].is_finite() && w[1] >= w[0])) {
        return Err(TrajectoryError::TimeRunsBackwards { index: k + 1 });
    }
    let steps = times.windows(2).map(|w| w[1] - w[0]).filter(|step| *step > 0.0);
    median(steps).ok_or(TrajectoryError::TooFewSamples)
}
