//! Who talks, how regularly, and what is lost: the answer to "no data from the UdpUc device".

use crate::endpoint::Received;
use crate::frame_filter::{Rejection, SequenceStatus};
use crate::robot_frame::RobotFrame;
use std::collections::{BTreeMap, VecDeque};
use std::net::SocketAddr;
use trueline_geometry::statistics::median;

/// Frames over which rate and delays are told: a minute at 250 Hz.
pub(crate) const RECENT: usize = 15_000;
/// Senders that are told apart; more than this is a flood, and counted together.
const MOST_TALKERS: usize = 64;

/// What one sender sent.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Talker {
    /// Its datagrams.
    pub datagrams: u64,
    /// Those that were the robot's good frames.
    pub accepted: u64,
    /// The others, by reason.
    pub rejected: BTreeMap<String, u64>,
}

/// Listens along.
#[derive(Clone, Debug, Default)]
pub struct LinkWatch {
    talkers: BTreeMap<SocketAddr, Talker>,
    unlisted: u64,
    robot: Option<(SocketAddr, RobotFrame)>,
    recent: VecDeque<(i64, i64)>,
    frames: u64,
    skipped: u64,
    late: u64,
    repeated: u64,
    sessions: u64,
    contradictions: u64,
    longest_gap_ns: i64,
    last_ns: Option<i64>,
    without_kernel_stamp: u64,
    dropped_by_kernel: u32,
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
    /// How much the controller's clock runs fast against this PC's, parts per million.
    pub drift_ppm: f64,
}

/// The robot's link in three figures.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Brief {
    /// The robot, and the last that it said.
    pub robot: Option<(SocketAddr, RobotFrame)>,
    /// Good frames.
    pub frames: u64,
    /// Sequence numbers that never came.
    pub lost: u64,
}

/// The robot's link so far.
#[derive(Clone, Debug, PartialEq)]
pub struct LinkReport {
    /// Everybody who sent something.
    pub talkers: BTreeMap<SocketAddr, Talker>,
    /// Datagrams of senders beyond those listed.
    pub unlisted: u64,
    /// The robot, and the last that it said.
    pub robot: Option<(SocketAddr, RobotFrame)>,
    /// Good frames.
    pub frames: u64,
    /// Sequence numbers that never came.
    pub lost: u64,
    /// Frames overtaken by newer ones.
    pub late: u64,
    /// Frames that came twice.
    pub repeated: u64,
    /// How often the stream began.
    pub sessions: u64,
    /// Frames whose quaternion and Euler angles contradict each other.
    pub contradictions: u64,
    /// Longest time without a frame between two, s.
    pub longest_gap_s: f64,
    /// Rate and delays of the last minute; `None` with fewer than ten frames.
    pub timing: Option<Timing>,
    /// Datagrams without a stamp of the kernel that could be used: they are stamped when they were read.
    pub without_kernel_stamp: u64,
    /// Datagrams that this machine had to drop.
    pub dropped_by_kernel: u32,
}

impl LinkWatch {
    /// Takes notice of a datagram.
    pub fn note(&mut self, received: &Received<'_>) {
        let datagram = &received.datagram;
        self.dropped_by_kernel = datagram.dropped_by_kernel;
        self.without_kernel_stamp +=
            u64::from(datagram.arrival.kernel_wall_ns.is_none() || datagram.arrival.is_of_reading);
        if self.talkers.len() < MOST_TALKERS || self.talkers.contains_key(&datagram.from) {
            let talker = self.talkers.entry(datagram.from).or_default();
            talker.datagrams += 1;
            match &received.judged {
                Ok(_) => talker.accepted += 1,
                Err(reason) => *talker.rejected.entry(reason.to_string()).or_default() += 1,
            }
        } else {
            self.unlisted += 1;
        }
        match received.judged {
            Ok((frame, status)) => {
                self.note_frame(datagram.from, frame, status, datagram.arrival.steady_ns);
            }
            Err(Rejection::Repeated) => self.repeated += 1,
            Err(_) => {}
        }
    }

    fn note_frame(&mut self, from: SocketAddr, frame: RobotFrame, status: SequenceStatus, steady_ns: i64) {
        self.frames += 1;
        self.contradictions += u64::from(frame.attitudes_differ);
        match status {
            SequenceStatus::First => {
                self.sessions += 1;
                // Another session may have another clock.
                self.recent.clear();
            }
            SequenceStatus::Newest { skipped } => self.skipped += u64::from(skipped),
            SequenceStatus::Late => self.late += 1,
        }
        if let Some(last_ns) = self.last_ns {
            self.longest_gap_ns = self.longest_gap_ns.max(steady_ns - last_ns);
        }
        self.last_ns = Some(steady_ns);
        if status != SequenceStatus::Late {
            self.robot = Some((from, frame));
        }
        if self.recent.len() == RECENT {
            self.recent.pop_front();
        }
        self.recent.push_back((frame.device_ns, steady_ns));
    }

    /// The robot and the last that it said, its frames, and how many were lost: cheap enough for every step.
    #[must_use]
    pub fn brief(&self) -> Brief {
        Brief { robot: self.robot, frames: self.frames, lost: self.skipped.saturating_sub(self.late) }
    }

    /// What there is to tell.
    #[must_use]
    pub fn report(&self) -> LinkReport {
        LinkReport {
            talkers: self.talkers.clone(),
            unlisted: self.unlisted,
            robot: self.robot,
            frames: self.frames,
            lost: self.skipped.saturating_sub(self.late),
            late: self.late,
            repeated: self.repeated,
            sessions: self.sessions,
            contradictions: self.contradictions,
            longest_gap_s: self.longest_gap_ns as f64 * 1e-9,
            timing: timing(&self.recent),
            without_kernel_stamp: self.without_kernel_stamp,
            dropped_by_kernel: self.dropped_by_kernel,
        }
    }
}

/// Rate and delays of stamps by the controller's clock and this PC's, ns.
pub(crate) fn timing(recent: &VecDeque<(i64, i64)>) -> Option<Timing> {
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
