//! What is wired to a simulated robot in a cell of several programs on one machine.

use super::trigger_feed::TriggerReceiver;
use super::truth_feed::TruthSender;
use crate::host_clock::HostClock;
use std::io;
use std::net::SocketAddr;
use trueline_geometry::Pose;

/// A simulated camera that is told where the robot truly is, and an output that drives the first digital input.
pub struct Wiring {
    truth: Option<TruthSender>,
    input: Option<TriggerReceiver>,
    clock: HostClock,
}

impl Default for Wiring {
    fn default() -> Self {
        Self { truth: None, input: None, clock: HostClock::start() }
    }
}

impl Wiring {
    /// Tells the truth to an address; listens at another to what drives the input, which is late by so much, s.
    ///
    /// # Errors
    /// What the operating system says.
    pub fn new(truth_to: Option<SocketAddr>, input_from: Option<(SocketAddr, f64)>) -> io::Result<Self> {
        let clock = HostClock::start();
        let input = |(at, late_s): (SocketAddr, f64)| TriggerReceiver::bind(at, (late_s * 1e9) as i64, clock);
        Ok(Self {
            truth: truth_to.map(|to| TruthSender::new(to, clock)).transpose()?,
            input: input_from.map(input).transpose()?,
            clock,
        })
    }

    /// The clock of all times here.
    #[must_use]
    pub fn clock(&self) -> HostClock {
        self.clock
    }

    /// Tells where the robot truly is at a time, ns.
    pub fn tell(&self, steady_ns: i64, base_from_tool: &Pose) {
        if let Some(truth) = &self.truth {
            truth.send(steady_ns, base_from_tool);
        }
    }

    /// Whether the input is on at a time, ns; `None` if nothing is wired to it.
    pub fn input(&mut self, steady_ns: i64) -> Option<bool> {
        self.input.as_mut().map(|input| input.is_on(steady_ns))
    }
}
