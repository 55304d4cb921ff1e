//! When the kernel got each packet: the driver shows packets in passing, and pictures without these stamps.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{SystemTime, UNIX_EPOCH};
use telegenic::gige::proto::bootstrap::TIMESTAMP_CONTROL;
use telegenic::gige::proto::gvcp::{GvcpStatus, WRITE_REGISTER_ACK, WRITE_REGISTER_CMD};
use telegenic::gige::proto::gvsp::ContentType;
use telegenic::{ControlRx, ControlTx, GvcpCmd, GvspPacket, TelemetrySink};
use trueline_live::HostClock;

/// Pictures that are kept until somebody asks: more than are ever under way.
const MOST_PICTURES: usize = 64;

/// The packets of one picture.
#[derive(Clone, Copy, Debug)]
pub(super) struct Packets {
    block: u64,
    /// Steady time of the first packet, ns.
    pub first_ns: i64,
    /// Steady time of the last packet, ns.
    pub last_ns: i64,
    /// Packets that came after a second request.
    pub resent: u32,
    /// Most bytes of pixels in a packet.
    pub most_bytes: usize,
}

/// The packets of the pictures under way.
#[derive(Clone)]
pub(super) struct PacketStamps {
    clock: HostClock,
    pictures: Arc<Mutex<VecDeque<Packets>>>,
}

impl PacketStamps {
    /// Nothing yet.
    pub(super) fn new(clock: HostClock) -> Self {
        Self { clock, pictures: Arc::default() }
    }

    /// The packets of a picture, which with all older ones is forgotten.
    pub(super) fn take(&self, block: u64) -> Option<Packets> {
        let mut pictures = locked(&self.pictures);
        let at = pictures.iter().position(|packets| packets.block == block)?;
        pictures.drain(..=at).next_back()
    }

    /// Steady time of the newest packet, ns.
    pub(super) fn newest_ns(&self) -> Option<i64> {
        locked(&self.pictures).back().map(|packets| packets.last_ns)
    }
}

impl TelemetrySink<GvcpCmd, GvspPacket> for PacketStamps {
    fn sent(&self, _: &GvcpCmd, _: SystemTime) {}

    fn received(&self, packet: &GvspPacket, kernel: SystemTime) {
        if packet.status.is_error() {
            return;
        }
        let at_ns = steady_ns(self.clock, kernel);
        let mut pictures = locked(&self.pictures);
        // Nearly always the newest; packets of the one before may still be sent again.
        let at = pictures.iter().rposition(|packets| packets.block == packet.frame_id);
        let at = at.unwrap_or_else(|| {
            if pictures.len() >= MOST_PICTURES {
                pictures.pop_front();
            }
            let new =
                Packets { block: packet.frame_id, first_ns: at_ns, last_ns: at_ns, resent: 0, most_bytes: 0 };
            pictures.push_back(new);
            pictures.len() - 1
        });
        let packets = &mut pictures[at];
        packets.last_ns = packets.last_ns.max(at_ns);
        packets.resent += u32::from(packet.status == GvcpStatus::PACKET_RESEND);
        if packet.content_type == ContentType::Payload {
            packets.most_bytes = packets.most_bytes.max(packet.data.len());
        }
    }
}

/// When the answer to the newest latch command came.
#[derive(Clone)]
pub(super) struct LatchStamps {
    clock: HostClock,
    newest: Arc<Mutex<Newest>>,
}

#[derive(Default)]
struct Newest {
    command: Option<u16>,
    answered_ns: Option<i64>,
}

impl LatchStamps {
    /// Nothing yet.
    pub(super) fn new(clock: HostClock) -> Self {
        Self { clock, newest: Arc::default() }
    }

    /// Steady time at which the answer came, ns; asked once.
    pub(crate) fn take_answered_ns(&self) -> Option<i64> {
        let mut newest = locked(&self.newest);
        newest.command = None;
        newest.answered_ns.take()
    }
}

impl TelemetrySink<ControlTx, ControlRx> for LatchStamps {
    fn sent(&self, sent: &ControlTx, _: SystemTime) {
        if let ControlTx::Cmd { cmd, .. } = sent
            && cmd.command == WRITE_REGISTER_CMD
            && cmd.payload.starts_with(&TIMESTAMP_CONTROL.to_be_bytes())
        {
            *locked(&self.newest) = Newest { command: Some(cmd.req_id), answered_ns: None };
        }
    }

    fn received(&self, received: &ControlRx, kernel: SystemTime) {
        if let ControlRx::Ack(ack) = received
            && ack.answer == WRITE_REGISTER_ACK
        {
            let mut newest = locked(&self.newest);
            if newest.command == Some(ack.ack_id) {
                newest.answered_ns = Some(steady_ns(self.clock, kernel));
            }
        }
    }
}

fn steady_ns(clock: HostClock, kernel: SystemTime) -> i64 {
    let read = clock.read();
    let wall_ns = kernel.duration_since(UNIX_EPOCH).ok().and_then(|d| i64::try_from(d.as_nanos()).ok());
    wall_ns.and_then(|wall_ns| HostClock::steady_ns(read, wall_ns)).unwrap_or(read.steady_ns)
}

/// Data of another thread that panicked are still whole: only numbers are written.
fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
