//! `trueline watch`.

use crate::number;
use crate::serve::ServeArgs;
use clap::Args;
use std::path::PathBuf;
use std::time::Duration;

#[derive(Args)]
#[command(
    override_usage = "trueline watch [OPTIONS] --state <STATE> --calibration <CALIBRATION> <WELDS>...
       trueline watch [OPTIONS] --state <STATE> --calibration <CALIBRATION> --folder <FOLDER>
       trueline watch --state <STATE> --serve <[IP:]PORT>",
    after_help = "Examples:
  trueline watch --state cell.sqlite --calibration result.json weld-0001 weld-0002
  trueline watch --state cell.sqlite --calibration result.json weld-0003 --json -
  trueline watch --state cell.sqlite --calibration result.json --folder welds --serve 8080
  trueline watch --state cell.sqlite --calibration result.json --folder welds --tell https://chat.example/hook
  trueline watch --state cell.sqlite --also cell-2.sqlite --serve 8080          # only show

Each weld is a recording with robot and seam points. From how it differs from what the calibration says, and from all welds \
before, it is told whether the clock (timing), the bracket, the sensor or the fixture (seam) has changed, by how much and \
since when, and what welds like these could not show. The usual scatter of the fixture is learnt from the first 30 pieces \
of each part; nothing has to be typed. The limit is set for one false alarm in 100,000 pieces. No change seen is said with what \
the welds are blind to: a change of that kind may be there.

An alarm is told in full once, and then in one line a weld while it stands. Where it began inside of a weld, that weld says nothing of \
its size. Welds are numbered from 0 in the order in which the state took them, across its calibrations, as `simulate --production` numbers \
its folders and `--change` its pieces; the name stands beside the number.

The state file keeps everything; it may be used by several programs at once, and a program that is killed loses no weld \
that it has told of. A new calibration begins a new history in the same file. What a weld takes there is about 1 KB: half a GB a year at one a minute.

--serve: state, trend and the last alarm with its evidence in the browser, and /metrics for Prometheus; read-only.
--tell: a message (JSON) when an alarm is raised, becomes another one, or is over. It is kept with the weld until the receiver \
has taken it, through dead networks and restarts; welds never wait for it.

Exit code: 0 no alarm stands after the last weld, 1 an alarm stands, 2 could not run."
)]
pub struct WatchArgs {
    /// Welds in order of time: dataset folders, recording.mcap or rosbag2
    pub welds: Vec<PathBuf>,
    /// The cell's memory, an SQLite file; it is made where there is none
    #[arg(long)]
    pub state: PathBuf,
    /// The calibration in use: the JSON of `trueline calibrate --json`
    #[arg(long, required_unless_present = "serve")]
    pub calibration: Option<PathBuf>,
    /// Watch a folder that fills: every weld that appears in it, in the order of their names, until interrupted
    #[arg(long, conflicts_with = "welds")]
    pub folder: Option<PathBuf>,
    /// With --folder: stop when all welds that are there have been watched
    #[arg(long, requires = "folder")]
    pub once: bool,
    /// Tell alarms to a web address (POST) or a topic of an MQTT broker: https://HOST/PATH, mqtt://HOST:PORT/TOPIC; may be repeated
    #[arg(long, value_name = "URL", requires = "calibration")]
    pub tell: Vec<String>,
    /// Forget welds, but for the last 512 of each calibration, after so many days [default: never]
    #[arg(long, value_name = "DAYS", value_parser = number::days, requires = "calibration")]
    pub keep_days: Option<Duration>,
    #[command(flatten)]
    pub serve: ServeArgs,
    /// Show this cell as well, by its memory; may be repeated
    #[arg(long, value_name = "STATE", requires = "serve")]
    pub also: Vec<PathBuf>,
    /// Add one line of JSON for each weld to a file; what is in it stays; - is stdout
    #[arg(long)]
    pub json: Option<PathBuf>,
    /// Print no words but errors
    #[arg(long)]
    pub quiet: bool,
}
