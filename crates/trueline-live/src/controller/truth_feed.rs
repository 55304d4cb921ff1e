//! True pose of a simulated robot, for a simulated camera in another process of the same machine.
//!
//! Times are sent by the machine's own clock. The clocks of the two programs differ by any change of the wall clock between
//! their starts.

use crate::host_clock::HostClock;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use std::collections::VecDeque;
use std::io;
use std::net::{SocketAddr, UdpSocket};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::Duration;
use trueline_geometry::Pose;

const MARK: [u8; 8] = *b"TLTRUTH1";
/// Mark, time and seven numbers of a pose, bytes.
const LENGTH: usize = 8 + 8 + 7 * 8;
/// How long poses are remembered, ns: pictures are made some time after their exposure.
const MEMORY_NS: i64 = 3_000_000_000;
/// How often the receiver looks whether it is still needed.
const LOOK: Duration = Duration::from_millis(100);

/// Sends the robot's true pose.
pub struct TruthSender {
    socket: UdpSocket,
    to: SocketAddr,
    machine_ahead_ns: i64,
}

impl TruthSender {
    /// Will send to an address of this machine, times by a clock.
    ///
    /// # Errors
    /// Error of the operating system.
    pub fn new(to: SocketAddr, clock: HostClock) -> io::Result<Self> {
        let socket = UdpSocket::bind(SocketAddr::new(to.ip(), 0))?;
        Ok(Self { socket, to, machine_ahead_ns: clock.machine_ahead_ns() })
    }

    /// Sends a pose and its time by the clock, ns. A receiver is not needed.
    pub fn send(&self, steady_ns: i64, pose: &Pose) {
        let _nobody_there = self.socket.send_to(&encode(steady_ns + self.machine_ahead_ns, pose), self.to);
    }
}

fn encode(machine_ns: i64, pose: &Pose) -> [u8; LENGTH] {
    let (p, q) = (pose.translation.vector, pose.rotation.quaternion());
    let mut bytes = [0; LENGTH];
    bytes[..8].copy_from_slice(&MARK);
    bytes[8..16].copy_from_slice(&machine_ns.to_le_bytes());
    for (place, value) in bytes[16..].chunks_exact_mut(8).zip([p.x, p.y, p.z, q.w, q.i, q.j, q.k]) {
        place.copy_from_slice(&f64::to_le_bytes(value));
    }
    bytes
}

fn decode(bytes: &[u8]) -> Option<(i64, Pose)> {
    let bytes: &[u8; LENGTH] = bytes.try_into().ok()?;
    if bytes[..8] != MARK {
        return None;
    }
    let (eights, _) = bytes[8..].as_chunks::<8>();
    let number = |k: usize| f64::from_le_bytes(eights[k]);
    let rotation = Quaternion::new(number(4), number(5), number(6), number(7));
    let position = Vector3::new(number(1), number(2), number(3));
    if (rotation.norm() - 1.0).abs() > 1e-6 || !position.iter().all(|v| v.is_finite()) {
        return None;
    }
    let pose = Pose::from_parts(position.into(), UnitQuaternion::new_normalize(rotation));
    Some((i64::from_le_bytes(eights[0]), pose))
}

type Poses = Arc<Mutex<VecDeque<(i64, Pose)>>>;

/// Receives where the robot is.
pub struct TruthReceiver {
    poses: Poses,
    over: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
    machine_ahead_ns: i64,
}

impl TruthReceiver {
    /// Listens at an address of this machine; its times are those of a clock.
    ///
    /// # Errors
    /// Error of the operating system.
    pub fn bind(at: SocketAddr, clock: HostClock) -> io::Result<Self> {
        let socket = UdpSocket::bind(at)?;
        socket.set_read_timeout(Some(LOOK))?;
        let (poses, over) = (Poses::default(), Arc::new(AtomicBool::new(false)));
        let thread = {
            let (poses, over) = (poses.clone(), over.clone());
            thread::spawn(move || listen(&socket, &poses, &over))
        };
        Ok(Self { poses, over, thread: Some(thread), machine_ahead_ns: clock.machine_ahead_ns() })
    }

    /// Pose of the robot, between two received poses; `None` if there are none about that time (yet).
    #[must_use]
    pub fn pose_at(&self, steady_ns: i64) -> Option<Pose> {
        let poses = self.poses.lock().unwrap_or_else(PoisonError::into_inner);
        let machine_ns = steady_ns.saturating_add(self.machine_ahead_ns);
        let after = poses.partition_point(|(at_ns, _)| *at_ns <= machine_ns);
        let (before_ns, before) = poses.get(after.checked_sub(1)?)?;
        let (after_ns, later) = poses.get(after)?;
        let share = (machine_ns - before_ns) as f64 / (after_ns - before_ns) as f64;
        Some(before.lerp_slerp(later, share))
    }
}

impl Drop for TruthReceiver {
    fn drop(&mut self) {
        self.over.store(true, Ordering::SeqCst);
        if let Some(thread) = self.thread.take() {
            let _panicked = thread.join();
        }
    }
}

fn listen(socket: &UdpSocket, poses: &Poses, over: &AtomicBool) {
    let mut buffer = [0; LENGTH + 1];
    while !over.load(Ordering::SeqCst) {
        let Ok(length) = socket.recv(&mut buffer) else { continue };
        let Some((at_ns, pose)) = decode(&buffer[..length]) else { continue };
        let mut poses = poses.lock().unwrap_or_else(PoisonError::into_inner);
        if poses.back().is_some_and(|(last_ns, _)| at_ns <= *last_ns) {
            // Another robot began, or the first one anew.
            poses.clear();
        }
        poses.push_back((at_ns, pose));
        while poses.front().is_some_and(|(first_ns, _)| at_ns - first_ns > MEMORY_NS) {
            poses.pop_front();
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;

    #[test]
    fn poses_come_as_they_were_sent_and_are_interpolated() {
        let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
        let at = socket.local_addr().unwrap();
        drop(socket);
        let clock = HostClock::start();
        let mut receiver = TruthReceiver::bind(at, clock).unwrap();
        let mut sender = TruthSender::new(at, clock).unwrap();
        // The same clock is measured twice, some hundred nanoseconds apart.
        assert!((receiver.machine_ahead_ns - sender.machine_ahead_ns).abs() < 1_000_000);
        receiver.machine_ahead_ns = sender.machine_ahead_ns;
        for k in 0..10_i64 {
            sender.send(k * 1000, &Pose::translation(k as f64, 0.5, -2.0));
        }
        let deadline = std::time::Instant::now() + Duration::from_secs(5);
        while receiver.pose_at(8999).is_none() && std::time::Instant::now() < deadline {
            thread::sleep(Duration::from_millis(5));
        }
        assert_eq!(receiver.pose_at(2500).unwrap(), Pose::translation(2.5, 0.5, -2.0));
        // A program that started after the wall clock was set by 3 µs: its clock is ahead by that at the same moment.
        sender.machine_ahead_ns -= 3000;
        sender.send(13_000, &Pose::translation(10.0, 0.5, -2.0));
        while receiver.pose_at(9999).is_none() && std::time::Instant::now() < deadline {
            thread::sleep(Duration::from_millis(5));
        }
        assert_eq!(receiver.pose_at(9500).unwrap(), Pose::translation(9.5, 0.5, -2.0));
        assert!(receiver.pose_at(10_001).is_none() && receiver.pose_at(-1).is_none());
        assert_eq!(decode(&[0; LENGTH]), None);
        assert_eq!(decode(&encode(5, &Pose::identity())[..40]), None);
    }
}
