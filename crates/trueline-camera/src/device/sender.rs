//! Sends pictures when they are due, packet by packet.

use super::facts::SentFrame;
use super::pacing::Pacing;
use super::shared::{LOOK, PacketList, Shared};
use super::words::locked;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::net::{SocketAddr, UdpSocket};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError};

/// A picture that is ready.
pub(super) struct Outgoing {
    pub block_id: u16,
    pub packets: PacketList,
    pub to: SocketAddr,
    /// Steady time at which the first packet leaves, ns.
    pub due_ns: i64,
    pub device_ns: i64,
    /// Steady time, ns.
    pub exposure_start_ns: i64,
    /// Allowed delay because of earlier pictures, ns: the memory of a camera.
    pub patience_ns: i64,
}

/// The thread that sends.
pub(super) struct Sender {
    shared: Arc<Shared>,
    socket: UdpSocket,
    rng: ChaCha8Rng,
}

impl Sender {
    pub(super) fn new(shared: Arc<Shared>, socket: UdpSocket) -> Self {
        let rng = ChaCha8Rng::seed_from_u64(shared.settings.seed);
        Self { shared, socket, rng }
    }

    /// Sends pictures until the device is stopped.
    pub(super) fn run(mut self, pictures: &Receiver<Outgoing>) {
        loop {
            match pictures.recv_timeout(LOOK) {
                Ok(picture) if self.shared.sleep_until(picture.due_ns) => self.send(&picture),
                Err(RecvTimeoutError::Timeout) if !self.shared.is_stopped() => {}
                _ => return,
            }
        }
    }

    fn send(&mut self, picture: &Outgoing) {
        // The program may have closed the stream while the picture waited.
        let still_wanted = locked(&self.shared.registers).stream_to() == Some(picture.to);
        if self.shared.is_unplugged() || !still_wanted {
            return;
        }
        if self.shared.now_ns() - picture.due_ns > picture.patience_ns {
            return self.shared.count(|counts| counts.link_busy += 1);
        }
        self.shared.keep(u64::from(picture.block_id), Arc::clone(&picture.packets));
        let first_packet_ns = self.shared.now_ns();
        let mut pacing = Pacing::start(first_packet_ns, self.shared.settings.pace_bits_per_s);
        let (mut lost, mut errors) = (0, 0);
        for packet in picture.packets.iter() {
            if let Some(at_ns) = pacing.wait_until_ns(self.shared.now_ns(), packet.len())
                && !self.shared.sleep_until(at_ns)
            {
                return;
            }
            if self.rng.random_bool(self.shared.settings.loss) {
                lost += 1;
            } else if self.shared.is_unplugged() {
                return;
            } else if self.socket.send_to(packet, picture.to).is_err() {
                errors += 1;
            }
        }
        self.shared.count(|counts| {
            counts.sent += 1;
            counts.packets += picture.packets.len() as u64;
            counts.lost_packets += lost;
            counts.send_errors += errors;
        });
        self.shared.tell(SentFrame {
            block_id: picture.block_id,
            device_ns: picture.device_ns,
            exposure_start_ns: picture.exposure_start_ns,
            first_packet_ns,
            last_packet_ns: self.shared.now_ns(),
        });
    }
}
