//! How regularly a robot's frames come, and what is lost.

use crate::frame_filter::SequenceStatus;
use std::collections::VecDeque;
use trueline_geometry::statistics::median;

/// Frames over which rate and delays are told: a minute at 250 Hz.
const RECENT: usize = 15_000;

/// Counts good frames.
#[derive(Clone, Debug, Default)]
pub(crate) struct StreamCounts {
    recent: VecDeque<(i64, i64)>,
    frames: u64,
    skipped: u64,
    late: u64,
    sessions: u64,
    longest_gap_ns: i64,
    last_ns: Option<i64>,
}

/// A stream so far.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StreamSummary {
    /// Good frames.
    pub frames: u64,
    /// Frames that the controller counted and that never came.
    pub lost: u64,
    /// Frames overtaken by newer ones.
    pub late: u64,
    /// Number of beginnings of the stream.
    pub sessions: u64,
    /// Longest time without a frame between two, s.
    pub longest_gap_s: f64,
    /// Rate and delays of the last minute; `None` with fewer than ten frames.
    pub timing: Option<Timing>,
}

/// How late frames came.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Timing {
    /// Frames a second.
    pub rate_hz: f64,
    /// Median time between frames by the controller's clock, s.
    pub period_s: f64,
    /// Delay above the quickest, s: median, 99th percentile, largest.
    pub delay_s: [f64; 3],
    /// Rate error of the controller's clock against this PC's, positive if fast, parts per million.
    pub drift_ppm: f64,
}

impl StreamSummary {
    /// The part of all frames that never came.
    #[must_use]
    pub fn lost_part(&self) -> f64 {
        self.lost as f64 / self.frames.saturating_add(self.lost).max(1) as f64
    }
}

impl StreamCounts {
    /// Takes notice of a good frame with its stamps by the controller's clock and this PC's, ns.
    pub(crate) fn note(&mut self, device_ns: i64, steady_ns: i64, status: SequenceStatus) {
        self.frames += 1;
        match status {
            SequenceStatus::First => {
                self.sessions += 1;
                // Another session may have another clock.
                self.recent.clear();
            }
            SequenceStatus::Newest { skipped } => self.skipped += u64::from(skipped),
            SequenceStatus::Late => self.late += 1,
        }
        if let Some(last_ns) = self.last_ns.replace(steady_ns) {
            self.longest_gap_ns = self.longest_gap_ns.max(steady_ns - last_ns);
        }
        if self.recent.len() == RECENT {
            self.recent.pop_front();
        }
        self.recent.push_back((device_ns, steady_ns));
    }

    /// Good frames so far.
    pub(crate) fn frames(&self) -> u64 {
        self.frames
    }

    /// Frames that the controller counted and that never came.
    pub(crate) fn lost(&self) -> u64 {
        self.skipped.saturating_sub(self.late)
    }

    /// Summary of the counts.
    pub(crate) fn summary(&self) -> StreamSummary {
        StreamSummary {
            frames: self.frames,
            lost: self.lost(),
            late: self.late,
            sessions: self.sessions,
            longest_gap_s: self.longest_gap_ns as f64 * 1e-9,
            timing: timing(&self.recent),
        }
    }
}

/// Rate and delays of stamps by the controller's clock and this PC's, ns.
fn timing(recent: &VecDeque<(i64, i64)>) -> Option<Timing> {
    if recent.len() < 10 {
        return None;
    }
    let (device_0, steady_0) = *recent.front()?;
    let seconds = |(device, steady): &(i64, i64)| {
        ((device - device_0) as f64 * 1e-9, (steady - steady_0) as f64 * 1e-9)
    };
    let mut stamps: Vec<(f64, f64)> = recent.iter().map(seconds).collect();
    stamps.sort_by(|a, b| a.0.total_cmp(&b.0));
    let span_s = stamps.last()?.0;
    let periods = stamps.windows(2).map(|pair| pair[1].0 - pair[0].0);
    let slope = quickest_slope(&stamps);
    let mut delays: Vec<f64> = stamps.iter().map(|(device, steady)| steady - device * slope).collect();
    delays.sort_by(f64::total_cmp);
    let above = |share: f64| delays[((delays.len() - 1) as f64 * share) as usize] - delays[0];
    Some(Timing {
        rate_hz: (stamps.len() - 1) as f64 / span_s.max(1e-9),
        period_s: median(periods)?,
        delay_s: [above(0.5), above(0.99), above(1.0)],
        drift_ppm: (1.0 / slope - 1.0) * 1e6,
    })
}

/// PC seconds a controller second: the line through the quickest frames of the first and of the last third.
fn quickest_slope(stamps: &[(f64, f64)]) -> f64 {
    let third = stamps.len() / 3;
    let quickest = |part: &[(f64, f64)]| {
        part.iter().copied().min_by(|a, b| (a.1 - a.0).total_cmp(&(b.1 - b.0))).unwrap_or_default()
    };
    let (early, late) = (quickest(&stamps[..third]), quickest(&stamps[stamps.len() - third..]));
    if late.0 > early.0 { (late.1 - early.1) / (late.0 - early.0) } else { 1.0 }
}
