//! `trueline robot-program`.

use crate::args::choice::{Choice, one_of};
use crate::args::number;
use clap::Args;
use std::net::SocketAddr;
use std::path::PathBuf;
use trueline_live::robot_program::krl_rsi::{self, RsiContext};
use trueline_live::robot_program::{Language, ProgramFile, Waypoints};

#[derive(Args)]
#[command(after_help = "Examples:
  trueline robot-program kuka plan --pc 192.168.1.20:49152 --out krc
  trueline robot-program kuka robot.csv --pc 192.168.1.20:49152 --rsi rsi --out krc
  trueline robot-program ur plan --out ur

kuka: the program streams the robot's poses by RSI to `trueline record --protocol kuka-rsi` while it moves. The RSI context \
only sends: nothing that a PC answers can move the robot. abb is `trueline rapid` without EGM; ur and fanuc stream without a program.
No real controller has run these programs; a comment in each states this.")]
pub(crate) struct RobotProgramArgs {
    /// Whose robot
    #[arg(value_parser = one_of(&ROBOTS))]
    pub(crate) robot: Language,
    /// A plan's folder, or a robot.csv with the path
    pub(crate) path: PathBuf,
    /// Folder to write
    #[arg(long)]
    pub(crate) out: PathBuf,
    /// kuka: where the PC listens, on the network of the RSI interface
    #[arg(long, value_name = "IP:PORT")]
    pub(crate) pc: Option<SocketAddr>,
    /// kuka: form of the RSI context [default: rsix]
    #[arg(long, value_name = "FORM", value_parser = one_of(&CONTEXTS))]
    pub(crate) rsi: Option<RsiContext>,
    /// kuka: number of the digital input ($IN) that the camera is wired to, to be sent along
    #[arg(long, value_name = "NUMBER", value_parser = clap::value_parser!(u16).range(1..=4096))]
    pub(crate) input: Option<u16>,
    /// Share of the path's own pace
    #[arg(long, default_value_t = 1.0, value_parser = number::pace)]
    pub(crate) pace: f64,
}

static ROBOTS: [Choice<Language>; 4] = [
    ("kuka", "KRL, with what RSI needs to stream the poses", Language::Krl),
    ("abb", "A RAPID module", Language::Rapid),
    ("ur", "URScript", Language::UrScript),
    ("fanuc", "LS", Language::Ls),
];

static CONTEXTS: [Choice<RsiContext>; 2] = [
    ("rsix", "RSI 4.1 and later, KSS 8.5 and later", RsiContext::Rsix),
    ("rsi", "RSI 3 and 4.0, KSS before 8.5", RsiContext::Rsi),
];

impl RobotProgramArgs {
    /// The files for the controller.
    ///
    /// # Errors
    /// An option that this robot does not take or that it lacks, and what to do.
    pub(crate) fn files(&self, path: &Waypoints) -> Result<Vec<ProgramFile>, [&'static str; 2]> {
        match (self.robot, self.pc, self.rsi) {
            (Language::Krl, Some(pc), _) if pc.ip().is_unspecified() || pc.port() == 0 => Err([
                "--pc: a controller cannot send there",
                "the PC's address on the RSI interface's network",
            ]),
            (Language::Krl, Some(pc), form) => {
                Ok(krl_rsi::files(path, pc, form.unwrap_or(RsiContext::Rsix), self.input))
            }
            (Language::Krl, None, _) => Err([
                "kuka: --pc is missing",
                "the address of this PC on the RSI interface's network and a port, as 192.168.1.20:49152; \
                 without RSI: `trueline plan --program krl`",
            ]),
            (language, None, None) if self.input.is_none() => Ok(vec![ProgramFile::of(language, path)]),
            _ => Err(["--pc, --rsi and --input are for kuka", "the streams of other robots need no program"]),
        }
    }
}
