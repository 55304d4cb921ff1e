//! A wire between two processes of the same machine: a camera's output to an input of a simulated robot, or a robot's output to the trigger of
//! a simulated camera.

use crate::host_clock::HostClock;
use std::collections::VecDeque;
use std::io;
use std::net::{SocketAddr, UdpSocket};

const MARK: [u8; 8] = *b"TLTRIGR1";
/// Mark, start and end, bytes.
const LENGTH: usize = 8 + 8 + 8;
/// Pulses that are remembered.
const MOST: usize = 64;

/// The end of the wire that is an output.
#[derive(Debug)]
pub struct TriggerSender {
    socket: UdpSocket,
    to: SocketAddr,
    machine_ahead_ns: i64,
}

impl TriggerSender {
    /// Will send to an address of this machine, times by a clock.
    ///
    /// # Errors
    /// Error of the operating system.
    pub fn new(to: SocketAddr, clock: HostClock) -> io::Result<Self> {
        let socket = UdpSocket::bind(SocketAddr::new(to.ip(), 0))?;
        Ok(Self { socket, to, machine_ahead_ns: clock.machine_ahead_ns() })
    }

    /// Reports a pulse (a camera's exposure), best before it begins: its start and end by the clock, ns. A receiver is not
    /// needed.
    pub fn send(&self, [start_ns, end_ns]: [i64; 2]) {
        let [start_ns, end_ns] = [start_ns, end_ns].map(|at_ns| at_ns + self.machine_ahead_ns);
        let mut bytes = [0; LENGTH];
        bytes[..8].copy_from_slice(&MARK);
        bytes[8..16].copy_from_slice(&start_ns.to_le_bytes());
        bytes[16..].copy_from_slice(&end_ns.to_le_bytes());
        let _nobody_there = self.socket.send_to(&bytes, self.to);
    }
}

/// The end of the wire that is an input.
#[derive(Debug)]
pub struct TriggerReceiver {
    socket: UdpSocket,
    /// When the input is on, by the clock.
    pulses_ns: VecDeque<[i64; 2]>,
    /// Delay of the input against the machine's clock reading for the output, by the clock, ns.
    to_clock_ns: i64,
}

impl TriggerReceiver {
    /// Listens at an address of this machine; the input follows the output after a delay, ns.
    ///
    /// # Errors
    /// Error of the operating system.
    pub fn bind(at: SocketAddr, delay_ns: i64, clock: HostClock) -> io::Result<Self> {
        let socket = UdpSocket::bind(at)?;
        socket.set_nonblocking(true)?;
        Ok(Self { socket, pulses_ns: VecDeque::new(), to_clock_ns: delay_ns - clock.machine_ahead_ns() })
    }

    /// Whether the input is on at a time of the clock, ns, by the reports so far.
    pub fn is_on(&mut self, steady_ns: i64) -> bool {
        self.hear();
        self.pulses_ns.iter().any(|[start_ns, end_ns]| (*start_ns..*end_ns).contains(&steady_ns))
    }

    /// The first change of the input after a time of the clock, ns, and whether it switches on then; `None` without a
    /// report. An output that is set again while it is on stays on.
    pub fn change_after(&mut self, steady_ns: i64) -> Option<(i64, bool)> {
        self.hear();
        let mut on_ns: Vec<[i64; 2]> = Vec::new();
        for [start_ns, end_ns] in &self.pulses_ns {
            match on_ns.last_mut() {
                Some(last) if *start_ns <= last[1] => last[1] = last[1].max(*end_ns),
                _ => on_ns.push([*start_ns, *end_ns]),
            }
        }
        let changes = on_ns.into_iter().flat_map(|[start_ns, end_ns]| [(start_ns, true), (end_ns, false)]);
        changes.filter(|(at_ns, _)| *at_ns > steady_ns).min_by_key(|(at_ns, _)| *at_ns)
    }

    /// Reads the reports so far.
    fn hear(&mut self) {
        let mut bytes = [0; LENGTH + 1];
        while let Ok(length) = self.socket.recv(&mut bytes) {
            let Some(pulse_ns) = decode(&bytes[..length], self.to_clock_ns) else { continue };
            if self.pulses_ns.len() == MOST {
                self.pulses_ns.pop_front();
            }
            self.pulses_ns.push_back(pulse_ns);
        }
    }
}

/// A pulse by the clock; `None` for an invalid one, from any sender.
fn decode(bytes: &[u8], to_clock_ns: i64) -> Option<[i64; 2]> {
    let bytes: &[u8; LENGTH] = bytes.try_into().ok()?;
    let (eights, _) = bytes[8..].as_chunks::<8>();
    let by_clock = |eight: [u8; 8]| i64::from_le_bytes(eight).checked_add(to_clock_ns);
    let [start_ns, end_ns] = [by_clock(eights[0])?, by_clock(eights[1])?];
    (bytes[..8] == MARK && start_ns < end_ns).then_some([start_ns, end_ns])
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;
    use std::time::{Duration, Instant};

    /// Both ends read the machine's clock, some µs apart: times of this length are not touched by that, ns.
    const MS: i64 = 1_000_000;

    #[test]
    fn the_input_is_on_as_long_as_the_exposure_and_late_by_the_delay() {
        let clock = HostClock::start();
        let mut input = TriggerReceiver::bind("127.0.0.1:0".parse().unwrap(), 500 * MS, clock).unwrap();
        let output = TriggerSender::new(input.socket.local_addr().unwrap(), clock).unwrap();
        output.send([1000 * MS, 3000 * MS]);
        output.send([9000 * MS, 9500 * MS]);
        let began = Instant::now();
        while !input.is_on(9750 * MS) && began.elapsed() < Duration::from_secs(5) {
            std::thread::sleep(Duration::from_millis(1));
        }
        let on: Vec<i64> = (0..22).map(|k| 500 * k + 250).filter(|at| input.is_on(*at * MS)).collect();
        assert_eq!(on, [1750, 2250, 2750, 3250, 9750]);
        let mut changes = Vec::new();
        let mut at_ns = 0;
        while let Some((change_ns, rises)) = input.change_after(at_ns) {
            at_ns = change_ns;
            // Within the difference of the two readings of the machine's clock.
            changes.push(((change_ns + 100 * MS) / (500 * MS), rises));
        }
        assert_eq!(changes, [(3, true), (7, false), (19, true), (20, false)]);
    }

    #[test]
    fn an_output_that_is_set_again_while_it_is_on_makes_no_edge() {
        for (second_ns, expected) in [
            ([4 * MS, 9 * MS], vec![(9 * MS, false)]),
            ([5 * MS, 10 * MS], vec![(10 * MS, false)]),
            ([6 * MS, 11 * MS], vec![(5 * MS, false), (6 * MS, true), (11 * MS, false)]),
        ] {
            let mut input =
                TriggerReceiver::bind("127.0.0.1:0".parse().unwrap(), 0, HostClock::start()).unwrap();
            input.pulses_ns = VecDeque::from([[0, 5 * MS], second_ns]);
            let mut changes = Vec::new();
            let mut at_ns = 0;
            while let Some(change) = input.change_after(at_ns) {
                at_ns = change.0;
                // It is on to one side of each change, and off to the other.
                assert_eq!([at_ns - 1, at_ns].map(|at_ns| input.is_on(at_ns)), [!change.1, change.1]);
                changes.push(change);
            }
            assert_eq!(changes, expected);
        }
    }

    #[test]
    fn what_is_no_pulse_is_not_taken() {
        let bytes =
            |start_ns: i64, end_ns: i64| [MARK, start_ns.to_le_bytes(), end_ns.to_le_bytes()].concat();
        assert_eq!(decode(&bytes(10, 20), -3), Some([7, 17]));
        assert_eq!(decode(&[0; LENGTH], 0), None);
        assert_eq!(decode(&bytes(20, 20), 0), None);
        assert_eq!(decode(&bytes(20, 10), 0), None);
        // Times that the clock cannot tell.
        assert_eq!(decode(&bytes(5, i64::MAX), 1), None);
        assert_eq!(decode(&bytes(i64::MIN, 5), -1), None);
        assert_eq!(decode(&bytes(5, 6)[..LENGTH - 1], 0), None);
    }
}
