//! The stream of messages: cycles of 4 or 12 ms, of simulators 1, told by the IPOC alone.

use super::rob_message::{self, RobMessage};
use crate::frame_filter::{Rejection, SequenceStatus};
use crate::robot_source::{PoseMeaning, RobotPose, RobotStatus, SourceAbout};
use crate::udp_source::DatagramProtocol;

const MS_NS: i64 = 1_000_000;

/// One controller's stream.
#[derive(Clone, Debug, Default)]
pub struct Rsi {
    /// The least that the IPOC rose by from one message to the next, ms: the cycle.
    cycle_ms: Option<u32>,
    /// The controller waits for answers that it does not get.
    delayed: bool,
}

impl DatagramProtocol for Rsi {
    type Raw = RobMessage;

    fn decode(&self, bytes: &[u8]) -> Result<(u32, RobMessage), Rejection> {
        let message = rob_message::read(bytes)?;
        // The IPOC may be longer than 32 bits; its lower part counts as well.
        Ok((message.ipoc as u32, message))
    }

    fn place(&mut self, raw: RobMessage, status: SequenceStatus) -> (RobotPose, SequenceStatus) {
        self.delayed |= raw.delayed.is_some_and(|delayed| delayed > 0);
        let status = match status {
            SequenceStatus::Newest { skipped } => {
                let rose_ms = skipped.saturating_add(1);
                let cycle_ms = self.cycle_ms.map_or(rose_ms, |cycle_ms| cycle_ms.min(rose_ms));
                self.cycle_ms = Some(cycle_ms);
                SequenceStatus::Newest { skipped: (rose_ms / cycle_ms).saturating_sub(1) }
            }
            SequenceStatus::First => {
                self.cycle_ms = None;
                status
            }
            SequenceStatus::Late => status,
        };
        let pose = RobotPose {
            sequence: raw.ipoc as u32,
            device_ns: i64::try_from(raw.ipoc).unwrap_or(i64::MAX / MS_NS).saturating_mul(MS_NS),
            base_from_tool: raw.pose,
            status: RobotStatus::Unknown,
            inputs: None,
        };
        (pose, status)
    }

    fn about(&self) -> SourceAbout {
        let late =
            "the controller counts missing answers (Delay): set ONLYSEND to TRUE, else it stops the robot";
        SourceAbout {
            protocol: "KUKA RSI (listening, ONLYSEND)".to_owned(),
            pose: PoseMeaning::TcpInActiveBase,
            clock: "IPOC: the controller's interpolation cycles, in ms",
            controller: None,
            notes: if self.delayed { vec![late.to_owned()] } else { Vec::new() },
        }
    }
}
