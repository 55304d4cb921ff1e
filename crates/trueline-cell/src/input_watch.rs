//! Changes of the robot's digital inputs from one of its packets to the next.

use trueline_live::{RobotPacket, RobotPose, SequenceStatus};
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
    /// Change of the inputs with a packet. `None` with the first packet of a session, with a packet that newer ones overtook, and
    /// with robots that do not report their inputs.
    pub(crate) fn change(&mut self, packet: &RobotPacket<'_>) -> Option<InputsEntry> {
        let (RobotPose { device_ns, inputs, .. }, status) = packet.judged.ok()?;
        match status {
            SequenceStatus::First => self.last = None,
            SequenceStatus::Newest { .. } => {}
            // This message is older than the last one.
            SequenceStatus::Late => return None,
        }
        let now = Seen { steady_ns: packet.arrival.steady_ns, device_ns, bits: inputs? };
        let before = self.last.replace(now).filter(|before| before.bits != now.bits)?;
        Some(InputsEntry {
            between_ns: [before.steady_ns, now.steady_ns],
            device_ns: [before.device_ns, now.device_ns],
            bits: [before.bits, now.bits],
        })
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;
    use trueline_geometry::Pose;
    use trueline_live::host_clock::Reading;
    use trueline_live::robot_source::RobotStatus;
    use trueline_live::stamped_socket::Arrival;

    /// The changes of packets, each with its device time in ms, its value and its status, 1 ms apart.
    fn changes(packets: &[(i64, Option<u64>, SequenceStatus)]) -> Vec<([i64; 2], [u64; 2])> {
        let mut watch = InputWatch::default();
        let mut found = Vec::new();
        for (k, (device_ms, inputs, status)) in packets.iter().enumerate() {
            let read = Reading { steady_ns: 1000 * k as i64, wall_ns: 0 };
            let pose = RobotPose {
                sequence: 0,
                device_ns: device_ms * 1_000_000,
                base_from_tool: Pose::identity(),
                status: RobotStatus::Unknown,
                inputs: *inputs,
            };
            let packet = RobotPacket {
                bytes: &[],
                from: "192.168.1.20:40001".parse().unwrap(),
                arrival: Arrival {
                    steady_ns: read.steady_ns,
                    is_of_reading: false,
                    kernel_wall_ns: None,
                    read,
                },
                judged: Ok((pose, *status)),
                egm: None,
            };
            let change = watch.change(&packet);
            found.extend(change.map(|change| (change.device_ns.map(|ns| ns / 1_000_000), change.bits)));
        }
        found
    }

    #[test]
    fn packets_that_were_overtaken_or_begin_anew_change_nothing() {
        let newest = SequenceStatus::Newest { skipped: 0 };
        let late = [
            (4, Some(0), SequenceStatus::First),
            (12, Some(1), newest),
            // From before the edge: the input did not fall and rise again.
            (8, Some(0), SequenceStatus::Late),
            (16, Some(1), newest),
            (20, Some(0), newest),
        ];
        assert_eq!(changes(&late), [([4, 12], [0, 1]), ([16, 20], [1, 0])]);
        let anew =
            [(4, Some(0), SequenceStatus::First), (4, Some(1), SequenceStatus::First), (8, Some(1), newest)];
        assert_eq!(changes(&anew), []);
        let untold = [(4, Some(0), SequenceStatus::First), (8, None, newest), (12, Some(1), newest)];
        assert_eq!(changes(&untold), [([4, 12], [0, 1])]);
    }
}
