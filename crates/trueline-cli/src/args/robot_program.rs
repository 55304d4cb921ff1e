//! `trueline robot-program`.

use crate::args::RapidEgmArgs;
use crate::args::choice::{Choice, one_of};
use crate::args::number;
use clap::Args;
use std::net::SocketAddr;
use std::path::PathBuf;
use trueline_dataset::RobotSample;
use trueline_plan::robot_program::krl_rsi::{self, RsiContext};
use trueline_plan::robot_program::rapid_egm::{self, Driver};
use trueline_plan::robot_program::{Language, ProgramFile, Waypoints};

#[derive(Args)]
#[command(after_help = "Examples:
  trueline robot-program kuka plan --pc 192.168.1.20:49152 --out krc
  trueline robot-program abb plan --pc 192.168.125.10:6510 --out rapid
  trueline robot-program abb plan --pc 192.168.125.10:6510 --mode guidance --tool tSensor --out rapid
  trueline robot-program ur plan --out ur

kuka: the program streams the robot's poses by RSI to `trueline record --protocol kuka-rsi` while it moves. The RSI context \
only sends: nothing that a PC answers can move the robot. abb: with --pc the program exchanges poses by EGM. In the mode stream the \
robot follows the path by its own program, and `trueline record` listens; try this first. In the mode guidance `trueline scan \
--enable-motion` guides it. ur and fanuc stream without a program.
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
    /// kuka, abb: where the PC listens, on the robot's network
    #[arg(long, value_name = "IP:PORT")]
    pub(crate) pc: Option<SocketAddr>,
    /// Signal that the camera is wired to, to be sent along. kuka: number of the digital input ($IN). abb: name of a digital output that a
    /// cross connection of the I/O configuration sets from that input (\DOToSensor, RobotWare 7.7 and later)
    #[arg(long, value_name = "NUMBER|NAME")]
    pub(crate) signal: Option<String>,
    /// kuka: form of the RSI context [default: rsix]
    #[arg(long, value_name = "FORM", value_parser = one_of(&CONTEXTS))]
    pub(crate) rsi: Option<RsiContext>,
    #[command(flatten)]
    pub(crate) egm: RapidEgmArgs,
    /// Share of the path's own pace
    #[arg(long, default_value_t = 1.0, value_parser = number::pace)]
    pub(crate) pace: f64,
}

static ROBOTS: [Choice<Language>; 4] = [
    ("kuka", "KRL, with what RSI needs to stream the poses", Language::Krl),
    ("abb", "A RAPID module, with EGM if --pc is given", Language::Rapid),
    ("ur", "URScript", Language::UrScript),
    ("fanuc", "LS", Language::Ls),
];

static CONTEXTS: [Choice<RsiContext>; 2] = [
    ("rsix", "RSI 4.1 and later, KSS 8.5 and later", RsiContext::Rsix),
    ("rsi", "RSI 3 and 4.0, KSS before 8.5", RsiContext::Rsi),
];

/// An option that does not fit, and what to do.
pub(crate) type Unfit = [String; 2];

/// The largest number of a digital input of KUKA's controllers.
const MOST_INPUTS: u16 = 4096;

impl RobotProgramArgs {
    /// The files for the controller.
    ///
    /// # Errors
    /// An option that this robot does not take or that it lacks, and what to do.
    pub(crate) fn files(
        &self,
        path: &[RobotSample],
        waypoints: &Waypoints,
    ) -> Result<Vec<ProgramFile>, Unfit> {
        self.refuse_others_options()?;
        if self.pc.is_some_and(|pc| pc.ip().is_unspecified() || pc.port() == 0) {
            return Err(unfit(
                "--pc: a controller cannot send there",
                "the PC's address on the robot's network, and the port that `trueline record` or `scan` binds to",
            ));
        }
        match (self.robot, self.pc) {
            (Language::Krl, Some(pc)) => {
                let input = self.signal.as_deref().map(number_of_input).transpose()?;
                Ok(krl_rsi::files(waypoints, pc, self.rsi.unwrap_or(RsiContext::Rsix), input))
            }
            (Language::Krl, None) => Err(unfit(
                "kuka: --pc is missing",
                "the address of this PC on the RSI interface's network and a port, as 192.168.1.20:49152; \
                 without RSI: `trueline plan --program krl`",
            )),
            (Language::Rapid, Some(pc)) => {
                let cell = self.egm.cell(pc, self.signal.clone());
                let file = rapid_egm::file(&cell, self.egm.driver(), path);
                file.map(|file| vec![file]).map_err(|error| {
                    unfit(
                        error.to_string(),
                        "names as in RAPID; the path from `trueline plan` or a robot.csv",
                    )
                })
            }
            (language, _) => Ok(vec![ProgramFile::of(language, waypoints)]),
        }
    }

    /// What to run beside the program, where a PC takes part.
    pub(crate) fn next(&self) -> Option<&'static str> {
        self.pc?;
        Some(match (self.robot, self.egm.driver()) {
            (Language::Rapid, Driver::Pc) => "Start `trueline scan --enable-motion`, then run it.",
            (Language::Rapid, Driver::Robot) => "Start `trueline record`, then run it.",
            _ => "Start `trueline record --protocol kuka-rsi`, then run it.",
        })
    }

    /// No option is ignored.
    fn refuse_others_options(&self) -> Result<(), Unfit> {
        let (is_kuka, is_abb) = (self.robot == Language::Krl, self.robot == Language::Rapid);
        if let Some(given) = self.egm.given().filter(|_| !is_abb) {
            return Err(unfit(format!("{given} is for abb"), "it is a name or a figure of a RAPID module"));
        }
        if self.rsi.is_some() && !is_kuka {
            return Err(unfit("--rsi is for kuka", "it is the form of an RSI context"));
        }
        let of_streams = self.pc.map(|_| "--pc").or_else(|| self.signal.as_ref().map(|_| "--signal"));
        if let Some(given) = of_streams.filter(|_| !is_kuka && !is_abb) {
            return Err(unfit(
                format!("{given} is for kuka and abb"),
                "the streams of other robots need no program",
            ));
        }
        let with_pc = self.egm.given().or_else(|| self.signal.as_ref().map(|_| "--signal"));
        if let Some(given) = with_pc.filter(|_| is_abb && self.pc.is_none()) {
            return Err(unfit(
                format!("abb: {given} needs --pc"),
                "without EGM the module is for tool0 in wobj0: edit it, or state where the PC listens",
            ));
        }
        match self.egm.given_of_guidance().filter(|_| self.egm.driver() == Driver::Robot) {
            Some(given) => Err(unfit(format!("{given} is a figure of a guidance"), "add --mode guidance")),
            None => Ok(()),
        }
    }
}

fn unfit(told: impl Into<String>, hint: &str) -> Unfit {
    [told.into(), hint.to_owned()]
}

fn number_of_input(given: &str) -> Result<u16, Unfit> {
    let number = given.parse().ok().filter(|number| (1..=MOST_INPUTS).contains(number));
    number.ok_or_else(|| {
        unfit(format!("--signal {given}: kuka sends a digital input"), "the number of $IN, from 1 to 4096")
    })
}
