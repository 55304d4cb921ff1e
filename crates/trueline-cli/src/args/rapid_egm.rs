//! Names and figures of a RAPID module that exchanges poses by EGM, of `trueline robot-program abb`.

use crate::args::choice::{Choice, one_of};
use clap::Args;
use std::net::SocketAddr;
use trueline_plan::robot_program::rapid_egm::{Driver, RapidCell};

/// All are for ABB with `--pc`. Without them the module has the names of a new controller.
#[derive(Args)]
pub(crate) struct RapidEgmArgs {
    /// abb: who drives [default: stream]
    #[arg(long, value_parser = one_of(&DRIVERS))]
    mode: Option<Driver>,
    /// abb: name of the module and of its file [default: LineScan]
    #[arg(long)]
    module: Option<String>,
    /// abb: tool whose poses the path holds [default: tool0]
    #[arg(long)]
    tool: Option<String>,
    /// abb: work object in which they are given [default: wobj0]
    #[arg(long)]
    work_object: Option<String>,
    /// abb: name of the UDPUC device in the controller's configuration [default: UCdevice]
    #[arg(long)]
    device: Option<String>,
    /// abb: mechanical unit that moves [default: ROB_1]
    #[arg(long)]
    mechanical_unit: Option<String>,
    /// abb: task that moves it, into which the module is loaded [default: T_ROB1]
    #[arg(long)]
    task: Option<String>,
    /// abb: speed of the way to the path's beginning, mm/s [default: 20]
    #[arg(long)]
    approach_mm_s: Option<f64>,
    /// abb: \MaxSpeedDeviation of the guidance, degrees/s of a joint [default: 30]
    #[arg(long)]
    speed_deviation_deg_s: Option<f64>,
    /// abb: \CommTimeout of the guidance, s [default: 0.2]
    #[arg(long)]
    timeout_s: Option<f64>,
}

/// Who drives, of `robot-sim` and `robot-program abb`.
pub(crate) static DRIVERS: [Choice<Driver>; 2] = [
    ("stream", "The robot's own program, along the path; answers are not used", Driver::Robot),
    ("guidance", "The PC's references, of `trueline scan --enable-motion`", Driver::Pc),
];

impl RapidEgmArgs {
    /// Who drives.
    pub(crate) fn driver(&self) -> Driver {
        self.mode.unwrap_or(Driver::Robot)
    }

    /// One of these options that was given.
    pub(crate) fn given(&self) -> Option<&'static str> {
        [
            ("--mode", self.mode.is_some()),
            ("--module", self.module.is_some()),
            ("--tool", self.tool.is_some()),
            ("--work-object", self.work_object.is_some()),
            ("--device", self.device.is_some()),
            ("--mechanical-unit", self.mechanical_unit.is_some()),
            ("--task", self.task.is_some()),
            ("--approach-mm-s", self.approach_mm_s.is_some()),
        ]
        .into_iter()
        .find_map(|(name, is_given)| is_given.then_some(name))
        .or_else(|| self.given_of_guidance())
    }

    /// One of the options of a guidance that was given.
    pub(crate) fn given_of_guidance(&self) -> Option<&'static str> {
        let speed = self.speed_deviation_deg_s.map(|_| "--speed-deviation-deg-s");
        speed.or_else(|| self.timeout_s.map(|_| "--timeout-s"))
    }

    /// Names and figures of the module.
    pub(crate) fn cell(&self, pc: SocketAddr, signal: Option<String>) -> RapidCell {
        let or = |given: &Option<String>, usual: &str| given.clone().unwrap_or_else(|| usual.to_owned());
        RapidCell {
            module: or(&self.module, "LineScan"),
            tool: or(&self.tool, "tool0"),
            work_object: or(&self.work_object, "wobj0"),
            device: or(&self.device, "UCdevice"),
            mechanical_unit: or(&self.mechanical_unit, "ROB_1"),
            task: or(&self.task, "T_ROB1"),
            pc,
            approach_mm_s: self.approach_mm_s.unwrap_or(20.0),
            speed_deviation_deg_s: self.speed_deviation_deg_s.unwrap_or(30.0),
            timeout_s: self.timeout_s.unwrap_or(0.2),
            signal,
        }
    }
}
