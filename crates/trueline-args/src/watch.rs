//! `trueline watch`.

use clap::Args;
use std::path::PathBuf;

#[derive(Args)]
#[command(after_help = "Examples:
  trueline watch --state cell.sqlite --calibration result.json weld-0001 weld-0002
  trueline watch --state cell.sqlite --calibration result.json weld-0003 --json -
  trueline watch --state cell.sqlite --calibration result.json --folder welds

Each weld is a recording with robot and seam points. From how it differs from what the calibration says, and from all welds
before, it is told whether the clock (timing), the bracket, the sensor or the fixture (seam) has changed, by how much and
since when, and what welds like these could not show. The usual scatter of the fixture is learnt from the first 30 pieces
of each part; nothing has to be typed. The limit is set for one false alarm in 100,000 pieces.

The state file keeps everything; it may be used by several programs at once, and a program that is killed loses no weld
that it has told of. A new calibration begins a new history in the same file.

Exit code: 0 nothing changed, 1 an alarm stands after the last weld, or was raised after one of these, 2 could not run.")]
pub struct WatchArgs {
    /// Welds in order of time: dataset folders, recording.mcap or rosbag2
    pub welds: Vec<PathBuf>,
    /// The cell's memory, an SQLite file; it is made where there is none
    #[arg(long)]
    pub state: PathBuf,
    /// The calibration in use: the JSON of `trueline calibrate --json`
    #[arg(long)]
    pub calibration: PathBuf,
    /// Watch a folder that fills: every weld that appears in it, in the order of their names, until interrupted
    #[arg(long, conflicts_with = "welds")]
    pub folder: Option<PathBuf>,
    /// With --folder: stop when all welds that are there have been watched
    #[arg(long, requires = "folder")]
    pub once: bool,
    /// Write one line of JSON for each weld; - is stdout
    #[arg(long)]
    pub json: Option<PathBuf>,
    /// Print no words but errors
    #[arg(long)]
    pub quiet: bool,
}
