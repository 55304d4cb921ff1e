//! The PC's side of EGM: receives everything that waits, and answers the newest frame alone.
//!
//! The controller reads one answer a cycle from its queue. Whoever answers every frame of a backlog hands it commands
//! that grow older and older.

use crate::frame_filter::{FrameFilter, Rejection, SequenceStatus};
use crate::host_clock::HostClock;
use crate::robot_frame::RobotFrame;
use crate::stamped_socket::{Arrival, Datagram, StampedSocket};
use std::io;
use std::net::{IpAddr, SocketAddr};
use std::time::Duration;

/// A datagram and what became of it.
#[derive(Clone, Copy, Debug)]
pub struct Received<'a> {
    /// As it came.
    pub datagram: Datagram<'a>,
    /// What it is, or why it is not used.
    pub judged: Result<(RobotFrame, SequenceStatus), Rejection>,
}

/// The frame to answer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Newest {
    /// What it says.
    pub frame: RobotFrame,
    /// It, or one that was received with it, is the first of a session.
    pub is_first: bool,
    /// Whose it is.
    pub from: SocketAddr,
    /// When it came.
    pub arrival: Arrival,
}

/// Most datagrams received before the newest is answered: a flood must not keep the robot waiting.
pub(crate) const MOST_AT_ONCE: usize = 256;

/// Most datagrams left unheard at once: more than a receive buffer holds.
const MOST_FORGOTTEN: usize = 100_000;

/// A bound socket and what it knows of the robot.
pub struct Endpoint {
    socket: StampedSocket,
    frame_filter: FrameFilter,
}

impl Endpoint {
    /// Binds to an address of this machine; accepts one robot, or the first that sends a valid frame.
    ///
    /// # Errors
    /// What the operating system says.
    pub fn bind(address: SocketAddr, robot: Option<IpAddr>, clock: HostClock) -> io::Result<Self> {
        Ok(Self { socket: StampedSocket::bind(address, clock)?, frame_filter: FrameFilter::new(robot) })
    }

    /// Where it listens.
    ///
    /// # Errors
    /// What the operating system says.
    pub fn local_address(&self) -> io::Result<SocketAddr> {
        self.socket.local_address()
    }

    /// What has been accepted and rejected.
    #[must_use]
    pub fn frame_filter(&self) -> &FrameFilter {
        &self.frame_filter
    }

    /// The clocks that stamp.
    #[must_use]
    pub fn clock(&self) -> HostClock {
        self.socket.clock()
    }

    /// Waits for the robot; hands over every datagram that is there, and returns the frame to answer.
    ///
    /// # Errors
    /// What the operating system says.
    pub fn receive(
        &mut self,
        timeout: Duration,
        mut each: impl FnMut(&Received<'_>),
    ) -> io::Result<Option<Newest>> {
        let Self { socket, frame_filter } = self;
        let mut newest: Option<Newest> = None;
        let mut waiting = socket.wait(timeout)?;
        for _ in 0..MOST_AT_ONCE {
            let Some(datagram) = waiting else { break };
            let judged = frame_filter.judge(datagram.bytes, datagram.from, datagram.arrival.steady_ns);
            each(&Received { datagram, judged });
            if let Ok((frame, status @ (SequenceStatus::First | SequenceStatus::Newest { .. }))) = judged {
                let is_first =
                    status == SequenceStatus::First || newest.is_some_and(|before| before.is_first);
                newest = Some(Newest { frame, is_first, from: datagram.from, arrival: datagram.arrival });
            }
            waiting = socket.next_waiting()?;
        }
        Ok(newest)
    }

    /// Discards queued datagrams that arrived before we started listening.
    ///
    /// # Errors
    /// What the operating system says.
    pub fn discard_waiting(&mut self) -> io::Result<()> {
        for _ in 0..MOST_FORGOTTEN {
            if self.socket.next_waiting()?.is_none() {
                break;
            }
        }
        Ok(())
    }

    /// Sends a datagram.
    ///
    /// # Errors
    /// What the operating system says.
    pub fn send(&self, to: SocketAddr, bytes: &[u8]) -> io::Result<()> {
        self.socket.send(bytes, to)
    }
}
