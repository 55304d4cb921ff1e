//! `trueline history`.

use clap::Args;
use std::path::PathBuf;

#[derive(Args)]
#[command(after_help = "Examples:
  trueline history --state cell.sqlite --report history.html
  trueline history --state cell.sqlite --csv history.csv --parquet history.parquet

One row a weld: what it says of time offset, hand-eye and sensor by itself, its noise, what welds like it are blind to, and the alarm \
that stood after it. Welds are numbered from 0 in the order in which the state took them, as `trueline watch` says them.

Exit code: 0 read, 2 could not run.")]
pub(crate) struct HistoryArgs {
    /// The cell's memory, as `trueline watch` keeps it
    #[arg(long)]
    pub(crate) state: PathBuf,
    /// Number of the calibration; else that of the last weld
    #[arg(long)]
    pub(crate) calibration: Option<i64>,
    /// The last so many welds
    #[arg(long, default_value_t = 10_000)]
    pub(crate) last: usize,
    /// Write a table; - is stdout
    #[arg(long)]
    pub(crate) csv: Option<PathBuf>,
    /// Write the same table as a Parquet file
    #[arg(long, value_name = "FILE")]
    pub(crate) parquet: Option<PathBuf>,
    /// Write a page with control charts that opens in a browser
    #[arg(long)]
    pub(crate) report: Option<PathBuf>,
    /// Print no summary
    #[arg(long)]
    pub(crate) quiet: bool,
}
