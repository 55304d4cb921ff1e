//! `trueline robot-sim`.

use clap::{Args, ValueEnum};
use std::net::SocketAddr;
use std::path::PathBuf;

#[derive(Args)]
#[command(after_help = "Examples:
  trueline robot-sim --pc 127.0.0.1:6510 --path plan            # streams while its own program drives the plan's path
  trueline robot-sim --pc 127.0.0.1:6510 --mode guidance --path plan --gain-per-s 20 --for-s 60
  trueline robot-sim --pc 127.0.0.1:6510 --loss 0.01 --reorder 0.01 --drift-ppm 30 --event 5:emergency-stop

A controller with EGM as its manual and its users describe it: it speaks first, reads one answer a cycle, follows with
gain, low pass and dead time, ends by timeout (event 41822) or when it rests at its reference. Not known of real ones, and
assumed: what becomes of several answers in a cycle, how old a feedback is, how far `planned` is ahead. Its limits are
those of the tool, not of joints; joint references and path corrections are refused. It answers to whoever sends it datagrams:
use it on 127.0.0.1. Exit code: 0 ran, 1 a guidance ended by an event (41822, or the range was left), 2 could not run.")]
pub struct RobotSimArgs {
    /// Where the PC listens
    #[arg(long, value_name = "IP:PORT")]
    pub pc: SocketAddr,
    /// Where the controller sends from
    #[arg(long, value_name = "IP:PORT", default_value = "127.0.0.1:0")]
    pub from: SocketAddr,
    /// Begin a guidance when the PC has answered for the first time, not 0.2 s after the start
    #[arg(long)]
    pub wait_for_pc: bool,
    /// Who drives
    #[arg(long, value_enum, default_value_t = ModeName::Stream)]
    pub mode: ModeName,
    /// A plan's folder or a robot.csv: the path of the stream, or where a guided robot stands [default: a small S]
    #[arg(long)]
    pub path: Option<PathBuf>,
    /// Rest before and after the path, s
    #[arg(long, default_value_t = 2.0)]
    pub rest_s: f64,
    /// How long, s [default: as long as path and rests; a minute of guidance]
    #[arg(long)]
    pub for_s: Option<f64>,
    /// Which RobotWare's fields
    #[arg(long, value_enum, default_value_t = RobotWareName::V7_7)]
    pub robotware: RobotWareName,
    /// Time between messages, ms: 4.032 of real controllers, 4 of virtual ones
    #[arg(long, default_value_t = 4.032)]
    pub period_ms: f64,
    /// Position gain times \PosCorrGain, 1/s
    #[arg(long, default_value_t = 5.0)]
    pub gain_per_s: f64,
    /// Low pass of the speed, Hz
    #[arg(long, default_value_t = 20.0)]
    pub low_pass_hz: f64,
    /// Dead time from reference to motion, ms
    #[arg(long, default_value_t = 15.0)]
    pub dead_time_ms: f64,
    /// \CommTimeout, s
    #[arg(long, default_value_t = 0.2)]
    pub timeout_s: f64,
    /// Guidance ends within so much of the reference, mm (as `trueline rapid` writes it; RAPID's own default is 1)
    #[arg(long, default_value_t = 0.01)]
    pub near_mm: f64,
    /// and so much, degrees (RAPID's own default is 0.5)
    #[arg(long, default_value_t = 0.01)]
    pub near_deg: f64,
    /// for so long (\CondTime), s (RAPID's own default is 1)
    #[arg(long, default_value_t = 3.0)]
    pub near_for_s: f64,
    /// What the robot does when guidance ends
    #[arg(long, value_enum, default_value_t = StopName::Hold)]
    pub stop: StopName,
    /// Noise of a reported position, mm
    #[arg(long, default_value_t = 0.01)]
    pub noise_mm: f64,
    /// How much older a reported pose is than its time, ms
    #[arg(long, default_value_t = 0.0)]
    pub feedback_age_ms: f64,
    /// How much the controller's clock runs fast, ppm
    #[arg(long, default_value_t = 20.0, allow_negative_numbers = true)]
    pub drift_ppm: f64,
    /// What its clock says at the start, s
    #[arg(long, default_value_t = 86_400.0)]
    pub epoch_s: f64,
    /// Its clock is set: at this time by so much, s
    #[arg(long, value_name = "AT:BY", value_parser = at_by, allow_hyphen_values = true)]
    pub clock_step: Option<(f64, f64)>,
    /// Least delay of the network, ms
    #[arg(long, default_value_t = 0.0)]
    pub delay_ms: f64,
    /// Mean of its exponential tail, ms
    #[arg(long, default_value_t = 0.0)]
    pub tail_ms: f64,
    /// Share of datagrams held up by 0.5 to 8 ms
    #[arg(long, default_value_t = 0.0)]
    pub held_up: f64,
    /// Share lost, each way
    #[arg(long, default_value_t = 0.0)]
    pub loss: f64,
    /// Share that comes twice
    #[arg(long, default_value_t = 0.0)]
    pub duplicate: f64,
    /// Share overtaken by the next
    #[arg(long, default_value_t = 0.0)]
    pub reorder: f64,
    /// Mean number of datagrams lost in a row, 1 or more
    #[arg(long, default_value_t = 1.0)]
    pub burst: f64,
    /// Something happens: seconds, and emergency-stop, motors-on, rapid-stop, rapid-start, collision or restart
    #[arg(long = "event", value_name = "AT:WHAT", value_parser = event)]
    pub events: Vec<(f64, EventName)>,
    /// Tell a `trueline camera-sim` on this machine where the robot truly is
    #[arg(long, value_name = "IP:PORT")]
    pub truth_to: Option<SocketAddr>,
    /// Seed of noise and network
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Print nothing but errors
    #[arg(long)]
    pub quiet: bool,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ModeName {
    /// The robot's own program, along the path; answers are not used
    Stream,
    /// The PC's references
    Guidance,
}

#[derive(Clone, Copy, ValueEnum)]
pub enum RobotWareName {
    #[value(name = "6.07")]
    V6_07,
    #[value(name = "6.10")]
    V6_10,
    #[value(name = "7.7")]
    V7_7,
    #[value(name = "7.16")]
    V7_16,
}

#[derive(Clone, Copy, ValueEnum)]
pub enum StopName {
    /// `EGM_STOP_HOLD`
    Hold,
    /// `EGM_STOP_RAMP_DOWN`: back to where it began
    RampDown,
}

#[derive(Clone, Copy, ValueEnum)]
pub enum EventName {
    EmergencyStop,
    MotorsOn,
    RapidStop,
    RapidStart,
    Collision,
    Restart,
}

fn at_by(text: &str) -> Result<(f64, f64), String> {
    let (at, by) = text.split_once(':').ok_or("write AT:BY, both in seconds, for example 10:-3600")?;
    Ok((seconds(at)?, seconds(by)?))
}

fn event(text: &str) -> Result<(f64, EventName), String> {
    let (at, what) = text.split_once(':').ok_or("write AT:WHAT, for example 5:emergency-stop")?;
    Ok((seconds(at)?, EventName::from_str(what, true)?))
}

fn seconds(text: &str) -> Result<f64, String> {
    text.parse()
        .ok()
        .filter(|s: &f64| s.is_finite())
        .ok_or_else(|| format!("`{text}` is no number of seconds"))
}
