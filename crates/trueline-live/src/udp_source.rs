//! Robots that report their pose by datagrams: one socket, and the same rules of acceptance for all of them.

use crate::endpoint::MOST_AT_ONCE;
use crate::frame_filter::{FrameFilter, Rejection, SequenceStatus};
use crate::host_clock::HostClock;
use crate::robot_answer::RobotAnswer;
use crate::robot_source::{RobotPacket, RobotPose, RobotSource, SourceAbout, SourceError};
use crate::stamped_socket::{Datagram, StampedSocket};
use std::io;
use std::net::{IpAddr, SocketAddr};
use std::time::Duration;

/// One protocol: the content of its datagrams.
pub trait DatagramProtocol: Send {
    /// Content of a datagram before its place in the stream is known.
    type Raw;

    /// Reads a datagram: its number, and its content.
    ///
    /// # Errors
    /// Why it is not used.
    fn decode(&self, bytes: &[u8]) -> Result<(u32, Self::Raw), Rejection>;

    /// Puts it in its place: for counters with gaps, and clocks that wrap.
    fn place(&mut self, raw: Self::Raw, status: SequenceStatus) -> (RobotPose, SequenceStatus);

    /// Its protocol.
    fn about(&self) -> SourceAbout;

    /// Messages to send at a steady time, ns, so that the robot speaks. Nothing of it moves the robot.
    fn ask(&mut self, _now_ns: i64) -> Vec<Vec<u8>> {
        Vec::new()
    }

    /// Observes any datagram.
    fn notice(&mut self, _bytes: &[u8], _now_ns: i64) {}

    /// Answer to the robot after all its messages were read, at a steady time, ns. Nothing of it moves the robot.
    fn answer(&mut self, _now_ns: i64) -> Option<Vec<u8>> {
        None
    }

    /// Whether the robot waits for answers.
    fn must_answer(&self) -> bool {
        false
    }

    /// Why the robot is not to be listened to any longer.
    fn refusal(&self) -> Option<String> {
        None
    }

    /// Message sent before the socket is closed.
    fn farewell(&self) -> Option<Vec<u8>> {
        None
    }
}

/// Answers that are kept until somebody asks for them.
const MOST_KEPT: usize = 1000;

/// A socket and its knowledge of its robot.
pub struct UdpSource<P: DatagramProtocol> {
    socket: StampedSocket,
    local: SocketAddr,
    /// Whom the PC speaks to, if it is to speak first.
    robot: Option<SocketAddr>,
    filter: FrameFilter,
    protocol: P,
    answers: Vec<RobotAnswer>,
    unsent: u64,
}

impl<P: DatagramProtocol> UdpSource<P> {
    /// Listens at an address of this machine; to one robot, or to the first that sends a good packet.
    ///
    /// # Errors
    /// Error of the operating system.
    pub fn listen(
        address: SocketAddr,
        robot: Option<IpAddr>,
        protocol: P,
        clock: HostClock,
    ) -> io::Result<Self> {
        let socket = StampedSocket::bind(address, clock)?;
        let local = socket.local_address()?;
        Ok(Self {
            socket,
            local,
            robot: None,
            filter: FrameFilter::new(robot),
            protocol,
            answers: Vec::new(),
            unsent: 0,
        })
    }

    /// Asks a robot to speak.
    ///
    /// # Errors
    /// Error of the operating system.
    pub fn call(robot: SocketAddr, protocol: P, clock: HostClock) -> io::Result<Self> {
        let any: IpAddr = if robot.is_ipv4() { [0; 4].into() } else { [0_u16; 8].into() };
        let mut called = Self::listen(SocketAddr::new(any, 0), Some(robot.ip()), protocol, clock)?;
        called.robot = Some(robot);
        Ok(called)
    }

    /// Its own address.
    #[must_use]
    pub fn local_address(&self) -> SocketAddr {
        self.local
    }

    fn error(&self, error: io::Error) -> SourceError {
        SourceError::Io { address: self.robot.unwrap_or(self.local), error }
    }

    fn speak(&mut self) -> io::Result<()> {
        let Some(robot) = self.robot else { return Ok(()) };
        let now_ns = self.socket.clock().read().steady_ns;
        for datagram in self.protocol.ask(now_ns) {
            self.socket.send(&datagram, robot)?;
        }
        Ok(())
    }

    fn receive_each(&mut self, timeout: Duration, each: &mut dyn FnMut(&RobotPacket<'_>)) -> io::Result<()> {
        let Self { socket, filter, protocol, .. } = self;
        let mut waiting = socket.wait(timeout)?;
        for _ in 0..MOST_AT_ONCE {
            let Some(datagram) = waiting else { break };
            each(&judge(filter, protocol, datagram));
            waiting = socket.next_waiting()?;
        }
        self.answer();
        Ok(())
    }

    /// An answer that the system does not take is not tried again: its cycle is over.
    fn answer(&mut self) {
        let now_ns = self.socket.clock().read().steady_ns;
        let (Some(bytes), Some(to)) = (self.protocol.answer(now_ns), self.filter.robot()) else { return };
        match self.socket.send(&bytes, to) {
            Ok(()) if self.answers.len() < MOST_KEPT => {
                self.answers.push(RobotAnswer { bytes, to, steady_ns: now_ns });
            }
            Ok(()) => {}
            Err(_) => self.unsent += 1,
        }
    }
}

fn judge<'a, P: DatagramProtocol>(
    filter: &mut FrameFilter,
    protocol: &mut P,
    datagram: Datagram<'a>,
) -> RobotPacket<'a> {
    let Datagram { bytes, from, arrival, .. } = datagram;
    let judged = filter.judge_as(bytes, from, arrival.steady_ns, |bytes| protocol.decode(bytes));
    if !matches!(judged, Err(Rejection::OtherSender)) {
        protocol.notice(bytes, arrival.steady_ns);
    }
    let judged = judged.map(|(raw, status)| protocol.place(raw, status));
    RobotPacket { bytes, from, arrival, judged, egm: None }
}

impl<P: DatagramProtocol> RobotSource for UdpSource<P> {
    fn receive(
        &mut self,
        timeout: Duration,
        each: &mut dyn FnMut(&RobotPacket<'_>),
    ) -> Result<(), SourceError> {
        self.speak().map_err(|error| self.error(error))?;
        self.receive_each(timeout, each).map_err(|error| self.error(error))?;
        match self.protocol.refusal() {
            Some(why) => Err(SourceError::Refused { address: self.robot.unwrap_or(self.local), why }),
            None => Ok(()),
        }
    }

    fn about(&self) -> SourceAbout {
        let mut about = self.protocol.about();
        if self.unsent > 0 {
            about.notes.push(format!("{} answers could not be sent", self.unsent));
        }
        about
    }

    fn must_answer(&self) -> bool {
        self.protocol.must_answer()
    }

    fn take_answers(&mut self) -> Vec<RobotAnswer> {
        std::mem::take(&mut self.answers)
    }
}

impl<P: DatagramProtocol> Drop for UdpSource<P> {
    fn drop(&mut self) {
        if let (Some(robot), Some(farewell)) = (self.robot, self.protocol.farewell()) {
            // A robot that misses it stops by itself.
            let _ = self.socket.send(&farewell, robot);
        }
    }
}
