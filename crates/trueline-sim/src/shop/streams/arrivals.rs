//! Path of a stream between its sender and its stamps.

use super::super::drawn_errors::DrawnErrors;
use super::late_packets::{self, LatePackets};
use super::lost_packets::LostPackets;
use super::millisecond_stamps::{cut, grains_s};
use super::stalls::Stalls;
use crate::noise::Noise;

/// Time between the stamps of packets that have queued up, s.
const QUEUED_S: [f64; 2] = [5e-6, 25e-6];
/// Stream of random numbers of a queue's stamps.
const QUEUE_STREAM: u64 = 3901;

/// A stream.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Stream {
    /// Poses of the robot.
    Robot,
    /// Images.
    Images,
}

/// The PC that stamps both streams.
pub(crate) struct Arrivals<'a> {
    errors: &'a DrawnErrors,
    stalls: Stalls,
    start_ns: i64,
    seed: u64,
}

impl<'a> Arrivals<'a> {
    /// The PC between two times since the start of the scan, s; its clock reads `start_ns` at the start.
    pub(crate) fn new(errors: &'a DrawnErrors, span_s: [f64; 2], start_ns: i64, seed: u64) -> Self {
        Self { errors, stalls: Stalls::of(errors, span_s), start_ns, seed }
    }

    /// The stamp of each packet sent at these times since the start, s; `None` if it is lost. A packet does not overtake
    /// another.
    pub(crate) fn stamps_ns(&self, sent_s: &[f64], stream: Stream) -> Vec<Option<i64>> {
        let number = stream as u64;
        let mut late = LatePackets::of(self.errors, number);
        let mut lost = LostPackets::of(self.errors, number);
        let mut queue = Noise::new(self.seed, QUEUE_STREAM + number);
        let grain_s = grains_s(self.errors)[stream as usize];
        let mut last_s = f64::NEG_INFINITY;
        let stamp = |sent_s: &f64| {
            let arrives_s = self.stalls.after(sent_s + late.as_mut().map_or(0.0, LatePackets::next_s));
            let behind_s = last_s + queue.uniform(QUEUED_S[0], QUEUED_S[1]);
            last_s = arrives_s.max(behind_s);
            let stamp_ns = self.start_ns + (last_s * 1e9).round() as i64;
            (!lost.next_is_lost()).then(|| cut(stamp_ns, grain_s))
        };
        sent_s.iter().map(stamp).collect()
    }

    /// Range by which the time offset may seem smaller and larger, s: the lateness of each stream, and the resolution of
    /// its stamps.
    pub(crate) fn of_the_offset_s(&self) -> [f64; 2] {
        let mean_s = late_packets::mean_s(self.errors);
        let [robot, images] = grains_s(self.errors);
        [-mean_s - images, mean_s + robot]
    }
}
