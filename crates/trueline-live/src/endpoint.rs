//! The PC's side of EGM: hears everything that waits, and answers the newest frame alone.
//!
//! The controller reads one answer a cycle from its queue. Whoever answers every frame of a backlog hands it commands
//! that grow older and older.

use crate::host_clock::HostClock;
use crate::intake::{Intake, Rejection, Standing};
use crate::robot_frame::RobotFrame;
use crate::stamped_socket::{Arrival, Datagram, StampedSocket};
use std::io;
use std::net::{IpAddr, SocketAddr};
use std::time::Duration;

/// A datagram and what became of it.
#[derive(Clone, Copy, Debug)]
pub struct Heard<'a> {
    /// As it came.
    pub datagram: Datagram<'a>,
    /// What it is, or why it is not used.
    pub judged: Result<(RobotFrame, Standing), Rejection>,
}

/// The frame to answer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Newest {
    /// What it says.
    pub frame: RobotFrame,
    /// It, or one that was heard with it, is the first of a session.
    pub is_first: bool,
    /// Whose it is.
    pub from: SocketAddr,
    /// When it came.
    pub arrival: Arrival,
}

/// Most datagrams heard before the newest is answered: a flood must not keep the robot waiting.
const MOST_AT_ONCE: usize = 256;

/// Most datagrams left unheard at once: more than a receive buffer holds.
const MOST_FORGOTTEN: usize = 100_000;

/// A bound socket and what it knows of the robot.
pub struct Endpoint {
    socket: StampedSocket,
    intake: Intake,
}

impl Endpoint {
    /// Listens at an address of this machine; to one robot, or to the first that is heard.
    ///
    /// # Errors
    /// What the operating system says.
    pub fn bind(address: SocketAddr, robot: Option<IpAddr>, clock: HostClock) -> io::Result<Self> {
        Ok(Self { socket: StampedSocket::bind(address, clock)?, intake: Intake::new(robot) })
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
    pub fn intake(&self) -> &Intake {
        &self.intake
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
    pub fn hear(
        &mut self,
        timeout: Duration,
        mut each: impl FnMut(&Heard<'_>),
    ) -> io::Result<Option<Newest>> {
        let Self { socket, intake } = self;
        let mut newest: Option<Newest> = None;
        let mut waiting = socket.wait(timeout)?;
        for _ in 0..MOST_AT_ONCE {
            let Some(datagram) = waiting else { break };
            let judged = intake.judge(datagram.bytes, datagram.from, datagram.arrival.steady_ns);
            each(&Heard { datagram, judged });
            if let Ok((frame, standing @ (Standing::First | Standing::Newest { .. }))) = judged {
                let is_first = standing == Standing::First || newest.is_some_and(|before| before.is_first);
                newest = Some(Newest { frame, is_first, from: datagram.from, arrival: datagram.arrival });
            }
            waiting = socket.next_waiting()?;
        }
        Ok(newest)
    }

    /// Leaves what came before now unheard: it is from before anybody was there to act on it.
    ///
    /// # Errors
    /// What the operating system says.
    pub fn forget_waiting(&mut self) -> io::Result<()> {
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
