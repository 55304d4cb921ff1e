//! Wiring of a simulated robot in a cell of several programs on one machine.

use super::robot_output::{OutputEvery, RobotOutput};
use super::trigger_feed::{TriggerReceiver, TriggerSender};
use super::truth_feed::TruthSender;
use crate::host_clock::HostClock;
use std::io;
use std::net::SocketAddr;
use trueline_geometry::Pose;

/// Wiring of a simulated robot; addresses are of this machine.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WiringSettings {
    /// The address that is sent the robot's true pose.
    pub truth_to: Option<SocketAddr>,
    /// Address of the driver of the first digital input, and its delay, s.
    pub input_from: Option<(SocketAddr, f64)>,
    /// A camera with pictures that a digital output starts, and when that switches on.
    pub output_to: Option<(SocketAddr, OutputEvery)>,
}

/// A simulated camera that receives the robot's true poses, an output that drives the first digital input, and one of the
/// robot's own.
pub struct Wiring {
    truth: Option<TruthSender>,
    input: Option<TriggerReceiver>,
    output: Option<RobotOutput>,
    clock: HostClock,
}

impl Default for Wiring {
    fn default() -> Self {
        Self { truth: None, input: None, output: None, clock: HostClock::start() }
    }
}

impl Wiring {
    /// Wires all that is to be wired.
    ///
    /// # Errors
    /// Error of the operating system.
    pub fn new(settings: &WiringSettings) -> io::Result<Self> {
        let clock = HostClock::start();
        let input = |(at, late_s): (SocketAddr, f64)| TriggerReceiver::bind(at, (late_s * 1e9) as i64, clock);
        let output = |(to, every)| TriggerSender::new(to, clock).map(|wire| RobotOutput::new(wire, every));
        Ok(Self {
            truth: settings.truth_to.map(|to| TruthSender::new(to, clock)).transpose()?,
            input: settings.input_from.map(input).transpose()?,
            output: settings.output_to.map(output).transpose()?,
            clock,
        })
    }

    /// The clock of all times here.
    #[must_use]
    pub fn clock(&self) -> HostClock {
        self.clock
    }

    /// A cycle of the controller: where the robot truly is at a time, ns.
    pub fn tell(&mut self, steady_ns: i64, base_from_tool: &Pose) {
        if let Some(output) = &mut self.output {
            output.cycle(steady_ns, base_from_tool);
        }
        if let Some(truth) = &self.truth {
            truth.send(steady_ns, base_from_tool);
        }
    }

    /// Whether the input is on at a time, ns; `None` if nothing is wired to it.
    pub fn input(&mut self, steady_ns: i64) -> Option<bool> {
        self.input.as_mut().map(|input| input.is_on(steady_ns))
    }
}
