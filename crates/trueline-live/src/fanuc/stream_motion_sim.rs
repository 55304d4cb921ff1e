//! A simulated controller's side of Stream Motion: status after a start, silence to a foreign version, no motion.

use super::stream_motion_packets::{
    CAPABILITY, SIGNALS, START, START_OLD, STATUS_3, STATUS_4, STATUS_OLD, STOP, VERSION_REQUEST, head, word,
    words,
};
use crate::zyx_angles;
use std::net::SocketAddr;
use trueline_geometry::Pose;

/// Inputs of each type.
const MOST_INPUTS: u32 = 512;

/// A controller of one version.
#[derive(Clone, Debug)]
pub struct StreamMotionController {
    version: u32,
    sampling_ms: u32,
    listener: Option<SocketAddr>,
    sequence: u32,
    /// Packets of another version (MOTN-607), or of no known kind.
    refused: u64,
    /// Commands of motion that came; none is followed.
    commands: u64,
    /// It was requested to report an input.
    reports_input: bool,
}

impl StreamMotionController {
    /// Uses one version of 1 to 4, with this interval in ms.
    #[must_use]
    pub fn new(version: u32, sampling_ms: u32) -> Self {
        Self {
            version,
            sampling_ms,
            listener: None,
            sequence: 0,
            refused: 0,
            commands: 0,
            reports_input: false,
        }
    }

    /// Packets that it did not take, and commands of motion that came.
    #[must_use]
    pub fn counts(&self) -> (u64, u64) {
        (self.refused, self.commands)
    }

    fn is_new(&self) -> bool {
        self.version >= 3
    }

    /// Takes a packet; returns the answer, if there is one.
    pub fn receive(&mut self, bytes: &[u8], from: SocketAddr) -> Option<Vec<u8>> {
        let (kind, version) = (word(bytes, 0)?, word(bytes, 1)?);
        match (kind, self.is_new()) {
            (STOP, _) => {
                self.listener = None;
                None
            }
            (CAPABILITY, true) => {
                Some(words(&[CAPABILITY, self.version, 1, self.sampling_ms, 0, self.version, 0]))
            }
            // Old controllers are started before the request of their version (as fanuc-ucl does), so any version
            // will do.
            (START_OLD, false) => {
                (self.listener, self.sequence) = (Some(from), 0);
                None
            }
            (START, true) if version == self.version => {
                (self.listener, self.sequence) = (Some(from), 0);
                None
            }
            (SIGNALS, true) => Some(words(&[SIGNALS, self.configure(bytes), 0])),
            (VERSION_REQUEST, false) => Some(head(VERSION_REQUEST, self.version)),
            (1 | 5 | 201, _) => {
                self.commands += 1;
                None
            }
            _ => {
                self.refused += 1;
                None
            }
        }
    }

    /// The simulation has one entry, the state of a digital input or of one at the arm; 0 is success.
    fn configure(&mut self, bytes: &[u8]) -> u32 {
        let entry = [2, 3, 4, 5].map(|place| word(bytes, place));
        let is_input = matches!(entry, [Some(2), Some(1 | 3), Some(1..=MOST_INPUTS), Some(1)]);
        self.reports_input = is_input && bytes.len() == 520 && word(bytes, 6) == Some(0);
        u32::from(!self.reports_input)
    }

    /// The status of a moment, and to whom; nothing before a start.
    pub fn status(&mut self, time_ms: u32, pose: &Pose, input: bool) -> Option<(SocketAddr, Vec<u8>)> {
        let to = self.listener?;
        self.sequence = self.sequence.wrapping_add(1);
        let (kind, length, time_at, pose_at) = match self.version {
            1 | 2 => (STATUS_OLD, 132, 20, 24),
            3 => (STATUS_3, 388, 16, 20),
            _ => (STATUS_4, 416, 16, 20),
        };
        let mut bytes = vec![0; length];
        let mut put = |at: usize, word: [u8; 4]| bytes[at..at + 4].copy_from_slice(&word);
        put(0, kind.to_be_bytes());
        put(4, self.version.to_be_bytes());
        put(8, self.sequence.to_be_bytes());
        // In steps of 2 ms.
        put(time_at, (time_ms & !1).to_be_bytes());
        let p = pose.translation.vector * 1e3;
        let [w, pitch, r] = zyx_angles::to_wpr_deg(&pose.rotation);
        for (k, figure) in [p.x, p.y, p.z, w, pitch, r].into_iter().enumerate() {
            put(pose_at + 4 * k, (figure as f32).to_be_bytes());
        }
        match self.version {
            1 | 2 => bytes[12] = 4,
            version if self.reports_input => bytes[if version == 3 { 132 } else { 160 }] = input.into(),
            _ => {}
        }
        Some((to, bytes))
    }
}
