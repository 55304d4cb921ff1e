//! `trueline watch`.

use crate::args::foxglove::FoxgloveArgs;
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

Each weld is a recording with robot and seam points. It is compared with the calibration and with all \
earlier welds. The report names what has changed, by how much and since when: the clock (timing), the \
bracket, the sensor or the fixture (seam). The usual scatter of the fixture is learnt from the first 30 good \
pieces of each part, without settings. The limit is set for one false alarm in 100,000 pieces. Some welds \
are blind to some changes: these are listed once per shift (8 h), and when the list changes.

An alarm states the displacement of seam points and the remedy. It is reported in full once, and then in one \
line per weld while it is active. It clears when the welds agree with the calibration again, usually with \
the first good one. --repaired reports a repair: the welds from there on are compared with the calibration \
and the good welds before the fault. --tolerance: a change that certainly moves seam points by less is \
reported, without an alarm.

Welds are numbered from 0 in the order in which the state stored them, across its calibrations, as `simulate \
--production` numbers its folders and `--change` its pieces; the name follows the number.

The state file stores everything. Several programs may use it at once, and a killed program loses no \
reported weld. A new calibration begins a new history in the same file. A weld takes about 1 KB: 0.5 GB a \
year at one per minute.

--serve: state, trend and the last alarm with its evidence in the browser, and /metrics for Prometheus; read-only.
--tell: a JSON message when an alarm is raised, changes or clears. It is stored with the weld until the \
receiver has accepted it, through network failures and restarts; welds never wait for it.

Exit code: 0 no alarm after the last weld, 1 an alarm is active, 2 could not run."
)]
pub(crate) struct WatchArgs {
    /// Welds in order of time: dataset folders, recording.mcap or rosbag2
    pub(crate) welds: Vec<PathBuf>,
    /// State file of the cell (SQLite); created if missing
    #[arg(long)]
    pub(crate) state: PathBuf,
    /// The calibration in use: the JSON of `trueline calibrate --json`
    #[arg(long, required_unless_present = "serve")]
    pub(crate) calibration: Option<PathBuf>,
    /// Watch every weld that appears in this folder, in the order of names, until interrupted
    #[arg(long, conflicts_with = "welds")]
    pub(crate) folder: Option<PathBuf>,
    /// With --folder: stop when all present welds have been watched
    #[arg(long, requires = "folder")]
    pub(crate) once: bool,
    /// Send alarms to a web address (POST) or a topic of an MQTT broker: https://HOST/PATH,
    /// mqtt[s]://[USER@]HOST[:PORT]/TOPIC; behind the topic ?password-file=FILE or ?password-env=NAME, and for TLS
    /// &ca=FILE, the certificates to trust; may be repeated
    #[arg(long, value_name = "URL", requires = "calibration")]
    pub(crate) tell: Vec<String>,
    /// Displacement of seam points below which a change is no alarm: 0.3mm; it is reported as changed-within-tolerance, exit 0
    #[arg(long, value_name = "LENGTH", value_parser = length_m, requires = "calibration")]
    pub(crate) tolerance: Option<f64>,
    /// The fault was repaired before this weld, by its number, name or path [default: the next one]; later welds verify it
    #[arg(long, value_name = "WELD", num_args = 0..=1, default_missing_value = "", requires = "calibration")]
    pub(crate) repaired: Option<String>,
    /// Delete welds after this number of days, except the last 512 of each calibration [default: never]
    #[arg(long, value_name = "DAYS", value_parser = number::days, requires = "calibration")]
    pub(crate) keep_days: Option<Duration>,
    #[command(flatten)]
    pub(crate) serve: ServeArgs,
    #[command(flatten)]
    pub(crate) foxglove: FoxgloveArgs,
    /// Show this cell too, by its state file; may be repeated
    #[arg(long, value_name = "STATE", requires = "serve")]
    pub(crate) also: Vec<PathBuf>,
    /// Append one line of JSON per weld to a file; - is stdout
    #[arg(long)]
    pub(crate) json: Option<PathBuf>,
    /// Print nothing but errors
    #[arg(long)]
    pub(crate) quiet: bool,
}
