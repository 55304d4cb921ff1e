//! `trueline-testbench stream-sim`.

use crate::args::choice::one_of;
use crate::args::number;
use crate::args::protocol::PROTOCOLS;
use crate::args::wiring::WiringArgs;
use clap::Args;
use std::net::SocketAddr;
use std::path::PathBuf;
use trueline_live::controller::NetworkSettings;
use trueline_live::pose_feed::PoseFeed;
use trueline_live::protocol::read_ethernet_config;
use trueline_live::stream_sim::StreamSim;
use trueline_live::{LinkError, Protocol};

#[derive(Args)]
#[command(after_help = "Examples:
  trueline-testbench stream-sim --protocol ur-rtde --listen 127.0.0.1:30004 --path plan
  trueline-testbench stream-sim --protocol fanuc-stream-motion --listen 127.0.0.1:60015 --version-of 4
  trueline-testbench stream-sim --protocol fanuc-hspo --pc 127.0.0.1:15000 --loss 0.01 --burst 5
  trueline-testbench stream-sim --protocol kuka-rsi --pc 127.0.0.1:49152 --period-ms 12

Its own program moves it along the path; nothing that it is sent does. EGM is `trueline-testbench robot-sim`'s.")]
pub(crate) struct StreamSimArgs {
    /// Protocol (not egm)
    #[arg(long, value_parser = one_of(&PROTOCOLS))]
    pub(crate) protocol: Protocol,
    /// Address of the controller: ur-rtde and fanuc-stream-motion
    #[arg(long, value_name = "IP:PORT")]
    pub(crate) listen: Option<SocketAddr>,
    /// Address of the PC: fanuc-hspo and kuka-rsi
    #[arg(long, value_name = "IP:PORT")]
    pub(crate) pc: Option<SocketAddr>,
    /// A plan's folder or a robot.csv [default: a small S]
    #[arg(long)]
    pub(crate) path: Option<PathBuf>,
    /// Rest before and after the path, s
    #[arg(long, default_value_t = 2.0, value_parser = number::rest_s)]
    pub(crate) rest_s: f64,
    /// How long, s [default: as long as path and rests]
    #[arg(long, value_parser = number::seconds)]
    pub(crate) for_s: Option<f64>,
    /// Version of the protocol: RTDE 1 or 2 [default: 2], Stream Motion 1 to 4 [default: 3]
    #[arg(long, value_name = "VERSION")]
    pub(crate) version_of: Option<u32>,
    /// Time between messages, ms [default: 8 of FANUC, 4 of KUKA]; RTDE's clients choose
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub(crate) period_ms: Option<u32>,
    /// How much the controller's clock runs fast, parts per million
    #[arg(long, default_value_t = 20.0, value_parser = number::drift_ppm)]
    pub(crate) drift_ppm: f64,
    /// Share of datagrams that is lost
    #[arg(long, value_parser = number::share)]
    pub(crate) loss: Option<f64>,
    /// Mean number of datagrams lost in a row
    #[arg(long, requires = "loss", value_parser = number::burst)]
    pub(crate) burst: Option<f64>,
    #[command(flatten)]
    pub(crate) wiring: WiringArgs,
    /// kuka-rsi: await answers, by this Ethernet configuration; after 100 that are missing in a row the robot stops
    #[arg(long, value_name = "ETHERNET.xml")]
    pub(crate) await_answers: Option<PathBuf>,
    /// Seed of the losses
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    /// Print nothing but errors
    #[arg(long)]
    pub(crate) quiet: bool,
}

impl StreamSimArgs {
    /// The controller at an address, of a robot that moves so.
    ///
    /// # Errors
    /// Answers that this robot does not await, or an Ethernet configuration that cannot be read.
    pub(crate) fn sim(&self, address: SocketAddr, feed: PoseFeed) -> Result<StreamSim, LinkError> {
        let awaits = self.await_answers.as_deref().map(read_ethernet_config).transpose()?;
        if awaits.is_some() && self.protocol != Protocol::KukaRsi {
            return Err(LinkError::AnswerNotNeeded);
        }
        let (loss, burst) = (self.loss.unwrap_or(0.0), self.burst.unwrap_or(1.0));
        Ok(StreamSim {
            protocol: self.protocol,
            address,
            feed,
            version: self.version_of,
            period_ms: self.period_ms,
            drift_ppm: self.drift_ppm,
            network: NetworkSettings { loss, burst, ..NetworkSettings::none() },
            seed: self.seed,
            wiring: self.wiring.settings(),
            awaits,
        })
    }
}
