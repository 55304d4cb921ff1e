//! A simulated controller on a real network, for foreign programs.

use super::controller::Controller;
use super::network::Network;
use super::wiring::Wiring;
use crate::stamped_socket::LONGEST_BYTES;
use crate::wait;
use std::fmt;
use std::io;
use std::net::{IpAddr, SocketAddr, UdpSocket};
use std::ops::ControlFlow;
use std::time::{Duration, Instant};

/// A controller that sends to a PC.
pub struct RealTime {
    controller: Controller,
    to_pc: Network<Vec<u8>>,
    to_robot: Network<(IpAddr, Vec<u8>)>,
    socket: UdpSocket,
    from: SocketAddr,
    pc: SocketAddr,
    counts: Counts,
    wiring: Wiring,
}

/// A cycle that is done.
pub struct Cycle<'a> {
    /// The controller.
    pub controller: &'a Controller,
    /// Time since the start.
    pub passed: Duration,
}

/// Counts of the socket's messages.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Datagrams sent.
    pub sent: u64,
    /// Datagrams without a receiver.
    pub unreachable: u64,
    /// Datagrams received.
    pub received: u64,
}

impl RealTime {
    /// Binds to an address, usually port 0, and will send to the PC: the controller speaks first.
    ///
    /// # Errors
    /// Error of the operating system.
    pub fn bind(
        controller: Controller,
        to_pc: Network<Vec<u8>>,
        to_robot: Network<(IpAddr, Vec<u8>)>,
        from: SocketAddr,
        pc: SocketAddr,
    ) -> io::Result<Self> {
        let socket = open(from)?;
        let (counts, wiring) = (Counts::default(), Wiring::default());
        Ok(Self { controller, to_pc, to_robot, socket, from, pc, counts, wiring })
    }

    /// The same with something wired to it.
    #[must_use]
    pub fn wired(self, wiring: Wiring) -> Self {
        Self { wiring, ..self }
    }

    /// The controller.
    #[must_use]
    pub fn controller(&self) -> &Controller {
        &self.controller
    }

    /// Counts of sent and received messages.
    #[must_use]
    pub fn counts(&self) -> Counts {
        self.counts
    }

    /// Messages that the simulated network lost.
    #[must_use]
    pub fn lost(&self) -> u64 {
        self.to_pc.lost() + self.to_robot.lost()
    }

    /// Runs until told to stop; `each` is called after every cycle.
    ///
    /// # Errors
    /// Error of the operating system, except a missing receiver.
    pub fn run(&mut self, mut each: impl FnMut(&Cycle<'_>) -> ControlFlow<()>) -> io::Result<()> {
        let (start, start_ns) = (Instant::now(), self.wiring.clock().read().steady_ns);
        let mut buffer = [0; LONGEST_BYTES];
        loop {
            let now_ns = i64::try_from(start.elapsed().as_nanos()).unwrap_or(i64::MAX);
            while let Some((_, datagram)) = self.to_pc.take_due(now_ns) {
                match self.socket.send_to(&datagram, self.pc) {
                    Ok(_) => self.counts.sent += 1,
                    Err(error) if nobody_there(&error) => self.counts.unreachable += 1,
                    Err(error) => return Err(error),
                }
            }
            if self.controller.next_cycle_ns() <= now_ns {
                let cycle_ns = self.controller.next_cycle_ns();
                self.controller.set_digital(self.wiring.input(start_ns + cycle_ns));
                self.run_cycle(now_ns)?;
                if let Some(pose) = self.controller.true_pose(cycle_ns) {
                    self.wiring.tell(start_ns + cycle_ns, &pose);
                }
                let cycle = Cycle { controller: &self.controller, passed: start.elapsed() };
                if each(&cycle).is_break() {
                    return Ok(());
                }
            }
            let next_ns = self.controller.next_cycle_ns().min(self.to_pc.next_due_ns().unwrap_or(i64::MAX));
            let wait = Duration::from_nanos(u64::try_from(next_ns - now_ns).unwrap_or(0));
            self.listen(&mut buffer, wait, start)?;
        }
    }

    fn run_cycle(&mut self, now_ns: i64) -> io::Result<()> {
        while let Some((_, (from, answer))) = self.to_robot.take_due(now_ns) {
            self.controller.receive(&answer, from);
        }
        let sessions = self.controller.sessions();
        if let Some(datagram) = self.controller.run_cycle() {
            self.to_pc.send(now_ns, datagram);
        }
        if self.controller.sessions() != sessions && self.from.port() == 0 {
            self.socket = open(self.from)?;
        }
        Ok(())
    }

    /// Waits for the next task and receives messages meanwhile.
    fn listen(&mut self, buffer: &mut [u8], wait: Duration, start: Instant) -> io::Result<()> {
        wait::until_readable(&self.socket, wait);
        match self.socket.recv_from(buffer) {
            Ok((length, from)) => {
                self.counts.received += 1;
                let now_ns = i64::try_from(start.elapsed().as_nanos()).unwrap_or(i64::MAX);
                self.to_robot.send(now_ns, (from.ip(), buffer[..length].to_vec()));
                Ok(())
            }
            Err(error) if is_pause(&error) => Ok(()),
            Err(error) => Err(error),
        }
    }
}

fn open(address: SocketAddr) -> io::Result<UdpSocket> {
    let socket = UdpSocket::bind(address)?;
    socket.set_nonblocking(true)?;
    Ok(socket)
}

fn nobody_there(error: &io::Error) -> bool {
    use io::ErrorKind::{ConnectionRefused, HostUnreachable, NetworkUnreachable};
    matches!(error.kind(), ConnectionRefused | HostUnreachable | NetworkUnreachable)
}

fn is_pause(error: &io::Error) -> bool {
    use io::ErrorKind::{ConnectionRefused, Interrupted, TimedOut, WouldBlock};
    matches!(error.kind(), WouldBlock | TimedOut | Interrupted | ConnectionRefused)
}

/// Counts of sent, lost and answered messages.
impl fmt::Display for RealTime {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Counts { sent, unreachable, received } = self.counts;
        let (taken, refused) = self.controller.answers();
        let lost = self.lost();
        write!(f, "{sent} frames sent, {lost} lost on purpose; {received} answers came, {taken} were taken")?;
        if unreachable > 0 {
            write!(f, "; {unreachable} frames had no receiver")?;
        }
        refused.iter().try_for_each(|(reason, count)| write!(f, "\n  {count} answers refused: {reason}"))
    }
}
