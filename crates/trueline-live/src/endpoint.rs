//! The PC's side of EGM: receives everything that waits, and answers the newest frame alone.
//!
//! The controller reads one answer a cycle from its queue. Answers to every frame of a backlog would be commands of
//! growing age.

use crate::frame_filter::{FrameFilter, Rejection, SequenceStatus};
use crate::host_clock::HostClock;
use crate::robot_frame::RobotFrame;
use crate::stamped_socket::{Arrival, Datagram, StampedSocket};
use std::io;
use std::net::{IpAddr, SocketAddr};
use std::time::Duration;

/// A datagram and its result.
#[derive(Clone, Copy, Debug)]
pub struct Received<'a> {
    /// As it came.
    pub datagram: Datagram<'a>,
    /// Its content, or why it is not used.
    pub judged: Result<(RobotFrame, SequenceStatus), Rejection>,
}

/// The frame to answer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Newest {
    /// Its content.
    pub frame: RobotFrame,
    /// It, or one that was received with it, is the first of a session.
    pub is_first: bool,
    /// Its sender.
    pub from: SocketAddr,
    /// When it came.
    pub arrival: Arrival,
}

/// Most datagrams received before the newest is answered: a flood must not keep the robot waiting.
pub(crate) const MOST_AT_ONCE: usize = 256;

/// Largest number of datagrams discarded at once: more than a receive buffer holds.
const MOST_FORGOTTEN: usize = 100_000;

/// A bound socket and its knowledge of the robot.
pub struct Endpoint {
    socket: StampedSocket,
    frame_filter: FrameFilter,
}

impl Endpoint {
    /// Binds to an address of this machine; accepts one robot, or the first that sends a valid frame.
    ///
    /// # Errors
    /// Error of the operating system.
    pub fn bind(address: SocketAddr, robot: Option<IpAddr>, clock: HostClock) -> io::Result<Self> {
        Ok(Self { socket: StampedSocket::bind(address, clock)?, frame_filter: FrameFilter::new(robot) })
    }

    /// Its own address.
    ///
    /// # Errors
    /// Error of the operating system.
    pub fn local_address(&self) -> io::Result<SocketAddr> {
        self.socket.local_address()
    }

    /// Counts of accepted and rejected messages.
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
    /// Error of the operating system.
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
    /// Error of the operating system.
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
    /// Error of the operating system.
    pub fn send(&self, to: SocketAddr, bytes: &[u8]) -> io::Result<()> {
        self.socket.send(bytes, to)
    }
}
