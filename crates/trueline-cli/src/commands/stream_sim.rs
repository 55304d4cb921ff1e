//! `trueline-testbench stream-sim`.

use crate::args::StreamSimArgs;
use crate::failure::Failure;
use crate::{interrupt, output, path_file};
use std::net::SocketAddr;
use std::process::ExitCode;
use std::time::Duration;
use trueline_live::Protocol;
use trueline_live::pose_feed::PoseFeed;
use trueline_live::stream_sim::versions;

/// Runs the command.
pub(crate) fn run(args: &StreamSimArgs) -> Result<ExitCode, Failure> {
    check(args)?;
    interrupt::watch()?;
    let feed = PoseFeed::new(path_file::trajectory(args.path.as_deref())?, args.rest_s);
    let duration = Duration::from_secs_f64(args.for_s.unwrap_or(feed.duration_s()));
    let address = address(args)?;
    let report =
        args.sim(address, feed)?.run(|passed| interrupt::until(passed, duration)).map_err(|error| {
            let hint = "it is an address of this PC, with a port that is free";
            Failure::new(format!("{address}: {error}"), hint)
        })?;
    if !args.quiet {
        output::words(&report.to_string());
    }
    Ok(ExitCode::SUCCESS)
}

fn check(args: &StreamSimArgs) -> Result<(), Failure> {
    let explained = "`trueline-testbench stream-sim --help` explains it";
    if args.protocol == Protocol::Egm {
        let message = "--protocol egm: a robot that speaks EGM is another command";
        return Err(Failure::new(message, "trueline-testbench robot-sim"));
    }
    let known = |version: &u32| versions(args.protocol).is_some_and(|versions| versions.contains(version));
    if args.version_of.is_some_and(|version| !known(&version)) {
        let message = "--version-of: RTDE has 1 and 2, Stream Motion 1 to 4, the others none";
        return Err(Failure::new(message, explained));
    }
    if args.protocol == Protocol::UrRtde && (args.period_ms.is_some() || args.loss.is_some()) {
        let message = "--period-ms, --loss: RTDE's clients choose the rate, and TCP loses nothing";
        return Err(Failure::new(message, explained));
    }
    Ok(())
}

fn address(args: &StreamSimArgs) -> Result<SocketAddr, Failure> {
    match (args.protocol.controllers_port(), args.listen, args.pc) {
        (Some(_), Some(address), None) | (None, None, Some(address)) => Ok(address),
        (Some(_), ..) => Err(Failure::new(
            "--listen IP:PORT is needed, and --pc is not: PCs call this controller",
            "for example --listen 127.0.0.1:30004",
        )),
        (None, ..) => Err(Failure::new(
            "--pc IP:PORT is needed, and --listen is not: this controller speaks first",
            "for example --pc 127.0.0.1:49152",
        )),
    }
}
