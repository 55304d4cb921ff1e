//! A robot that speaks RTDE, over TCP. The connection is made anew when it was lost; nothing is ever written to the robot.

use super::session::{Session, SessionError, Told};
use crate::frame_filter::{Rejection, SequenceStatus};
use crate::host_clock::HostClock;
use crate::robot_source::{PoseMeaning, RobotPacket, RobotPose, RobotSource, SourceAbout, SourceError};
use crate::stamped_socket::Arrival;
use std::io::{ErrorKind, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::time::{Duration, Instant};

/// A controller that does not answer for so long is not there.
const CONNECT: Duration = Duration::from_secs(2);
/// Between attempts.
const AGAIN: Duration = Duration::from_millis(500);
/// A stream that is silent for so long is over: TCP itself would wait for minutes.
const SILENT: Duration = Duration::from_secs(2);
/// Most that is read at once, bytes.
const CHUNK: usize = 16 << 10;
/// Most notes that are kept.
const NOTES: usize = 100;

struct Connected {
    stream: TcpStream,
    session: Session,
    heard: Instant,
}

/// A robot at an address.
pub struct RtdeSource {
    address: SocketAddr,
    clock: HostClock,
    connected: Option<Connected>,
    tried: Option<Instant>,
    order: Order,
    controller: Option<String>,
    version: u16,
    notes: Vec<String>,
}

impl RtdeSource {
    /// A robot at an address (usually port [`super::PORT`]); it is connected to when it is first asked.
    #[must_use]
    pub fn new(address: SocketAddr, clock: HostClock) -> Self {
        Self {
            address,
            clock,
            connected: None,
            tried: None,
            order: Order::default(),
            controller: None,
            version: 2,
            notes: Vec::new(),
        }
    }

    fn connect(&mut self) -> Result<(), SourceError> {
        let since = self.tried.map_or(AGAIN, |tried| tried.elapsed());
        std::thread::sleep(AGAIN.saturating_sub(since));
        self.tried = Some(Instant::now());
        let address = self.address;
        let io = |error| SourceError::Io { address, error };
        let mut stream = TcpStream::connect_timeout(&address, CONNECT).map_err(io)?;
        stream.set_nodelay(true).map_err(io)?;
        let (session, first) = Session::begin();
        stream.write_all(&first).map_err(io)?;
        self.order.begin_anew();
        self.connected = Some(Connected { stream, session, heard: Instant::now() });
        Ok(())
    }

    fn read(&mut self, timeout: Duration, each: &mut dyn FnMut(&RobotPacket<'_>)) -> Result<(), SourceError> {
        let address = self.address;
        let Some(Connected { stream, session, heard }) = &mut self.connected else { return Ok(()) };
        let io = |error| SourceError::Io { address, error };
        stream.set_read_timeout(Some(timeout.max(Duration::from_millis(1)))).map_err(io)?;
        let mut chunk = [0; CHUNK];
        let length = match stream.read(&mut chunk) {
            Ok(0) => return Err(SourceError::Closed { address }),
            Ok(length) => length,
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {
                let silent = heard.elapsed() > SILENT;
                return if silent { Err(SourceError::Closed { address }) } else { Ok(()) };
            }
            Err(error) if error.kind() == ErrorKind::Interrupted => return Ok(()),
            Err(error) => return Err(io(error)),
        };
        *heard = Instant::now();
        let read = self.clock.read();
        let arrival = Arrival { steady_ns: read.steady_ns, is_of_reading: false, kernel_wall_ns: None, read };
        let (order, notes, controller) = (&mut self.order, &mut self.notes, &mut self.controller);
        let mut send = Vec::new();
        let mut arrival = arrival;
        let taken = session.take(&chunk[..length], &mut send, |bytes, told| match told {
            Told::Pose(judged) => {
                // Packages that were read at once came one after the other: no two have one stamp.
                arrival.steady_ns += 1;
                let judged = judged.map(|pose| order.place(pose)).map_err(Rejection::from);
                each(&RobotPacket { bytes, from: address, arrival, judged, egm: None });
            }
            Told::Controller([major, minor, bugfix, build]) => {
                *controller = Some(format!("URControl {major}.{minor}.{bugfix}.{build}"));
            }
            Told::Text(level, words) => {
                note(notes, format!("message of the controller ({}): {words}", gravity(level)));
            }
            Told::ToolChanged => {
                order.begin_anew();
                note(notes, "the TCP was changed: poses before and after are of different frames".to_owned());
            }
            Told::Odd(what) => note(notes, what.to_owned()),
        });
        self.version = session.version();
        let refused = |error: SessionError| SourceError::Refused { address, why: error.to_string() };
        taken.map_err(refused)?;
        stream.write_all(&send).map_err(io)
    }
}

impl RobotSource for RtdeSource {
    fn receive(
        &mut self,
        timeout: Duration,
        each: &mut dyn FnMut(&RobotPacket<'_>),
    ) -> Result<(), SourceError> {
        if self.connected.is_none() {
            self.connect()?;
        }
        let read = self.read(timeout, each);
        if read.is_err() {
            self.connected = None;
        }
        read
    }

    fn about(&self) -> SourceAbout {
        SourceAbout {
            protocol: format!("Universal Robots RTDE, version {}", self.version),
            pose: PoseMeaning::TcpInBase,
            clock: "s since the controller was started, in steps of its cycle",
            controller: self.controller.clone(),
            notes: self.notes.clone(),
        }
    }
}

fn note(notes: &mut Vec<String>, words: String) {
    if notes.len() < NOTES && !notes.contains(&words) {
        notes.push(words);
    }
}

fn gravity(level: u8) -> &'static str {
    match level {
        0 => "exception",
        1 => "error",
        2 => "warning",
        _ => "information",
    }
}

/// RTDE has no numbers. Losses show as a gap of the stamps, and a restarted controller as falling stamps.
#[derive(Clone, Debug, Default)]
struct Order {
    last_ns: Option<i64>,
    period_ns: Option<i64>,
    cycle: u32,
}

impl Order {
    fn begin_anew(&mut self) {
        self.last_ns = None;
    }

    /// A pose with the number of its cycle, and its place in the stream.
    fn place(&mut self, pose: RobotPose) -> (RobotPose, SequenceStatus) {
        let passed_ns = self.last_ns.map(|last_ns| pose.device_ns - last_ns);
        self.last_ns = Some(pose.device_ns);
        let Some(passed_ns) = passed_ns.filter(|passed_ns| *passed_ns > 0) else {
            self.cycle = self.cycle.wrapping_add(1);
            return (RobotPose { sequence: self.cycle, ..pose }, SequenceStatus::First);
        };
        let period_ns = self.period_ns.map_or(passed_ns, |period_ns| period_ns.min(passed_ns));
        self.period_ns = Some(period_ns);
        let cycles = (passed_ns + period_ns / 2) / period_ns;
        let cycles = u32::try_from(cycles).unwrap_or(u32::MAX).max(1);
        self.cycle = self.cycle.wrapping_add(cycles);
        (RobotPose { sequence: self.cycle, ..pose }, SequenceStatus::Newest { skipped: cycles - 1 })
    }
}
