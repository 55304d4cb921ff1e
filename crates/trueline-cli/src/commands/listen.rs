//! `trueline listen`.

use crate::args::{LinkArgs, ListenArgs};
use crate::failure::Failure;
use crate::{interrupt, output};
use std::io::IsTerminal;
use std::process::ExitCode;
use std::time::{Duration, Instant};
use trueline_live::link_watch::LinkReport;
use trueline_live::{HostClock, LinkAddress, Rejection, RobotLink, StreamReport, StreamWatch};

/// Runs the command.
pub(crate) fn run(args: &ListenArgs) -> Result<ExitCode, Failure> {
    output::expect_files(&[], &[args.json.as_deref()])?;
    interrupt::watch()?;
    let mut link = args.link.open(HostClock::start())?;
    let mut watch = StreamWatch::default();
    let wrong = listen(&mut link, &mut watch, args);
    let report = watch.report(&link);
    if let Some(file) = &args.json {
        output::json(file, &format!("{:#}", report.to_json()))?;
    }
    if !args.quiet {
        output::summary(args.json.as_deref(), &format!("{report}{}", advice(&report, &args.link)))?;
    }
    if let Some(error) = &wrong {
        output::words(&format!("warning: {error}"));
    }
    Ok(if report.has_robot() && wrong.is_none() { ExitCode::SUCCESS } else { ExitCode::from(1) })
}

fn listen(
    link: &mut RobotLink,
    watch: &mut StreamWatch,
    args: &ListenArgs,
) -> Option<trueline_live::robot_source::SourceError> {
    let shows = !args.quiet && std::io::stderr().is_terminal();
    let (start, mut shown) = (Instant::now(), Instant::now());
    let wrong = link.listen(watch, |watch| {
        if shows && shown.elapsed() > Duration::from_millis(250) {
            shown = Instant::now();
            let left_s = args.for_s.saturating_sub(start.elapsed()).as_secs_f64();
            output::status(&format!("listening, {left_s:.0} s left. {}", watch.brief()));
        }
        start.elapsed() < args.for_s && interrupt::times() == 0
    });
    if shows {
        output::status("");
    }
    wrong
}

/// Points to check if no robot was received.
fn advice(report: &StreamReport, link: &LinkArgs) -> String {
    match report {
        report if report.has_robot() => String::new(),
        StreamReport::Egm(report) => nothing(report, &link.address()),
        StreamReport::Other(..) => format!("No robot was heard. {}\n", link.advice_if_silent()),
    }
}

fn nothing(report: &LinkReport, address: &LinkAddress) -> String {
    let foreign = Rejection::OtherSender.to_string();
    let others = report.talkers.iter().find(|(_, talker)| talker.rejected.contains_key(&foreign));
    if let (Some(robot), Some((from, _))) = (address.robot, others) {
        return format!("{from} sends here, and --robot names {robot}: only that address was listened to.\n");
    }
    let Some(bind) = address.bind.filter(|_| report.talkers.is_empty()) else {
        return "No robot was heard, only what is listed above.\n".to_owned();
    };
    let (ip, port) = (bind.ip(), bind.port());
    let pc = match ip.is_unspecified() {
        true => "this PC's address on the robot's network".to_owned(),
        false => ip.to_string(),
    };
    format!(
        "Nothing arrived at {bind}. The controller sends first; check, most frequent cause first:\n\
         \x20 - the UDPUC device's remote address must be {pc}, its remote port {port}; restart the controller after a change\n\
         \x20 - RAPID must run, up to EGMStreamStart or EGMRunPose, with EGMSetupUC naming that device\n\
         \x20 - the PC's firewall must let UDP port {port} in; on RobotWare 7 the controller's, too, for UDPUC\n\
         \x20 - a virtual controller of RobotWare 7 sends to 127.0.0.1 alone\n\
         \x20 - can the controller reach this PC? `ping` it from the other side\n",
    )
}
