//! `trueline listen`.

use super::listen_source;
use crate::args::{ListenArgs, ProtocolName};
use crate::failure::Failure;
use crate::{interrupt, link_text, output};
use std::collections::BTreeMap;
use std::io::IsTerminal;
use std::net::{IpAddr, SocketAddr};
use std::process::ExitCode;
use std::time::{Duration, Instant};
use trueline_live::link_watch::Talker;
use trueline_live::{Endpoint, HostClock, LinkWatch, Rejection};

/// Runs the command.
pub fn run(args: &ListenArgs) -> Result<ExitCode, Failure> {
    let link = args.link.link();
    if link.protocol != ProtocolName::Egm {
        return listen_source::run(&link, args);
    }
    interrupt::watch()?;
    let address = link.bind()?;
    let mut endpoint = bind(address, link.robot, HostClock::start())?;
    let watch = listen(&mut endpoint, address, args)?;
    let report = watch.report();
    let heard = report.robot.is_some();
    if let Some(file) = &args.json {
        output::json(file, &format!("{:#}", link_text::json(&report)))?;
    }
    if !args.quiet {
        let mut text = link_text::text(&report);
        if !heard {
            text.push_str(&nothing(address, link.robot, &report.talkers));
        }
        output::summary(args.json.as_deref(), &text)?;
    }
    Ok(if heard { ExitCode::SUCCESS } else { ExitCode::from(1) })
}

/// A socket for a robot.
pub fn bind(address: SocketAddr, robot: Option<IpAddr>, clock: HostClock) -> Result<Endpoint, Failure> {
    if address.port() == 0 {
        return Err(Failure::new(
            format!("{address}: a controller cannot know which port that is"),
            "name the port that its UDPUC device has, for example 6510",
        ));
    }
    Endpoint::bind(address, robot, clock).map_err(|error| bind_failure(address, &error))
}

/// Why a socket could not be had, and what to do.
pub fn bind_failure(address: SocketAddr, error: &std::io::Error) -> Failure {
    let hint = match error.kind() {
        std::io::ErrorKind::AddrInUse => {
            "another program listens there; end it, or use another port".to_owned()
        }
        std::io::ErrorKind::AddrNotAvailable => {
            "it is no address of this PC: `ip address` lists them".to_owned()
        }
        _ => "ports below 1024 need more rights".to_owned(),
    };
    Failure::new(format!("{address}: cannot listen: {error}"), hint)
}

fn listen(endpoint: &mut Endpoint, address: SocketAddr, args: &ListenArgs) -> Result<LinkWatch, Failure> {
    let duration = duration(args)?;
    let shows = !args.quiet && std::io::stderr().is_terminal();
    let (start, mut shown) = (Instant::now(), Instant::now());
    let mut watch = LinkWatch::default();
    while start.elapsed() < duration && interrupt::times() == 0 {
        endpoint
            .receive(Duration::from_millis(50), |heard| watch.note(heard))
            .map_err(|error| Failure::new(format!("{address}: {error}"), "did the network go away?"))?;
        if shows && shown.elapsed() > Duration::from_millis(250) {
            shown = Instant::now();
            output::status(&line(&watch, duration.saturating_sub(start.elapsed())));
        }
    }
    if shows {
        output::status("");
    }
    Ok(watch)
}

/// How long is listened.
pub fn duration(args: &ListenArgs) -> Result<Duration, Failure> {
    Duration::try_from_secs_f64(args.for_s)
        .map_err(|_| Failure::new("--for-s: expected a number of seconds above 0", "for example --for-s 5"))
}

fn line(watch: &LinkWatch, left: Duration) -> String {
    let report = watch.report();
    let heard = match &report.robot {
        Some((from, frame)) => format!("{from}: {} frames, {}", report.frames, link_text::state(frame)),
        None => format!("no robot yet; {} senders", report.talkers.len()),
    };
    format!("listening, {:.0} s left. {heard}", left.as_secs_f64())
}

fn nothing(bind: SocketAddr, robot: Option<IpAddr>, talkers: &BTreeMap<SocketAddr, Talker>) -> String {
    let foreign = Rejection::OtherSender.to_string();
    let others = talkers.iter().find(|(_, talker)| talker.rejected.contains_key(&foreign));
    if let (Some(robot), Some((from, _))) = (robot, others) {
        return format!("{from} sends here, and --robot names {robot}: only that address was listened to.\n");
    }
    if !talkers.is_empty() {
        return "No robot was heard, only what is listed above.\n".to_owned();
    }
    let (ip, port) = (bind.ip(), bind.port());
    let address = match ip.is_unspecified() {
        true => "this PC's address on the robot's network".to_owned(),
        false => ip.to_string(),
    };
    format!(
        "Nothing came to {}. The controller speaks first; what to look at, most frequent first:\n\
         \x20 - the UDPUC device's remote address must be {address}, its remote port {port}; restart the controller after a change\n\
         \x20 - RAPID must run, up to EGMStreamStart or EGMRunPose, with EGMSetupUC naming that device\n\
         \x20 - the PC's firewall must let UDP port {port} in; on RobotWare 7 the controller's, too, for UDPUC\n\
         \x20 - a virtual controller of RobotWare 7 sends to 127.0.0.1 alone\n\
         \x20 - can the controller reach this PC? `ping` it from the other side\n",
        bind,
    )
}
