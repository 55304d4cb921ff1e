//! Simulated controllers that send their poses by datagrams, in real time.

use crate::controller::{Network, Wiring};
use crate::fanuc::hspo_sim;
use crate::fanuc::stream_motion_sim::StreamMotionController;
use crate::kuka::rsi_sim::RsiController;
use crate::pose_feed::PoseFeed;
use crate::wait;
use std::io;
use std::net::{SocketAddr, UdpSocket};
use std::ops::ControlFlow;
use std::time::{Duration, Instant};
use trueline_geometry::Pose;

/// Protocol of a simulated controller.
#[derive(Clone, Debug)]
pub enum Speech {
    /// FANUC's HSPO; its µs counter begins at and wraps at these.
    Hspo {
        /// First value.
        begins_us: u32,
        /// One more than the last.
        wraps_us: u32,
    },
    /// FANUC's Stream Motion.
    StreamMotion(StreamMotionController),
    /// KUKA's RSI; the IPOC at the start.
    Rsi {
        /// First value.
        begins: u64,
        /// Receiver of the answers.
        controller: RsiController,
    },
}

/// A controller and its robot.
pub struct UdpRobot {
    /// Its protocol.
    pub speech: Speech,
    /// Poses of the robot.
    pub feed: PoseFeed,
    /// Time between messages by the controller's clock, ms.
    pub period_ms: u32,
    /// Rate error of that clock, positive if fast, parts per million.
    pub drift_ppm: f64,
    /// The way to the PC.
    pub network: Network<(SocketAddr, Vec<u8>)>,
    /// Its wiring.
    pub wiring: Wiring,
}

/// Counts of the socket's messages.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sent {
    /// Cycles.
    pub cycles: u64,
    /// Datagrams sent.
    pub datagrams: u64,
    /// Datagrams that came.
    pub received: u64,
}

impl UdpRobot {
    /// Runs from a socket until told to stop; a robot that speaks first speaks to `pc`.
    ///
    /// # Errors
    /// Error of the operating system, except a missing receiver.
    pub fn run(
        &mut self,
        socket: &UdpSocket,
        pc: Option<SocketAddr>,
        mut each: impl FnMut(&Sent, Duration) -> ControlFlow<()>,
    ) -> io::Result<Sent> {
        socket.set_nonblocking(true)?;
        let (start, mut sent) = (Instant::now(), Sent::default());
        let start_ns = self.wiring.clock().read().steady_ns;
        // A clock that runs fast makes shorter cycles.
        let period_s = f64::from(self.period_ms) * 1e-3 / (1.0 + self.drift_ppm * 1e-6);
        loop {
            let due_ns = (sent.cycles as f64 * period_s * 1e9) as i64;
            self.answer(socket, start, due_ns, &mut sent)?;
            let pose = self.feed.at(due_ns as f64 * 1e-9);
            self.wiring.tell(start_ns + due_ns, &pose);
            let input = self.wiring.input(start_ns + due_ns).unwrap_or(false);
            for (to, datagram) in self.datagrams(sent.cycles, &pose, input, pc) {
                self.network.send(due_ns, (to, datagram));
            }
            sent.cycles += 1;
            if each(&sent, start.elapsed()).is_break() {
                return Ok(sent);
            }
        }
    }

    /// Until the next cycle: sends messages after their delay, and answers received ones.
    fn answer(&mut self, socket: &UdpSocket, start: Instant, due_ns: i64, sent: &mut Sent) -> io::Result<()> {
        let mut buffer = [0; 2048];
        loop {
            let now_ns = i64::try_from(start.elapsed().as_nanos()).unwrap_or(i64::MAX);
            while let Some((_, (to, datagram))) = self.network.take_due(now_ns) {
                // There may be no receiver.
                sent.datagrams += u64::from(socket.send_to(&datagram, to).is_ok());
            }
            if now_ns >= due_ns {
                return Ok(());
            }
            let next_ns = due_ns.min(self.network.next_due_ns().unwrap_or(i64::MAX));
            wait::until_readable(socket, Duration::from_nanos(u64::try_from(next_ns - now_ns).unwrap_or(0)));
            let Ok((length, from)) = socket.recv_from(&mut buffer) else { continue };
            sent.received += 1;
            match &mut self.speech {
                Speech::StreamMotion(controller) => {
                    if let Some(answer) = controller.receive(&buffer[..length], from) {
                        socket.send_to(&answer, from)?;
                    }
                }
                Speech::Rsi { controller, .. } => controller.receive(&buffer[..length]),
                Speech::Hspo { .. } => {}
            }
        }
    }

    fn datagrams(
        &mut self,
        cycle: u64,
        pose: &Pose,
        input: bool,
        pc: Option<SocketAddr>,
    ) -> Vec<(SocketAddr, Vec<u8>)> {
        let passed_ms = cycle * u64::from(self.period_ms);
        match (&mut self.speech, pc) {
            (Speech::Hspo { begins_us, wraps_us }, Some(pc)) => {
                let clock_us = (u64::from(*begins_us) + passed_ms * 1000) % u64::from(*wraps_us).max(1);
                let packets = hspo_sim::packets(cycle as u32 + 1, clock_us as u32, pose, input.into());
                packets.into_iter().map(|packet| (pc, packet)).collect()
            }
            (Speech::Rsi { begins, controller }, Some(pc)) => {
                let message = controller.message(pose, *begins + passed_ms, input);
                message.into_iter().map(|message| (pc, message.into_bytes())).collect()
            }
            (Speech::StreamMotion(controller), _) => {
                controller.status(passed_ms as u32, pose, input).into_iter().collect()
            }
            (_, None) => Vec::new(),
        }
    }
}
