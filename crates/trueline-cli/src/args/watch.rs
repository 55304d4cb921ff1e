//! `trueline watch`.

use crate::args::number;
use crate::args::requirement::length_m;
use crate::args::serve::ServeArgs;
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
  trueline watch --state cell.sqlite --calibration result.json weld-0009 --tolerance 0.3mm
  trueline watch --state cell.sqlite --calibration result.json --repaired           # from the next weld on
  trueline watch --state cell.sqlite --also cell-2.sqlite --serve 8080          # only show

Each weld is a recording with robot and seam points. From how it differs from what the calibration says, and from all welds \
before, it is told whether the clock (timing), the bracket, the sensor or the fixture (seam) has changed, by how much and \
since when, and what welds like these could not show. The usual scatter of the fixture is learnt from the first 30 good pieces \
of each part; nothing has to be typed. The limit is set for one false alarm in 100,000 pieces. No change seen says nothing about what the \
welds are blind to: that is told once a shift (8 h), and when it changes.

An alarm says how far seam points sit off and what to do. It is told in full once, and then in one line a weld while it stands. It ends by \
itself when the welds are as calibrated again, mostly with the first good one. --repaired says that the fault was mended: the welds from there \
on are compared with the calibration and the good welds before the fault. --tolerance: a change that moves seam points by surely less \
is told, and is no alarm.

Welds are numbered from 0 in the order in which the state took them, across its calibrations, as `simulate --production` numbers \
its folders and `--change` its pieces; the name stands beside the number.

The state file keeps everything; it may be used by several programs at once, and a program that is killed loses no weld \
that it has told of. A new calibration begins a new history in the same file. What a weld takes there is about 1 KB: half a GB a year at one a minute.

--serve: state, trend and the last alarm with its evidence in the browser, and /metrics for Prometheus; read-only.
--tell: a message (JSON) when an alarm is raised, becomes another one, or is over. It is kept with the weld until the receiver \
has taken it, through dead networks and restarts; welds never wait for it.

Exit code: 0 no alarm stands after the last weld, 1 an alarm stands, 2 could not run."
)]
pub(crate) struct WatchArgs {
    /// Welds in order of time: dataset folders, recording.mcap or rosbag2
    pub(crate) welds: Vec<PathBuf>,
    /// The cell's memory, an SQLite file; it is made where there is none
    #[arg(long)]
    pub(crate) state: PathBuf,
    /// The calibration in use: the JSON of `trueline calibrate --json`
    #[arg(long, required_unless_present = "serve")]
    pub(crate) calibration: Option<PathBuf>,
    /// Watch a folder that fills: every weld that appears in it, in the order of their names, until interrupted
    #[arg(long, conflicts_with = "welds")]
    pub(crate) folder: Option<PathBuf>,
    /// With --folder: stop when all welds that are there have been watched
    #[arg(long, requires = "folder")]
    pub(crate) once: bool,
    /// Tell alarms to a web address (POST) or a topic of an MQTT broker: https://HOST/PATH, mqtt[s]://[USER@]HOST[:PORT]/TOPIC; behind the
    /// topic ?password-file=FILE or ?password-env=NAME, and for TLS &ca=FILE, the certificates to trust; may be repeated
    #[arg(long, value_name = "URL", requires = "calibration")]
    pub(crate) tell: Vec<String>,
    /// How far a change may move seam points without being an alarm: 0.3mm; it is told as changed-within-tolerance, exit 0
    #[arg(long, value_name = "LENGTH", value_parser = length_m, requires = "calibration")]
    pub(crate) tolerance: Option<f64>,
    /// The fault was mended before this weld, by its number, name or path [default: the next one]; the welds from there on tell
    #[arg(long, value_name = "WELD", num_args = 0..=1, default_missing_value = "", requires = "calibration")]
    pub(crate) repaired: Option<String>,
    /// Forget welds, but for the last 512 of each calibration, after so many days [default: never]
    #[arg(long, value_name = "DAYS", value_parser = number::days, requires = "calibration")]
    pub(crate) keep_days: Option<Duration>,
    #[command(flatten)]
    pub(crate) serve: ServeArgs,
    /// Show this cell as well, by its memory; may be repeated
    #[arg(long, value_name = "STATE", requires = "serve")]
    pub(crate) also: Vec<PathBuf>,
    /// Add one line of JSON for each weld to a file; what is in it stays; - is stdout
    #[arg(long)]
    pub(crate) json: Option<PathBuf>,
    /// Print no words but errors
    #[arg(long)]
    pub(crate) quiet: bool,
}
