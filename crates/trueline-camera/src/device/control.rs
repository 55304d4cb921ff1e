//! Answers commands: registers, control, the clock, and packets that were lost.

use super::privilege::Privilege;
use super::shared::{LOOK, Shared};
use super::words::{locked, word};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::io;
use std::net::{SocketAddr, UdpSocket};
use std::sync::Arc;
use std::time::{Duration, Instant};
use telegenic::emulator::{Reaction, ResendRequest, mark_resent};
use telegenic::gige::proto::bootstrap::{CONTROL_CHANNEL_PRIVILEGE, TIMESTAMP_CONTROL};
use telegenic::gige::proto::gvcp::{
    Cmd, DISCOVERY_CMD, GvcpStatus, PACKET_RESEND_CMD, READ_MEMORY_CMD, READ_REGISTER_CMD, WRITE_MEMORY_ACK,
    WRITE_MEMORY_CMD, WRITE_REGISTER_CMD, encode_write_reg,
};

/// Longest command, bytes.
const LONGEST: usize = 2048;
/// Bit of the control register that latches the clock.
const LATCH: u32 = 2;
/// Headers of internet and UDP in the size of a packet, bytes.
const HEADERS: usize = 28;
/// Kind of packet that carries pixels, in the upper byte of the word with its number.
const PAYLOAD: u32 = 3 << 24;

/// The thread that answers.
pub(super) struct Control {
    shared: Arc<Shared>,
    socket: UdpSocket,
    stream: UdpSocket,
    privilege: Privilege,
    rng: ChaCha8Rng,
}

impl Control {
    pub(super) fn new(shared: Arc<Shared>, socket: UdpSocket, stream: UdpSocket) -> io::Result<Self> {
        socket.set_read_timeout(Some(LOOK))?;
        let rng = ChaCha8Rng::seed_from_u64(shared.settings.seed.wrapping_add(2));
        Ok(Self { shared, socket, stream, privilege: Privilege::default(), rng })
    }

    /// Answers until the device is stopped.
    pub(super) fn run(mut self) {
        let mut buffer = [0; LONGEST];
        while !self.shared.is_stopped() {
            let received = self.socket.recv_from(&mut buffer);
            self.watch_heartbeat();
            // A socket also reports that an earlier answer found no receiver, which does not matter here.
            if let Ok((length, from)) = received
                && !self.shared.is_unplugged()
            {
                self.obey(&buffer[..length], from);
            }
        }
    }

    fn watch_heartbeat(&mut self) {
        let timeout = Duration::from_millis(u64::from(locked(&self.shared.registers).heartbeat_ms()));
        if self.privilege.expire(Instant::now(), timeout) {
            locked(&self.shared.registers).release();
            self.shared.count(|counts| counts.heartbeats_lost += 1);
        }
    }

    fn obey(&mut self, bytes: &[u8], from: SocketAddr) {
        let Some(command) = Cmd::parse(bytes) else { return };
        self.privilege.hear(from, Instant::now());
        match command.command {
            WRITE_REGISTER_CMD => self.write(bytes, &command, from),
            WRITE_MEMORY_CMD => self.write_memory(&command, from),
            READ_REGISTER_CMD | READ_MEMORY_CMD if !self.privilege.may_read(from) => {
                self.deny(&command, from);
            }
            READ_REGISTER_CMD | READ_MEMORY_CMD | DISCOVERY_CMD | PACKET_RESEND_CMD => {
                let reaction = locked(&self.shared.registers).answer(bytes, from);
                self.react(reaction, from);
            }
            _ => {}
        }
    }

    fn write(&mut self, bytes: &[u8], command: &Cmd<'_>, from: SocketAddr) {
        if self.change(command.payload, from) {
            let reaction = locked(&self.shared.registers).answer(bytes, from);
            self.react(reaction, from);
        } else {
            self.deny(command, from);
        }
    }

    /// Some programs write registers as memory, and expect the same to happen.
    fn write_memory(&mut self, command: &Cmd<'_>, from: SocketAddr) {
        let (address, data) = (word(command.payload, 0), command.payload.get(4..).unwrap_or_default());
        let words: Vec<(u32, u32)> =
            (address..).step_by(4).zip(data.chunks_exact(4).map(|bytes| word(bytes, 0))).collect();
        let as_registers = encode_write_reg(&words, command.req_id);
        let payload = as_registers.get(8..).unwrap_or_default();
        if !self.change(payload, from) {
            return self.deny(command, from);
        }
        let mut reaction = locked(&self.shared.registers).answer(&as_registers, from);
        reaction.reply = reaction.reply.map(|reply| {
            let length = u32::try_from(data.len()).unwrap_or(0);
            acknowledge(word(&reply, 0) >> 16, WRITE_MEMORY_ACK, command.req_id, &length.to_be_bytes())
        });
        self.react(reaction, from);
    }

    /// Effects of a write besides the stored value; `false` if the program may not write.
    fn change(&mut self, pairs: &[u8], from: SocketAddr) -> bool {
        let now = Instant::now();
        for pair in pairs.chunks_exact(8) {
            let (address, value) = (word(pair, 0), word(pair, 4));
            let allowed = if address == CONTROL_CHANNEL_PRIVILEGE {
                self.privilege.claim(from, value, now)
            } else {
                self.privilege.may_write(from)
            };
            if !allowed {
                return false;
            }
            if address == CONTROL_CHANNEL_PRIVILEGE && self.privilege.is_free() {
                locked(&self.shared.registers).release();
            }
            if address == TIMESTAMP_CONTROL && value & LATCH != 0 {
                let device_ns = self.shared.clock.device_ns(self.shared.now_ns());
                locked(&self.shared.registers).latch(device_ns);
                self.shared.count(|counts| counts.latches += 1);
            }
        }
        true
    }

    fn deny(&self, command: &Cmd<'_>, from: SocketAddr) {
        self.shared.count(|counts| counts.denied += 1);
        let status = u32::from(GvcpStatus::ACCESS_DENIED.0);
        let _ = self.socket.send_to(&acknowledge(status, command.command + 1, command.req_id, &[]), from);
    }

    fn react(&mut self, reaction: Reaction, from: SocketAddr) {
        // A program that is gone does not read its answer.
        if let Some(reply) = reaction.reply {
            let _ = self.socket.send_to(&reply, from);
        }
        if let (Some(bytes), Some(to)) = (reaction.fire_test, locked(&self.shared.registers).stream_to()) {
            let _ = self.stream.send_to(&vec![0; usize::from(bytes).saturating_sub(HEADERS)], to);
        }
        if let Some(request) = reaction.resend {
            self.send_again(request);
        }
    }

    fn send_again(&mut self, request: ResendRequest) {
        let Some(to) = locked(&self.shared.registers).stream_to() else { return };
        let Some(packets) = self.shared.kept(request.frame_id) else {
            self.shared.count(|counts| counts.forgotten_packets += 1);
            let _ = self.stream.send_to(&forgotten(request), to);
            return;
        };
        let (first, last) = (request.first_packet as usize, request.last_packet as usize);
        for packet in packets.iter().take(last.saturating_add(1)).skip(first) {
            if self.rng.random_bool(self.shared.settings.loss) {
                self.shared.count(|counts| counts.lost_packets += 1);
                continue;
            }
            let mut packet = packet.clone();
            mark_resent(&mut packet);
            let _ = self.stream.send_to(&packet, to);
            self.shared.count(|counts| counts.resent_packets += 1);
        }
    }
}

/// Reports that a packet cannot come any more, so that the program gives its picture up at once.
fn forgotten(request: ResendRequest) -> Vec<u8> {
    let mut packet = GvcpStatus::PACKET_UNAVAILABLE.0.to_be_bytes().to_vec();
    packet.extend((request.frame_id as u16).to_be_bytes());
    packet.extend((PAYLOAD | request.first_packet).to_be_bytes());
    packet
}

fn acknowledge(status: u32, answer: u16, id: u16, payload: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(8 + payload.len());
    for field in [status as u16, answer, payload.len() as u16, id] {
        bytes.extend(field.to_be_bytes());
    }
    bytes.extend(payload);
    bytes
}

/// Hears questions to all cameras on a socket that only receives, and answers from the device's own.
pub(crate) fn answer_broadcasts(shared: &Shared, heard: &UdpSocket, answer: &UdpSocket) {
    let mut buffer = [0; LONGEST];
    while !shared.is_stopped() {
        let Ok((length, from)) = heard.recv_from(&mut buffer) else { continue };
        let bytes = &buffer[..length];
        let is_discovery = Cmd::parse(bytes).is_some_and(|command| command.command == DISCOVERY_CMD);
        if is_discovery && !shared.is_unplugged() {
            let reply = locked(&shared.registers).answer(bytes, from).reply;
            let _ = reply.map(|reply| answer.send_to(&reply, from));
        }
    }
}
