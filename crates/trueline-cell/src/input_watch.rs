//! Changes of the robot's digital inputs from one of its packets to the next.

use trueline_live::{LinkPacket, RobotPacket};
use trueline_mcap::InputsEntry;

/// Looks at the inputs in every packet that is used.
#[derive(Debug, Default)]
pub(crate) struct InputWatch {
    last: Option<Seen>,
}

#[derive(Clone, Copy, Debug)]
struct Seen {
    steady_ns: i64,
    device_ns: i64,
    bits: u64,
}

impl InputWatch {
    /// What changed with a packet; nothing with the first, and with robots that do not tell their inputs.
    pub(crate) fn change(&mut self, packet: LinkPacket<'_>) -> Option<InputsEntry> {
        let LinkPacket::Other(RobotPacket { arrival, judged: Ok((pose, _)), .. }) = packet else {
            return None;
        };
        let now = Seen { steady_ns: arrival.steady_ns, device_ns: pose.device_ns, bits: pose.inputs? };
        let before = self.last.replace(now).filter(|before| before.bits != now.bits)?;
        Some(InputsEntry {
            between_ns: [before.steady_ns, now.steady_ns],
            device_ns: [before.device_ns, now.device_ns],
            bits: [before.bits, now.bits],
        })
    }
}
