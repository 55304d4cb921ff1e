//! `trueline-testbench robot-sim`.

use crate::args::RobotSimArgs;
use crate::failure::Failure;
use crate::{interrupt, output, path_file};
use std::io::IsTerminal;
use std::process::ExitCode;
use std::time::{Duration, Instant};
use trueline_geometry::Pose;
use trueline_live::controller::real_time::Cycle;
use trueline_live::controller::{Controller, GuidanceEnd, Network, RealTime};
use trueline_live::priority;
use trueline_plan::robot_program::rapid_egm::Driver;

/// Runs the command.
pub(crate) fn run(args: &RobotSimArgs) -> Result<ExitCode, Failure> {
    interrupt::watch()?;
    let path = path_file::trajectory(args.path.as_deref())?;
    let duration_s = args.for_s.unwrap_or(match args.mode {
        Driver::Robot => path.span().1 - path.span().0 + 2.0 * args.rest_s,
        Driver::Pc => 60.0,
    });
    let network = args.network();
    let (to_pc, to_robot) = (Network::new(network, args.seed), Network::new(network, args.seed ^ 0x5eed));
    let controller = Controller::new(args.controller(path));
    let robot = RealTime::bind(controller, to_pc, to_robot, args.from, args.pc).map_err(|error| {
        let message = format!("{}: cannot send from there: {error}", args.from);
        Failure::new(message, "--from is an address of this PC")
    })?;
    let mut robot = robot.wired(args.wiring().map_err(|error| {
        let hint = "they are addresses of this machine, for example 127.0.0.1:7001";
        Failure::new(format!("--truth-to, --input-from: {error}"), hint)
    })?);
    // A controller is punctual; without the right to be, this one is as punctual as the machine lets it.
    let _granted = priority::request_real_time();
    let ran = drive(&mut robot, Duration::from_secs_f64(duration_s), args.quiet);
    ran.map_err(|error| Failure::new(format!("{}: {error}", args.pc), "can this PC reach that address?"))?;
    if !args.quiet {
        output::words(&robot.to_string());
    }
    let by_an_event =
        matches!(robot.controller().ended(), Some(GuidanceEnd::Timeout | GuidanceEnd::RangeLeft));
    Ok(if by_an_event { ExitCode::from(1) } else { ExitCode::SUCCESS })
}

fn drive(robot: &mut RealTime, duration: Duration, quiet: bool) -> std::io::Result<()> {
    let shows = !quiet && std::io::stderr().is_terminal();
    let (mut shown, mut told) = (Instant::now(), None);
    let ran = robot.run(|cycle| {
        let Cycle { controller, passed } = *cycle;
        if controller.ended() != told {
            told = controller.ended();
            if let (Some(end), false) = (told, quiet) {
                output::words(&format!("{:.2} s: {end}", passed.as_secs_f64()));
            }
        }
        if shows && shown.elapsed() > Duration::from_millis(250) {
            shown = Instant::now();
            let left_s = duration.saturating_sub(passed).as_secs_f64();
            output::status(&format!("{}, {left_s:.0} s left", line(controller)));
        }
        interrupt::until(passed, duration)
    });
    if shows {
        output::status("");
    }
    ran
}

fn line(controller: &Controller) -> String {
    let pose = controller.true_pose(controller.next_cycle_ns()).unwrap_or_else(Pose::identity);
    let p = pose.translation.vector * 1e3;
    format!("x {:.1}  y {:.1}  z {:.1} mm, {} answers taken", p.x, p.y, p.z, controller.answers().0)
}
