//! `trueline listen`.

use crate::args::number;
use crate::args::protocol::LinkArgs;
use clap::Args;
use std::path::PathBuf;
use std::time::Duration;

#[derive(Args)]
#[command(after_help = "Examples:
  trueline listen --bind 192.168.125.10:6510
  trueline listen --bind 127.0.0.1:6510 --for-s 60 --json link.json
  trueline listen --protocol ur-rtde --robot 192.168.0.10
  trueline listen --protocol kuka-rsi --bind 192.168.1.10:49152

An ABB controller speaks first: its UDPUC device must have this PC as remote address, and its program must run. What to set \
on the others: the book's page Live. Nothing that is sent can move a robot.

Exit code: 0 a robot was heard, 1 none was, 2 could not listen.")]
pub(crate) struct ListenArgs {
    #[command(flatten)]
    pub(crate) link: LinkArgs,
    /// How long, s; Ctrl-C ends it earlier
    #[arg(long, default_value = "5", value_parser = number::duration)]
    pub(crate) for_s: Duration,
    /// Write the received stream as JSON; - is stdout
    #[arg(long)]
    pub(crate) json: Option<PathBuf>,
    /// Print no summary
    #[arg(long)]
    pub(crate) quiet: bool,
}
