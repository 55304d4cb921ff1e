//! A simulated controller that listens for RTDE clients, in real time.

use super::controller::{CYCLES_HZ, Connection, Moment};
use crate::controller::Wiring;
use crate::pose_feed::PoseFeed;
use std::collections::VecDeque;
use std::io::{self, ErrorKind, Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::ops::ControlFlow;
use std::time::{Duration, Instant};

/// Settings of a simulated controller.
#[derive(Clone, Debug)]
pub struct ServerSettings {
    /// Poses of the robot.
    pub feed: PoseFeed,
    /// Its clock's reading at the start, s: clients treat less than 40 as booting.
    pub epoch_s: f64,
    /// Rate error of its clock, positive if fast, parts per million.
    pub drift_ppm: f64,
    /// Highest version of RTDE, 1 or 2.
    pub version: u16,
}

/// Most that waits for a client that does not read, bytes: then the connection is closed, as controllers do.
const MOST_WAITING: usize = 256 << 10;
/// Most clients.
const MOST_CLIENTS: usize = 16;

struct Client {
    stream: TcpStream,
    connection: Connection,
    waiting: VecDeque<u8>,
}

/// A controller.
pub struct RtdeServer {
    settings: ServerSettings,
    listener: TcpListener,
    clients: Vec<Client>,
    sent: u64,
    wiring: Wiring,
}

impl RtdeServer {
    /// Listens.
    ///
    /// # Errors
    /// Error of the operating system.
    pub fn bind(address: SocketAddr, settings: ServerSettings) -> io::Result<Self> {
        let listener = TcpListener::bind(address)?;
        listener.set_nonblocking(true)?;
        Ok(Self { settings, listener, clients: Vec::new(), sent: 0, wiring: Wiring::default() })
    }

    /// The same with something wired to it.
    #[must_use]
    pub fn wired(self, wiring: Wiring) -> Self {
        Self { wiring, ..self }
    }

    /// Its own address.
    ///
    /// # Errors
    /// Error of the operating system.
    pub fn local_address(&self) -> io::Result<SocketAddr> {
        self.listener.local_addr()
    }

    /// Packages of data that were sent.
    #[must_use]
    pub fn sent(&self) -> u64 {
        self.sent
    }

    /// Clients that are connected.
    #[must_use]
    pub fn clients(&self) -> usize {
        self.clients.len()
    }

    /// Runs cycle by cycle until told to stop. A late cycle is skipped, as controllers do under load; stamps stay on the grid.
    ///
    /// # Errors
    /// Errors of the operating system about the listening socket.
    pub fn run(&mut self, mut each: impl FnMut(&Self, Duration) -> ControlFlow<()>) -> io::Result<()> {
        let (start, start_ns) = (Instant::now(), self.wiring.clock().read().steady_ns);
        let mut cycle = 0_u64;
        loop {
            let due = Duration::from_secs_f64(cycle as f64 / CYCLES_HZ);
            std::thread::sleep(due.saturating_sub(start.elapsed()));
            self.accept()?;
            self.serve(cycle, start_ns);
            if each(self, start.elapsed()).is_break() {
                return Ok(());
            }
            cycle = (cycle + 1).max((start.elapsed().as_secs_f64() * CYCLES_HZ) as u64);
        }
    }

    fn accept(&mut self) -> io::Result<()> {
        match self.listener.accept() {
            Ok((stream, _)) if self.clients.len() < MOST_CLIENTS => {
                stream.set_nonblocking(true)?;
                stream.set_nodelay(true)?;
                let connection = Connection::new(self.settings.version);
                self.clients.push(Client { stream, connection, waiting: VecDeque::new() });
                Ok(())
            }
            Ok(_) => Ok(()),
            Err(error) if is_pause(&error) => Ok(()),
            Err(error) => Err(error),
        }
    }

    fn serve(&mut self, cycle: u64, start_ns: i64) {
        let time_s = cycle as f64 / CYCLES_HZ;
        let steady_ns = start_ns + (time_s * 1e9).round() as i64;
        let base_from_tool = self.settings.feed.at(time_s);
        self.wiring.tell(steady_ns, &base_from_tool);
        let is_on = self.wiring.input(steady_ns).unwrap_or(false);
        let moment = Moment {
            stamp_s: self.settings.epoch_s + time_s * (1.0 + self.settings.drift_ppm * 1e-6),
            base_from_tool,
            robot_mode: 7,
            inputs: is_on.into(),
        };
        let sent = &mut self.sent;
        self.clients.retain_mut(|client| match client.serve(cycle, &moment) {
            Ok(packages) => {
                *sent += packages;
                true
            }
            Err(_) => false,
        });
    }
}

impl Client {
    /// Answers, sends the cycle's data; returns how many packages of data.
    fn serve(&mut self, cycle: u64, moment: &Moment) -> io::Result<u64> {
        let mut chunk = [0; 4096];
        let mut replies = Vec::new();
        loop {
            match self.stream.read(&mut chunk) {
                Ok(0) => return Err(ErrorKind::UnexpectedEof.into()),
                Ok(length) => {
                    self.connection.take(&chunk[..length], &mut replies).map_err(io::Error::other)?;
                }
                Err(error) if is_pause(&error) => break,
                Err(error) => return Err(error),
            }
        }
        self.waiting.extend(replies);
        let data = self.connection.data(cycle, moment);
        let packages = u64::from(data.is_some());
        self.waiting.extend(data.unwrap_or_default());
        while !self.waiting.is_empty() {
            match self.stream.write(self.waiting.make_contiguous()) {
                Ok(length) => drop(self.waiting.drain(..length)),
                Err(error) if is_pause(&error) && self.waiting.len() < MOST_WAITING => break,
                Err(error) => return Err(error),
            }
        }
        Ok(packages)
    }
}

fn is_pause(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted)
}
