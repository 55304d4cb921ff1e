//! `trueline-testbench robot-sim`.

use crate::args::choice::{Choice, named, one_of};
use crate::args::number;
use crate::args::rapid_egm::DRIVERS;
use crate::args::wiring::WiringArgs;
use clap::Args;
use std::io;
use std::net::SocketAddr;
use std::path::PathBuf;
use trueline_geometry::{Pose, Trajectory};
use trueline_live::controller::settings::{ControllerClock, Convergence};
use trueline_live::controller::{ControllerSettings, Event, NetworkSettings, StopMode, Task, Wiring};
use trueline_live::egm::Generation;
use trueline_plan::robot_program::rapid_egm::Driver;

#[derive(Args)]
#[command(after_help = "Examples:
  trueline-testbench robot-sim --pc 127.0.0.1:6510 --path plan            # streams while its own program drives the plan's path
  trueline-testbench robot-sim --pc 127.0.0.1:6510 --mode guidance --path plan --gain-per-s 20 --for-s 60
  trueline-testbench robot-sim --pc 127.0.0.1:6510 --loss 0.01 --reorder 0.01 --drift-ppm 30 --event 5:emergency-stop

A controller with EGM as its manual and its users describe it: it speaks first, reads one answer a cycle, follows with \
gain, low pass and dead time, ends by timeout (event 41822) or when it rests at its reference. Not known of real ones, and \
assumed: what becomes of several answers in a cycle, how old a feedback is, how far `planned` is ahead. Its limits are \
those of the tool, not of joints; joint references and path corrections are refused. It answers to whoever sends it datagrams: \
use it on 127.0.0.1.

Exit code: 0 ran, 1 a guidance ended by an event (41822, or the range was left), 2 could not run.")]
pub(crate) struct RobotSimArgs {
    /// Address of the PC
    #[arg(long, value_name = "IP:PORT")]
    pub(crate) pc: SocketAddr,
    /// Address of the controller
    #[arg(long, value_name = "IP:PORT", default_value = "127.0.0.1:0")]
    pub(crate) from: SocketAddr,
    /// Begin a guidance when the PC has answered for the first time, not 0.2 s after the start
    #[arg(long)]
    pub(crate) wait_for_pc: bool,
    /// Who drives
    #[arg(long, value_parser = one_of(&DRIVERS), default_value = "stream")]
    pub(crate) mode: Driver,
    /// A plan's folder or a robot.csv: the path of the stream, or where a guided robot stands [default: a small S]
    #[arg(long)]
    pub(crate) path: Option<PathBuf>,
    /// Rest before and after the path, s
    #[arg(long, default_value_t = 2.0, value_parser = number::rest_s)]
    pub(crate) rest_s: f64,
    /// How long, s [default: as long as path and rests; a minute of guidance]
    #[arg(long, value_parser = number::seconds)]
    pub(crate) for_s: Option<f64>,
    /// Which RobotWare's fields
    #[arg(long, value_parser = one_of(&GENERATIONS), default_value = "7.7")]
    pub(crate) robotware: Generation,
    /// Time between messages, ms: 4.032 of real controllers, 4 of virtual ones
    #[arg(long, default_value_t = 4.032, value_parser = number::above_zero)]
    pub(crate) period_ms: f64,
    /// Position gain times \PosCorrGain, 1/s
    #[arg(long, default_value_t = 5.0, value_parser = number::zero_or_more)]
    pub(crate) gain_per_s: f64,
    /// Low pass of the speed, Hz
    #[arg(long, default_value_t = 20.0, value_parser = number::above_zero)]
    pub(crate) low_pass_hz: f64,
    /// Dead time from reference to motion, ms
    #[arg(long, default_value_t = 15.0, value_parser = number::zero_or_more)]
    pub(crate) dead_time_ms: f64,
    /// \CommTimeout, s
    #[arg(long, default_value_t = 0.2, value_parser = number::above_zero)]
    pub(crate) timeout_s: f64,
    /// Distance from the reference at which guidance ends, mm (as `trueline robot-program abb` writes it; RAPID's own default is 1)
    #[arg(long, default_value_t = 0.01, value_parser = number::above_zero)]
    pub(crate) near_mm: f64,
    /// and so much, degrees (RAPID's own default is 0.5)
    #[arg(long, default_value_t = 0.01, value_parser = number::above_zero)]
    pub(crate) near_deg: f64,
    /// for so long (\CondTime), s (RAPID's own default is 1)
    #[arg(long, default_value_t = 3.0, value_parser = number::above_zero)]
    pub(crate) near_for_s: f64,
    /// Behaviour of the robot when guidance ends
    #[arg(long, value_parser = one_of(&STOP_MODES), default_value = "hold")]
    pub(crate) stop: StopMode,
    /// Noise of a reported position, mm
    #[arg(long, default_value_t = 0.01, value_parser = number::zero_or_more)]
    pub(crate) noise_mm: f64,
    /// How much older a reported pose is than its time, ms
    #[arg(long, default_value_t = 0.0, value_parser = number::zero_or_more)]
    pub(crate) feedback_age_ms: f64,
    /// How much the controller's clock runs fast, ppm
    #[arg(long, default_value_t = 20.0, value_parser = number::drift_ppm)]
    pub(crate) drift_ppm: f64,
    /// Its clock's reading at the start, s
    #[arg(long, default_value_t = 86_400.0, value_parser = number::epoch_s)]
    pub(crate) epoch_s: f64,
    /// Its clock is set: at this time by so much, s
    #[arg(long, value_name = "AT:BY", value_parser = at_by, allow_hyphen_values = true)]
    pub(crate) clock_step: Option<(f64, f64)>,
    /// Least delay of the network, ms
    #[arg(long, default_value_t = 0.0, value_parser = number::zero_or_more)]
    pub(crate) delay_ms: f64,
    /// Mean of its exponential tail, ms
    #[arg(long, default_value_t = 0.0, value_parser = number::zero_or_more)]
    pub(crate) tail_ms: f64,
    /// Share of datagrams held up by 0.5 to 8 ms
    #[arg(long, default_value_t = 0.0, value_parser = number::share)]
    pub(crate) held_up: f64,
    /// Share lost, each way
    #[arg(long, default_value_t = 0.0, value_parser = number::share)]
    pub(crate) loss: f64,
    /// Share that comes twice
    #[arg(long, default_value_t = 0.0, value_parser = number::share)]
    pub(crate) duplicate: f64,
    /// Share overtaken by the next
    #[arg(long, default_value_t = 0.0, value_parser = number::share)]
    pub(crate) reorder: f64,
    /// Mean number of datagrams lost in a row, 1 or more
    #[arg(long, default_value_t = 1.0, value_parser = number::burst)]
    pub(crate) burst: f64,
    /// Something happens: seconds, and emergency-stop, motors-on, rapid-stop, rapid-start, collision or restart
    #[arg(long = "event", value_name = "AT:WHAT", value_parser = event)]
    pub(crate) events: Vec<(f64, Event)>,
    #[command(flatten)]
    pub(crate) wiring: WiringArgs,
    /// Seed of noise and network
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    /// Print nothing but errors
    #[arg(long)]
    pub(crate) quiet: bool,
}

static GENERATIONS: [Choice<Generation>; 4] = [
    ("6.07", "", Generation::From6_07),
    ("6.10", "", Generation::From6_10),
    ("7.7", "", Generation::From7),
    ("7.16", "", Generation::From7_16),
];

static STOP_MODES: [Choice<StopMode>; 2] = [
    ("hold", "`EGM_STOP_HOLD`", StopMode::Hold),
    ("ramp-down", "`EGM_STOP_RAMP_DOWN`: back to where it began", StopMode::RampDown),
];

static EVENTS: [Choice<Event>; 6] = [
    ("emergency-stop", "", Event::EmergencyStop),
    ("motors-on", "", Event::MotorsOn),
    ("rapid-stop", "", Event::RapidStop),
    ("rapid-start", "", Event::RapidStart),
    ("collision", "", Event::Collision),
    ("restart", "", Event::Restart),
];

fn at_by(text: &str) -> Result<(f64, f64), String> {
    let (at, by) = text.split_once(':').ok_or("write AT:BY, both in seconds, for example 10:-3600")?;
    Ok((number::clock_step_s(at)?, number::clock_step_s(by)?))
}

fn event(text: &str) -> Result<(f64, Event), String> {
    let (at, what) = text.split_once(':').ok_or("write AT:WHAT, for example 5:emergency-stop")?;
    Ok((number::any(at)?, named(&EVENTS, what)?))
}

impl RobotSimArgs {
    /// The network between controller and PC, each way.
    pub(crate) fn network(&self) -> NetworkSettings {
        NetworkSettings {
            least_s: self.delay_ms * 1e-3,
            tail_s: self.tail_ms * 1e-3,
            held_up: self.held_up,
            loss: self.loss,
            duplicate: self.duplicate,
            reorder: self.reorder,
            burst: self.burst,
        }
    }

    /// Its wiring.
    ///
    /// # Errors
    /// Error of the operating system; a RobotWare that sends no signal along.
    pub(crate) fn wiring(&self) -> io::Result<Wiring> {
        if self.wiring.input_from.is_some() && self.robotware < Generation::From7 {
            let why = "RobotWare before 7.7 sends no signal along";
            return Err(io::Error::new(io::ErrorKind::Unsupported, why));
        }
        Wiring::new(&self.wiring.settings())
    }

    /// The controller, and what RAPID does along a path.
    pub(crate) fn controller(&self, path: Trajectory) -> ControllerSettings {
        let task = match self.mode {
            Driver::Robot => Task::Stream { path, rest_s: self.rest_s },
            Driver::Pc => {
                Task::Guidance { start: path.pose_at(path.span().0).unwrap_or_else(Pose::identity) }
            }
        };
        let mut settings = ControllerSettings::new(task);
        settings.generation = self.robotware;
        settings.period_s = self.period_ms * 1e-3;
        settings.following.gain_per_s = self.gain_per_s;
        settings.following.low_pass_hz = self.low_pass_hz;
        settings.following.dead_time_s = self.dead_time_ms * 1e-3;
        settings.timeout_s = self.timeout_s;
        settings.waits_for_pc = self.wait_for_pc;
        settings.convergence = Convergence {
            distance_m: self.near_mm * 1e-3,
            angle_rad: self.near_deg.to_radians(),
            for_s: self.near_for_s,
        };
        settings.stop_mode = self.stop;
        settings.feedback.noise_m = self.noise_mm * 1e-3;
        settings.feedback.age_s = self.feedback_age_ms * 1e-3;
        settings.clock =
            ControllerClock { epoch_s: self.epoch_s, drift_ppm: self.drift_ppm, step_s: self.clock_step };
        settings.events = self.events.clone();
        settings.seed = self.seed;
        settings
    }
}
