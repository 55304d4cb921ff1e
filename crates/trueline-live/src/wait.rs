//! Waiting for a socket, to some microseconds: a socket's own timeout counts in ticks of several milliseconds.

use std::net::UdpSocket;
use std::time::Duration;

/// Waits until something can be read, or for so long.
#[cfg(target_os = "linux")]
pub(crate) fn until_readable(socket: &UdpSocket, longest: Duration) {
    use nix::poll::{PollFd, PollFlags, ppoll};
    use nix::sys::time::TimeSpec;
    use std::os::fd::AsFd;
    let mut sockets = [PollFd::new(socket.as_fd(), PollFlags::POLLIN)];
    // A signal ends the wait early, and the caller looks at the clock anyway.
    let _ = ppoll(&mut sockets, Some(TimeSpec::from_duration(longest)), None);
}

/// Waits for so long, but never longer than a millisecond.
#[cfg(not(target_os = "linux"))]
pub(crate) fn until_readable(_: &UdpSocket, longest: Duration) {
    std::thread::sleep(longest.min(Duration::from_millis(1)));
}
