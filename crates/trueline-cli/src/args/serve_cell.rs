//! `trueline serve`.

use crate::args::serve::ServeArgs;
use clap::Args;
use std::path::PathBuf;

#[derive(Args)]
#[command(after_help = "Examples:
  trueline serve cell
  trueline serve cell --serve 192.168.1.7:8080 --serve-name cell-pc.example
  trueline serve cell --prefix /cells/7      # behind a proxy that shows it there

One address for a cell: the first scan step by step, with the command line of each step; what was recorded; the pages of `watch` for \
every .sqlite in the folder; the last welds; /metrics for Prometheus. The folder holds what the steps write: link.json, sensor.toml, \
cell.toml, plan, scans, result.json.

Without --serve the pages are at http://127.0.0.1:8080/, on this PC alone.

Read-only: no request starts a command, changes a file or reaches the robot. There is no password: put a proxy before it for one.

Exit code: 0 ended by Ctrl-C, 2 could not serve.")]
pub(crate) struct ServeCellArgs {
    /// The cell's folder
    pub(crate) cell: PathBuf,
    #[command(flatten)]
    pub(crate) serve: ServeArgs,
    /// The path under which a proxy shows the pages, for example /cells/7; the proxy may take it off or leave it
    #[arg(long, value_name = "/PATH", default_value = "", hide_default_value = true)]
    pub(crate) prefix: String,
    /// Print no address
    #[arg(long)]
    pub(crate) quiet: bool,
}
