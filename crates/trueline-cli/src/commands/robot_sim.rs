//! `trueline robot-sim`.

use crate::args::{EventName, ModeName, RobotSimArgs, RobotWareName, StopName};
use crate::failure::Failure;
use crate::{interrupt, output, path_file, priority};
use nalgebra::Vector3;
use std::io::IsTerminal;
use std::ops::ControlFlow;
use std::path::Path;
use std::process::ExitCode;
use std::time::{Duration, Instant};
use trueline_geometry::{Pose, Trajectory, so3};
use trueline_live::HostClock;
use trueline_live::controller::real_time::Cycle;
use trueline_live::controller::settings::{ControllerClock, Convergence};
use trueline_live::controller::{
    Controller, ControllerSettings, Event, GuidanceEnd, Network, NetworkSettings, RealTime, StopMode, Task,
    TruthSender,
};
use trueline_live::egm::Generation;

/// Runs the command.
pub fn run(args: &RobotSimArgs) -> Result<ExitCode, Failure> {
    check(args)?;
    interrupt::watch()?;
    let path = path(args.path.as_deref())?;
    let duration_s = args.for_s.unwrap_or(match args.mode {
        ModeName::Stream => path.span().1 - path.span().0 + 2.0 * args.rest_s,
        ModeName::Guidance => 60.0,
    });
    let network = network(args);
    let controller = Controller::new(settings(args, path));
    let (to_pc, to_robot) = (Network::new(network, args.seed), Network::new(network, args.seed ^ 0x5eed));
    let mut robot = RealTime::bind(controller, to_pc, to_robot, args.from, args.pc).map_err(|error| {
        Failure::new(
            format!("{}: cannot send from there: {error}", args.from),
            "--from is an address of this PC",
        )
    })?;
    let truth = args.truth_to.map(TruthSender::new).transpose().map_err(|error| {
        Failure::new(
            format!("--truth-to: {error}"),
            "it is an address of this machine, for example 127.0.0.1:7001",
        )
    })?;
    // A controller is punctual; without the right to be, this one is as punctual as the machine lets it.
    let _granted = priority::hurry();
    let ran = drive(&mut robot, truth.as_ref(), Duration::from_secs_f64(duration_s), args.quiet);
    ran.map_err(|error| Failure::new(format!("{}: {error}", args.pc), "can this PC reach that address?"))?;
    if !args.quiet {
        output::words(&summary(&robot));
    }
    let by_an_event =
        matches!(robot.controller().ended(), Some(GuidanceEnd::Timeout | GuidanceEnd::RangeLeft));
    Ok(if by_an_event { ExitCode::from(1) } else { ExitCode::SUCCESS })
}

fn drive(
    robot: &mut RealTime,
    truth: Option<&TruthSender>,
    duration: Duration,
    quiet: bool,
) -> std::io::Result<()> {
    let shows = !quiet && std::io::stderr().is_terminal();
    let mut shown = Instant::now();
    let mut told = None;
    let ran = robot.run(HostClock::start(), |cycle| {
        let Cycle { controller, passed, cycle_ns, steady_ns } = *cycle;
        if let (Some(truth), Some(pose)) = (truth, controller.true_pose(cycle_ns)) {
            truth.send(steady_ns, &pose);
        }
        if controller.ended() != told {
            told = controller.ended();
            if let (Some(end), false) = (told, quiet) {
                output::words(&format!("{:.2} s: {end}", passed.as_secs_f64()));
            }
        }
        if shows && shown.elapsed() > Duration::from_millis(250) {
            shown = Instant::now();
            output::status(&line(controller, duration.saturating_sub(passed)));
        }
        if passed >= duration || interrupt::times() > 0 {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    });
    if shows {
        output::status("");
    }
    ran
}

fn line(controller: &Controller, left: Duration) -> String {
    let pose = controller.true_pose(controller.next_cycle_ns()).unwrap_or_else(Pose::identity);
    let p = pose.translation.vector * 1e3;
    let (taken, _) = controller.answers();
    format!(
        "x {:.1}  y {:.1}  z {:.1} mm, {taken} answers taken, {:.0} s left",
        p.x,
        p.y,
        p.z,
        left.as_secs_f64()
    )
}

fn summary(robot: &RealTime) -> String {
    let counts = robot.counts();
    let (taken, refused) = robot.controller().answers();
    let mut text = format!(
        "{} frames sent, {} lost on purpose; {} answers came, {taken} were taken",
        counts.sent,
        robot.lost(),
        counts.received
    );
    if counts.unreachable > 0 {
        text.push_str(&format!("; nobody was there for {} frames", counts.unreachable));
    }
    for (reason, count) in refused {
        text.push_str(&format!("\n  {count} answers refused: {reason}"));
    }
    text
}

/// Nothing that is asked for here is as large.
const MOST: f64 = 1e6;

fn check(args: &RobotSimArgs) -> Result<(), Failure> {
    let positive = [
        ("--period-ms", args.period_ms),
        ("--low-pass-hz", args.low_pass_hz),
        ("--timeout-s", args.timeout_s),
        ("--near-mm", args.near_mm),
        ("--near-deg", args.near_deg),
        ("--near-for-s", args.near_for_s),
        ("--for-s", args.for_s.unwrap_or(1.0)),
    ];
    let not_negative = [
        ("--rest-s", args.rest_s),
        ("--gain-per-s", args.gain_per_s),
        ("--dead-time-ms", args.dead_time_ms),
        ("--noise-mm", args.noise_mm),
        ("--feedback-age-ms", args.feedback_age_ms),
        ("--delay-ms", args.delay_ms),
        ("--tail-ms", args.tail_ms),
    ];
    let shares = [
        ("--held-up", args.held_up),
        ("--loss", args.loss),
        ("--duplicate", args.duplicate),
        ("--reorder", args.reorder),
    ];
    let bad = |name: &str, expected: &str, found: f64| {
        Failure::new(
            format!("{name}: expected {expected}, found {found}"),
            "`trueline robot-sim --help` explains it",
        )
    };
    for (name, value) in positive {
        if !(value > 0.0 && value < MOST) {
            return Err(bad(name, "a number above 0 and below a million", value));
        }
    }
    for (name, value) in not_negative {
        if !(0.0..MOST).contains(&value) {
            return Err(bad(name, "0 or more, below a million", value));
        }
    }
    if !(1.0..1e4).contains(&args.burst) {
        return Err(bad("--burst", "1 to 10 000", args.burst));
    }
    if !(0.0..4e9).contains(&args.epoch_s) {
        return Err(bad("--epoch-s", "0 or more, below 4 000 000 000", args.epoch_s));
    }
    for (name, value) in shares {
        if !(0.0..=1.0).contains(&value) {
            return Err(bad(name, "a share from 0 to 1", value));
        }
    }
    if args.drift_ppm.abs() > 1e5 || args.drift_ppm.is_nan() {
        return Err(bad("--drift-ppm", "-100 000 to 100 000", args.drift_ppm));
    }
    match args.clock_step {
        Some((at, by)) if at.abs() > MOST || by.abs() > 1e3 * MOST => {
            Err(bad("--clock-step", "AT:BY in seconds", by))
        }
        _ => Ok(()),
    }
}

/// The path in a file; a small S without one.
pub fn path(file: Option<&Path>) -> Result<Trajectory, Failure> {
    let Some(path) = file else { return Ok(small_s()) };
    let poses = path_file::read(path)?;
    let times = poses.iter().map(|p| (p.stamp_ns - poses[0].stamp_ns) as f64 * 1e-9).collect();
    let poses: Vec<Pose> = poses.iter().map(|p| p.base_from_tool).collect();
    Trajectory::new(times, &poses).map_err(|error| {
        Failure::new(
            format!("{}: {error}", path_file::file(path).display()),
            "a path has poses at rising times",
        )
    })
}

/// Half a metre along x in 20 s, weaving 20 mm and tilting, from rest to rest.
fn small_s() -> Trajectory {
    let down = so3::exp(&Vector3::new(std::f64::consts::PI, 0.0, 0.0));
    let (mut times, mut poses) = (Vec::new(), Vec::new());
    for k in 0..=5000 {
        let time_s = f64::from(k) * 0.004;
        let done = time_s / 20.0;
        let eased = done.powi(3) * (10.0 - 15.0 * done + 6.0 * done * done);
        let phase = std::f64::consts::TAU * 4.0 * eased;
        let position = Vector3::new(0.7 + 0.5 * eased, 0.02 * phase.sin(), 0.6);
        let turn = Vector3::new(0.15 * (1.5 * phase).sin(), 0.1 * phase.sin(), 0.0);
        times.push(time_s);
        poses.push(Pose::from_parts(position.into(), down * so3::exp(&turn)));
    }
    Trajectory::new(times, &poses).unwrap_or_else(|_| unreachable!("its times rise"))
}

fn network(args: &RobotSimArgs) -> NetworkSettings {
    NetworkSettings {
        least_s: args.delay_ms * 1e-3,
        tail_s: args.tail_ms * 1e-3,
        held_up: args.held_up,
        loss: args.loss,
        duplicate: args.duplicate,
        reorder: args.reorder,
        burst: args.burst,
    }
}

fn settings(args: &RobotSimArgs, path: Trajectory) -> ControllerSettings {
    let start = path.pose_at(path.span().0).unwrap_or_else(Pose::identity);
    let task = match args.mode {
        ModeName::Stream => Task::Stream { path, rest_s: args.rest_s },
        ModeName::Guidance => Task::Guidance { start },
    };
    let mut settings = ControllerSettings::new(task);
    settings.generation = match args.robotware {
        RobotWareName::V6_07 => Generation::From6_07,
        RobotWareName::V6_10 => Generation::From6_10,
        RobotWareName::V7_7 => Generation::From7,
        RobotWareName::V7_16 => Generation::From7_16,
    };
    settings.period_s = args.period_ms * 1e-3;
    settings.following.gain_per_s = args.gain_per_s;
    settings.following.low_pass_hz = args.low_pass_hz;
    settings.following.dead_time_s = args.dead_time_ms * 1e-3;
    settings.timeout_s = args.timeout_s;
    settings.waits_for_pc = args.wait_for_pc;
    settings.convergence = Convergence {
        distance_m: args.near_mm * 1e-3,
        angle_rad: args.near_deg.to_radians(),
        for_s: args.near_for_s,
    };
    settings.stop_mode = match args.stop {
        StopName::Hold => StopMode::Hold,
        StopName::RampDown => StopMode::RampDown,
    };
    settings.feedback.noise_m = args.noise_mm * 1e-3;
    settings.feedback.age_s = args.feedback_age_ms * 1e-3;
    settings.clock =
        ControllerClock { epoch_s: args.epoch_s, drift_ppm: args.drift_ppm, step_s: args.clock_step };
    settings.events = args.events.iter().map(|(at_s, event)| (*at_s, happens(*event))).collect();
    settings.seed = args.seed;
    settings
}

fn happens(event: EventName) -> Event {
    match event {
        EventName::EmergencyStop => Event::EmergencyStop,
        EventName::MotorsOn => Event::MotorsOn,
        EventName::RapidStop => Event::RapidStop,
        EventName::RapidStart => Event::RapidStart,
        EventName::Collision => Event::Collision,
        EventName::Restart => Event::Restart,
    }
}
