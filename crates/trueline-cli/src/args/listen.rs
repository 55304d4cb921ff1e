//! `trueline listen`.

use clap::Args;
use std::net::{IpAddr, SocketAddr};
use std::path::PathBuf;

#[derive(Args)]
#[command(after_help = "Examples:
  trueline listen --bind 192.168.125.10:6510
  trueline listen --bind 127.0.0.1:6510 --for-s 60 --json link.json

The controller speaks first: its UDPUC device must have this PC as remote address, and its program must run.
Nothing is ever sent. Exit code: 0 a robot was heard, 1 none was, 2 could not listen.")]
pub struct ListenArgs {
    /// Address of this PC and port to listen at, for example 192.168.125.10:6510
    #[arg(long, value_name = "IP:PORT")]
    pub bind: SocketAddr,
    /// The robot's address; without it, whoever first sends a good frame
    #[arg(long, value_name = "IP")]
    pub robot: Option<IpAddr>,
    /// How long, s; Ctrl-C ends it earlier
    #[arg(long, default_value_t = 5.0)]
    pub for_s: f64,
    /// Write what was heard as JSON; - is stdout
    #[arg(long)]
    pub json: Option<PathBuf>,
    /// Print no summary
    #[arg(long)]
    pub quiet: bool,
}
