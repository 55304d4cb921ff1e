//! `trueline history`.

use clap::Args;
use std::path::PathBuf;

#[derive(Args)]
#[command(after_help = "Examples:
  trueline history --state cell.sqlite --report history.html
  trueline history --state cell.sqlite --csv history.csv --parquet history.parquet

One row per weld: its own estimate of time offset, hand-eye and sensor, its noise, the changes that welds \
like it cannot detect, and the alarm active after it. Welds are numbered from 0 in the order in which the \
state stored them, as in `trueline watch`.

Exit code: 0 read, 2 could not run.")]
pub(crate) struct HistoryArgs {
    /// State file of the cell, written by `trueline watch`
    #[arg(long)]
    pub(crate) state: PathBuf,
    /// Number of the calibration [default: that of the last weld]
    #[arg(long)]
    pub(crate) calibration: Option<i64>,
    /// Number of last welds
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
