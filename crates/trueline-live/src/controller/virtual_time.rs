//! Controller, network and PC in virtual time: the same seed gives the same bytes at the same times, as fast as they compute.

use super::controller::Controller;
use super::network::Network;
use std::net::{IpAddr, Ipv4Addr};

/// A controller that a PC talks to over a network, in virtual time.
#[derive(Clone, Debug)]
pub struct VirtualTime {
    /// The controller.
    pub controller: Controller,
    /// From the robot to the PC.
    pub to_pc: Network<Vec<u8>>,
    /// From the PC to the robot.
    pub to_robot: Network<Vec<u8>>,
}

impl VirtualTime {
    /// Runs for so long; `pc` gets every datagram with the time of its arrival, ns, and may answer.
    pub fn run(&mut self, until_s: f64, mut pc: impl FnMut(i64, &[u8]) -> Option<Vec<u8>>) {
        let until_ns = (until_s * 1e9) as i64;
        while self.controller.next_cycle_ns() < until_ns {
            let now_ns = self.controller.next_cycle_ns();
            while let Some((at_ns, datagram)) = self.to_pc.take_due(now_ns) {
                if let Some(answer) = pc(at_ns, &datagram) {
                    self.to_robot.send(at_ns, answer);
                }
            }
            while let Some((_, answer)) = self.to_robot.take_due(now_ns) {
                self.controller.receive(&answer, IpAddr::V4(Ipv4Addr::LOCALHOST));
            }
            if let Some(datagram) = self.controller.run_cycle() {
                self.to_pc.send(now_ns, datagram);
            }
        }
    }
}
