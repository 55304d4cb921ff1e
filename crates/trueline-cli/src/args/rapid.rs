//! `trueline rapid`.

use crate::args::choice::{Choice, one_of};
use crate::args::number;
use clap::Args;
use std::net::SocketAddr;
use std::path::PathBuf;
use trueline_live::rapid::RapidCell;

#[derive(Args)]
#[command(after_help = "Examples:
  trueline rapid plan --pc 192.168.125.10:6510 --out LineScan.mod
  trueline rapid plan --mode guidance --pc 192.168.125.10:6510 --tool tSensor --out LineGuide.mod

stream: the robot follows the path by its own program, and `trueline record` listens. Try this first. \
guidance: `trueline scan --enable-motion` guides the robot.
No real controller has compiled these modules here; a comment in each states this.")]
pub(crate) struct RapidArgs {
    /// A plan's folder, or a robot.csv with the path
    pub(crate) path: PathBuf,
    /// Who drives
    #[arg(long, value_parser = one_of(&MODES), default_value = "stream")]
    pub(crate) mode: Mode,
    /// Address of the PC, for the notes on the configuration
    #[arg(long, value_name = "IP:PORT")]
    pub(crate) pc: SocketAddr,
    /// File to write; it must not exist
    #[arg(long)]
    pub(crate) out: PathBuf,
    /// Name of the module
    #[arg(long, default_value = "LineScan")]
    pub(crate) module: String,
    /// Tool whose poses the path holds
    #[arg(long, default_value = "tool0")]
    pub(crate) tool: String,
    /// Work object in which they are given
    #[arg(long, default_value = "wobj0")]
    pub(crate) work_object: String,
    /// Name of the UDPUC device in the controller's configuration
    #[arg(long, default_value = "UCdevice")]
    pub(crate) device: String,
    /// Mechanical unit that moves
    #[arg(long, default_value = "ROB_1")]
    pub(crate) mechanical_unit: String,
    /// Task that moves it, into which the module is loaded
    #[arg(long, default_value = "T_ROB1")]
    pub(crate) task: String,
    /// Speed of the way to the path's beginning, mm/s
    #[arg(long, default_value_t = 20.0)]
    pub(crate) approach_mm_s: f64,
    /// Digital output to send along with the poses (\DOToSensor, RobotWare 7.7 and later): one that a cross connection of the I/O
    /// configuration sets from the input that the camera is wired to
    #[arg(long, value_name = "NAME")]
    pub(crate) signal: Option<String>,
    /// Share of the path's own pace
    #[arg(long, default_value_t = 1.0, value_parser = number::pace)]
    pub(crate) pace: f64,
    /// \MaxSpeedDeviation of the guidance, degrees/s of a joint
    #[arg(long, default_value_t = 30.0)]
    pub(crate) speed_deviation_deg_s: f64,
    /// \CommTimeout of the guidance, s
    #[arg(long, default_value_t = 0.2)]
    pub(crate) timeout_s: f64,
}

/// Who drives.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Mode {
    Stream,
    Guidance,
}

/// Who drives, of `robot-sim` and `rapid`.
pub(crate) static MODES: [Choice<Mode>; 2] = [
    ("stream", "The robot's own program, along the path; answers are not used", Mode::Stream),
    ("guidance", "The PC's references", Mode::Guidance),
];

impl RapidArgs {
    /// Names and figures of the module.
    #[must_use]
    pub(crate) fn cell(&self) -> RapidCell {
        RapidCell {
            module: self.module.clone(),
            tool: self.tool.clone(),
            work_object: self.work_object.clone(),
            device: self.device.clone(),
            mechanical_unit: self.mechanical_unit.clone(),
            task: self.task.clone(),
            pc: self.pc,
            approach_mm_s: self.approach_mm_s,
            speed_deviation_deg_s: self.speed_deviation_deg_s,
            timeout_s: self.timeout_s,
            signal: self.signal.clone(),
        }
    }
}
