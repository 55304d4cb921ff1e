//! A UDP socket with the kernel's time of each datagram, which no busy program can delay.

use crate::host_clock::{HostClock, KernelStamps, Reading};
use crate::wait;
use socket2::{Domain, Protocol, SockRef, Socket, Type};
use std::io;
use std::net::{SocketAddr, UdpSocket};
use std::time::Duration;

/// Longest accepted datagram, bytes: EGM's are under 500.
pub(crate) const LONGEST_BYTES: usize = 2048;
/// Room for some seconds of EGM in the kernel, bytes, should this program be held up.
const BUFFER_BYTES: usize = 4 << 20;

/// When a datagram came.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Arrival {
    /// On the steady clock, ns: by the kernel's stamp if there is one, else the time of reading.
    pub steady_ns: i64,
    /// Whether the stamp is that of the reading although the kernel gave one: it agreed with no clock.
    pub is_of_reading: bool,
    /// The kernel's own stamp, ns since 1970 by the wall clock.
    pub kernel_wall_ns: Option<i64>,
    /// Both clocks when this program read it.
    pub read: Reading,
}

/// A datagram in the socket's buffer.
#[derive(Clone, Copy, Debug)]
pub struct Datagram<'a> {
    /// Its bytes; one more than `LONGEST_BYTES` if it was longer.
    pub bytes: &'a [u8],
    /// Its sender.
    pub from: SocketAddr,
    /// When it came.
    pub arrival: Arrival,
    /// Datagrams dropped by the kernel since the socket was opened, as far as it reports them.
    pub dropped_by_kernel: u32,
}

/// The socket.
pub struct StampedSocket {
    socket: UdpSocket,
    buffer: Box<[u8]>,
    control: Vec<u8>,
    clock: HostClock,
    stamps: KernelStamps,
    dropped: u32,
}

impl StampedSocket {
    /// Binds to an address of this machine.
    ///
    /// # Errors
    /// Error of the operating system.
    pub fn bind(address: SocketAddr, clock: HostClock) -> io::Result<Self> {
        let socket = Socket::new(Domain::for_address(address), Type::DGRAM, Some(Protocol::UDP))?;
        // An unprivileged program gets a smaller buffer than requested; the kernel reports its drops.
        let _ = socket.set_recv_buffer_size(BUFFER_BYTES);
        let socket = UdpSocket::from(socket);
        socket.set_nonblocking(true)?;
        // Before it is bound: a datagram that came first would have no stamp but that of its reading.
        kernel::ask_for_stamps(&socket)?;
        SockRef::from(&socket).bind(&address.into())?;
        Ok(Self {
            socket,
            buffer: vec![0; LONGEST_BYTES + 1].into_boxed_slice(),
            control: kernel::control_buffer(),
            stamps: KernelStamps::since(clock.read()),
            clock,
            dropped: 0,
        })
    }

    /// Its own address.
    ///
    /// # Errors
    /// Error of the operating system.
    pub fn local_address(&self) -> io::Result<SocketAddr> {
        self.socket.local_addr()
    }

    /// The clocks that stamp.
    #[must_use]
    pub fn clock(&self) -> HostClock {
        self.clock
    }

    /// Waits for a datagram; `None` if none comes in time.
    ///
    /// # Errors
    /// Error of the operating system.
    pub fn wait(&mut self, timeout: Duration) -> io::Result<Option<Datagram<'_>>> {
        wait::until_readable(&self.socket, timeout);
        self.next_waiting()
    }

    /// The next datagram that is already here.
    ///
    /// # Errors
    /// Error of the operating system.
    pub(crate) fn next_waiting(&mut self) -> io::Result<Option<Datagram<'_>>> {
        let received = kernel::receive(&self.socket, &mut self.buffer, &mut self.control);
        let read = self.clock.read();
        let received = match received {
            Ok(received) => received,
            Err(error) if is_nothing(&error) => return Ok(None),
            Err(error) => return Err(error),
        };
        self.dropped = received.dropped.unwrap_or(self.dropped);
        let steady = received.kernel_wall_ns.and_then(|wall_ns| self.stamps.steady_ns(read, wall_ns));
        let arrival = Arrival {
            steady_ns: steady.unwrap_or(read.steady_ns),
            is_of_reading: steady.is_none() && received.kernel_wall_ns.is_some(),
            kernel_wall_ns: received.kernel_wall_ns,
            read,
        };
        Ok(Some(Datagram {
            bytes: &self.buffer[..received.length],
            from: received.from,
            arrival,
            dropped_by_kernel: self.dropped,
        }))
    }

    /// Sends a datagram.
    ///
    /// # Errors
    /// Error of the operating system.
    pub fn send(&self, bytes: &[u8], to: SocketAddr) -> io::Result<()> {
        self.socket.send_to(bytes, to).map(drop)
    }
}

/// A wait that ended without a datagram, by time, by a signal, or by the report that an answer of ours found no
/// receiver.
fn is_nothing(error: &io::Error) -> bool {
    use io::ErrorKind::{ConnectionRefused, Interrupted, TimedOut, WouldBlock};
    matches!(error.kind(), WouldBlock | TimedOut | Interrupted | ConnectionRefused)
}

struct RawDatagram {
    length: usize,
    from: SocketAddr,
    kernel_wall_ns: Option<i64>,
    dropped: Option<u32>,
}

#[cfg(target_os = "linux")]
mod kernel {
    use super::RawDatagram;
    use nix::cmsg_space;
    use nix::sys::socket::sockopt::{ReceiveTimestampns, RxqOvfl};
    use nix::sys::socket::{ControlMessageOwned, MsgFlags, SockaddrStorage, recvmsg, setsockopt};
    use nix::sys::time::TimeSpec;
    use std::io::{self, IoSliceMut};
    use std::net::{SocketAddr, SocketAddrV4, SocketAddrV6, UdpSocket};
    use std::os::fd::AsRawFd;

    pub(crate) fn ask_for_stamps(socket: &UdpSocket) -> io::Result<()> {
        setsockopt(socket, ReceiveTimestampns, &true)?;
        setsockopt(socket, RxqOvfl, &1)?;
        Ok(())
    }

    pub(crate) fn control_buffer() -> Vec<u8> {
        cmsg_space!(TimeSpec, u32)
    }

    pub(super) fn receive(
        socket: &UdpSocket,
        buffer: &mut [u8],
        control: &mut Vec<u8>,
    ) -> io::Result<RawDatagram> {
        let flags = MsgFlags::MSG_DONTWAIT;
        control.resize(control.capacity(), 0);
        let mut parts = [IoSliceMut::new(buffer)];
        let message =
            recvmsg::<SockaddrStorage>(socket.as_raw_fd(), &mut parts, Some(control.as_mut_slice()), flags)?;
        let (mut kernel_wall_ns, mut dropped) = (None, None);
        for control in message.cmsgs()? {
            match control {
                ControlMessageOwned::ScmTimestampns(at) => {
                    kernel_wall_ns = Some(at.tv_sec() * 1_000_000_000 + at.tv_nsec());
                }
                ControlMessageOwned::RxqOvfl(count) => dropped = Some(count),
                _ => {}
            }
        }
        let from = message.address.as_ref().and_then(address);
        let from = from.ok_or_else(|| io::Error::other("a datagram came without an address"))?;
        Ok(RawDatagram { length: message.bytes, from, kernel_wall_ns, dropped })
    }

    fn address(storage: &SockaddrStorage) -> Option<SocketAddr> {
        if let Some(v4) = storage.as_sockaddr_in() {
            return Some(SocketAddr::V4(SocketAddrV4::from(*v4)));
        }
        storage.as_sockaddr_in6().map(|v6| SocketAddr::V6(SocketAddrV6::from(*v6)))
    }
}

/// Elsewhere the time of reading must do.
#[cfg(not(target_os = "linux"))]
mod kernel {
    use super::RawDatagram;
    use std::io;
    use std::net::UdpSocket;

    pub(crate) fn ask_for_stamps(_: &UdpSocket) -> io::Result<()> {
        Ok(())
    }

    pub(crate) fn control_buffer() -> Vec<u8> {
        Vec::new()
    }

    pub(super) fn receive(socket: &UdpSocket, buffer: &mut [u8], _: &mut Vec<u8>) -> io::Result<RawDatagram> {
        let (length, from) = socket.recv_from(buffer)?;
        Ok(RawDatagram { length, from, kernel_wall_ns: None, dropped: None })
    }
}
