//! `trueline stream-sim`.

use super::robot_sim;
use crate::args::{ProtocolName, StreamSimArgs};
use crate::failure::Failure;
use crate::{interrupt, output};
use std::net::{SocketAddr, UdpSocket};
use std::ops::ControlFlow;
use std::process::ExitCode;
use std::time::Duration;
use trueline_live::controller::{Network, NetworkSettings};
use trueline_live::fanuc::stream_motion_sim::StreamMotionController;
use trueline_live::pose_feed::PoseFeed;
use trueline_live::udp_sim::{Speech, UdpRobot};
use trueline_live::ur::{RtdeServer, ServerSettings};

/// First and last value of R-30iB's µs counter, as users met it.
const HSPO_COUNTER_US: (u32, u32) = (0, 129_000_000);
/// An IPOC as controllers have it after some weeks.
const IPOC: u64 = 4_208_163_634;
/// Clients of RTDE take a controller that runs for less than 40 s for one that is booting.
const UR_EPOCH_S: f64 = 100.0;

/// Runs the command.
pub fn run(args: &StreamSimArgs) -> Result<ExitCode, Failure> {
    let network = check(args)?;
    interrupt::watch()?;
    let feed = PoseFeed::new(robot_sim::path(args.path.as_deref())?, args.rest_s);
    let duration = Duration::from_secs_f64(args.for_s.unwrap_or(feed.duration_s()));
    let goes_on = |passed: Duration| match passed >= duration || interrupt::times() > 0 {
        true => ControlFlow::Break(()),
        false => ControlFlow::Continue(()),
    };
    let summary = match args.protocol {
        ProtocolName::UrRtde => {
            let address = listening(args)?;
            let version = args.version_of.unwrap_or(2) as u16;
            let settings = ServerSettings { feed, epoch_s: UR_EPOCH_S, drift_ppm: args.drift_ppm, version };
            let mut server = RtdeServer::bind(address, settings).map_err(|error| cannot(address, &error))?;
            server.run(|_, passed| goes_on(passed)).map_err(|error| cannot(address, &error))?;
            format!("{} packages of data sent", server.sent())
        }
        _ => datagrams(args, feed, network, goes_on)?,
    };
    if !args.quiet {
        output::words(&summary);
    }
    Ok(ExitCode::SUCCESS)
}

fn datagrams(
    args: &StreamSimArgs,
    feed: PoseFeed,
    network: NetworkSettings,
    goes_on: impl Fn(Duration) -> ControlFlow<()>,
) -> Result<String, Failure> {
    let (speech, usual_ms) = match args.protocol {
        ProtocolName::KukaRsi => (Speech::Rsi { begins: IPOC }, 4),
        ProtocolName::FanucStreamMotion => {
            let (version, period_ms) = (args.version_of.unwrap_or(3), args.period_ms.unwrap_or(8));
            (Speech::StreamMotion(StreamMotionController::new(version, period_ms)), 8)
        }
        _ => (Speech::Hspo { begins_us: HSPO_COUNTER_US.0, wraps_us: HSPO_COUNTER_US.1 }, 8),
    };
    let (address, pc) = match args.protocol.controllers_port() {
        Some(_) => (listening(args)?, None),
        None => {
            let pc = calling(args)?;
            let any = if pc.ip().is_loopback() { pc.ip() } else { [0; 4].into() };
            (SocketAddr::new(any, 0), Some(pc))
        }
    };
    let socket = UdpSocket::bind(address).map_err(|error| cannot(address, &error))?;
    let mut robot = UdpRobot {
        speech,
        feed,
        period_ms: args.period_ms.unwrap_or(usual_ms),
        drift_ppm: args.drift_ppm,
        network: Network::new(network, args.seed),
    };
    let sent =
        robot.run(&socket, pc, |_, passed| goes_on(passed)).map_err(|error| cannot(address, &error))?;
    let mut text = format!(
        "{} cycles, {} datagrams sent, {} lost on purpose, {} received",
        sent.cycles,
        sent.datagrams,
        robot.network.lost(),
        sent.received
    );
    if let Speech::StreamMotion(controller) = &robot.speech {
        let (refused, commands) = controller.counts();
        text.push_str(&format!("; {refused} of them refused, {commands} commands of motion not followed"));
    }
    Ok(text)
}

fn check(args: &StreamSimArgs) -> Result<NetworkSettings, Failure> {
    let bad = |what: &str| Failure::new(what.to_owned(), "`trueline stream-sim --help` explains it");
    let versions = match args.protocol {
        ProtocolName::Egm => {
            return Err(Failure::new(
                "--protocol egm: a robot that speaks EGM is another command",
                "trueline robot-sim",
            ));
        }
        ProtocolName::UrRtde => 1..=2,
        ProtocolName::FanucStreamMotion => 1..=4,
        ProtocolName::FanucHspo | ProtocolName::KukaRsi => 0..=0,
    };
    if args.version_of.is_some_and(|version| !versions.contains(&version) || version == 0) {
        return Err(bad("--version-of: RTDE has 1 and 2, Stream Motion 1 to 4, the others none"));
    }
    if args.protocol == ProtocolName::UrRtde && (args.period_ms.is_some() || args.loss.is_some()) {
        return Err(bad("--period-ms, --loss: RTDE's clients choose the rate, and TCP loses nothing"));
    }
    if args.period_ms.is_some_and(|period_ms| !(1..=1000).contains(&period_ms)) {
        return Err(bad("--period-ms: expected 1 to 1000"));
    }
    let (loss, burst) = (args.loss.unwrap_or(0.0), args.burst.unwrap_or(1.0));
    if !(0.0..=1.0).contains(&loss) || !(1.0..1e4).contains(&burst) {
        return Err(bad("--loss: expected a share from 0 to 1; --burst: 1 to 10 000"));
    }
    let seconds = [args.rest_s, args.for_s.unwrap_or(1.0)];
    if seconds.iter().any(|s| !(0.0..1e6).contains(s)) || !(-1e5..=1e5).contains(&args.drift_ppm) {
        return Err(bad("--rest-s, --for-s: seconds of 0 or more; --drift-ppm: -100 000 to 100 000"));
    }
    Ok(NetworkSettings { loss, burst, ..NetworkSettings::none() })
}

fn listening(args: &StreamSimArgs) -> Result<SocketAddr, Failure> {
    match (args.listen, args.pc) {
        (Some(address), None) => Ok(address),
        _ => Err(Failure::new(
            "--listen IP:PORT is needed, and --pc is not: PCs call this controller",
            "for example --listen 127.0.0.1:30004",
        )),
    }
}

fn calling(args: &StreamSimArgs) -> Result<SocketAddr, Failure> {
    match (args.listen, args.pc) {
        (None, Some(pc)) => Ok(pc),
        _ => Err(Failure::new(
            "--pc IP:PORT is needed, and --listen is not: this controller speaks first",
            "for example --pc 127.0.0.1:49152",
        )),
    }
}

fn cannot(address: SocketAddr, error: &std::io::Error) -> Failure {
    Failure::new(format!("{address}: {error}"), "it is an address of this PC, with a port that is free")
}
