//! Wiring of a simulated robot, for `robot-sim` and `stream-sim`.

use crate::args::number;
use clap::Args;
use std::net::SocketAddr;
use trueline_live::controller::{OutputEvery, WiringSettings};

/// Wiring of a simulated robot.
#[derive(Args)]
pub(crate) struct WiringArgs {
    /// Tell a `trueline-testbench camera-sim --robot-truth` on this machine where the robot truly is
    #[arg(long, value_name = "IP:PORT")]
    pub(crate) truth_to: Option<SocketAddr>,
    /// Address of this machine to which a camera's output is wired: the first digital input (of ABB the signal that is sent along,
    /// \DOToSensor, from 7.7 on)
    #[arg(long, value_name = "IP:PORT")]
    pub(crate) input_from: Option<SocketAddr>,
    /// By how much that input is late, ms
    #[arg(long, default_value_t = 0.0, requires = "input_from", value_parser = number::below_a_billion)]
    pub(crate) input_delay_ms: f64,
    /// Wire a digital output of the robot to the input of `camera-sim --trigger-from`: it starts the pictures. It is on for 5 ms each time,
    /// and stays on where the next time comes before that
    #[arg(long, value_name = "IP:PORT", requires = "rhythm")]
    pub(crate) output_to: Option<SocketAddr>,
    /// Travel of the tool between two signals of that output, mm; it switches on in the controller's next cycle
    #[arg(long, requires = "output_to", value_parser = number::above_zero, group = "rhythm")]
    pub(crate) output_every_mm: Option<f64>,
    /// Period of that output, ms; it switches on in the controller's next cycle
    #[arg(long, requires = "output_to", value_parser = number::above_zero, group = "rhythm")]
    pub(crate) output_every_ms: Option<f64>,
}

impl WiringArgs {
    /// The wiring.
    pub(crate) fn settings(&self) -> WiringSettings {
        let by_way = self.output_every_mm.map(|mm| OutputEvery::Way(mm * 1e-3));
        let every = by_way.or(self.output_every_ms.map(|ms| OutputEvery::Time(ms * 1e-3)));
        WiringSettings {
            truth_to: self.truth_to,
            input_from: self.input_from.map(|at| (at, 1e-3 * self.input_delay_ms)),
            output_to: self.output_to.zip(every),
        }
    }
}
