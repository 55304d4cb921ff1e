//! `trueline import csv`.

use crate::args::choice::one_of;
use crate::args::features::STAMP_UNITS;
use crate::args::new_folder::NewFolder;
use crate::args::number::above_zero;
use clap::Args;
use clap::builder::PossibleValuesParser;
use std::path::PathBuf;
use trueline_dataset::dialect::Separator;
use trueline_dataset::import::axis_columns::AxisColumn;
use trueline_dataset::import::foreign_csv::ColumnMapping;
use trueline_dataset::import::profiles::ProfileFormat;
use trueline_dataset::import::robot_layout::RobotLayout;
use trueline_geometry::EulerSequence;

#[derive(Args)]
#[command(after_help = "Examples:
  trueline import csv logs --robot kuka --out scan
  trueline import csv logs --robot kuka --profiles scan.csv --profile-format keyence-lj-x \
      --x-start-mm -8 --x-step-mm 0.0125 --profile-start-s 1.5 --profile-rate-hz 200 --out scan
  trueline import csv logs --robot ur --sensor sensor.toml --out scan
  trueline import csv logs --robot-map time_ms=stamp,x_mm=pos_x --out scan
  trueline import csv logs --robot kuka --columns t,X,Y,Z,A,B,C --out scan
  trueline import csv logs --robot kuka --axis table_deg=E1 --out scan
  trueline import csv logs --euler zyz-intrinsic --robot-map e1_deg=O,e2_deg=A,e3_deg=T --out scan

Separators (comma, semicolon, tab, blanks), decimal commas, UTF-16 and a byte \
order mark are recognised, as are lines before the table, names behind a # and a \
row of units; the recognised format is reported. The column of time is time_s (or _ms, \
_us, _ns), t in seconds, or any time, timestamp or Zeit: its unit in the header, \
clock times like 14:03:12.345 and dates are read; the unit of a number without one is derived from its \
steps. A file without names: --columns.

--robot names the maker, and with it units and the meaning of the angles; \
`trueline import csv --list-robots` lists them with their columns. A pose in one \
cell (p[…] of UR, {X …} of KUKA, [[…],[…]] of ABB) and a log of KUKA's RSI in XML \
are read as well. A unit in the header, as in `X [m]`, counts before the maker's. \
The pose must be that of one tool all along: the flange, or the tool that was active.

SRC/images with images/index.csv (time_s,file) is imported if there are neither features nor profiles; without an index --fps or --stamps-from-name gives the stamps.

Profiles (--profile-format):
  gocator       LMI Gocator's CSV; its stamps are used
  gopxl         a logger's rows of x0, z0, x1, z1, …; timestamp in us
  keyence-lj-v  TSV of the maker's sample program: X, then a column a profile
  keyence-lj-x  a row a profile, mm; give --x-start-mm and --x-step-mm; a counter
                or a time before the heights is recognised
  scancontrol   ASC: a row a point, x and z in mm
  wenglor       a row a profile, mm, 0 is no point
  ply           ascii or binary, x and z in mm
  rows, points  any program: a row a profile, or a row a point, mm
Without stamps in the file: --profile-start-s and --profile-rate-hz, or
--profile-times (with --profile-rate-hz, if it has one stamp per block of profiles). The seam is detected \
    when the dataset is calibrated.

A mapping is ours=theirs; our name contains the unit. Columns without a mapping keep their names.")]
pub(crate) struct ImportCsvArgs {
    /// Folder with the files
    #[arg(value_parser = folder, required = true)]
    pub(crate) src: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) folder: Option<NewFolder>,
    /// List the makers of robots with their columns, units and order of the angles
    #[arg(long, exclusive = true)]
    pub(crate) list_robots: bool,
    /// Maker of the robot: units and meaning of the columns
    #[arg(long, value_name = "NAME", value_parser = PossibleValuesParser::new(RobotLayout::names()))]
    pub(crate) robot: Option<String>,
    /// Sequence of the angles A B C, Rx Ry Rz or e1 e2 e3: zyx-intrinsic, xyz-fixed, …
    #[arg(long, value_name = "SEQUENCE")]
    pub(crate) euler: Option<EulerSequence>,
    /// Robot poses, looked up in SRC
    #[arg(long, default_value = "robot.csv")]
    pub(crate) robot_file: PathBuf,
    /// Names of the robot file's columns in their order, where it has none; - is not used
    #[arg(long, value_name = "NAMES", value_delimiter = ',', alias = "robot-columns")]
    pub(crate) columns: Vec<String>,
    /// The same of the features
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub(crate) features_columns: Vec<String>,
    /// Lines at the beginning of the robot file that are no part of its table
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(crate) robot_skip_lines: usize,
    /// Rows of the robot file a second, where it has no time
    #[arg(long, value_name = "HZ", value_parser = above_zero)]
    pub(crate) robot_rate_hz: Option<f64>,
    /// Stamp of its first row, s [default: 0]
    #[arg(long, value_name = "S", requires = "robot_rate_hz", allow_negative_numbers = true)]
    pub(crate) robot_start_s: Option<f64>,
    /// Features, looked up in SRC
    #[arg(long, default_value = "features.csv")]
    pub(crate) features: PathBuf,
    /// Without SRC/images/index.csv: the last number in each name counts the pictures at this rate, Hz
    #[arg(long, value_name = "RATE", value_parser = above_zero, conflicts_with = "stamps_from_name")]
    pub(crate) fps: Option<f64>,
    /// Without SRC/images/index.csv: the last number in each name is its stamp in s, ms, us or ns, or a date in it
    #[arg(long, value_name = "UNIT", value_parser = one_of(&STAMP_UNITS))]
    pub(crate) stamps_from_name: Option<i64>,
    /// Whole profiles instead of features, looked up in SRC [default: profiles.csv, if there are no features]
    #[arg(long, conflicts_with = "features")]
    pub(crate) profiles: Option<PathBuf>,
    /// Format of the profiles [default: profiles.csv, long or wide, Gocator and PLY are recognised]
    #[arg(long, value_name = "NAME", value_parser = PossibleValuesParser::new(ProfileFormat::ALL.map(|(name, _)| name)))]
    pub(crate) profile_format: Option<String>,
    /// Profiles a second, where the file has no stamps
    #[arg(long, value_name = "HZ", value_parser = above_zero)]
    pub(crate) profile_rate_hz: Option<f64>,
    /// Stamp of the first profile: seconds, a clock time or a date
    #[arg(long, value_name = "S", requires = "profile_rate_hz", allow_hyphen_values = true)]
    pub(crate) profile_start_s: Option<String>,
    /// File with one stamp for each profile, one a line (s, clock times, dates, or a unit in its first line: time_ms); looked up in SRC
    #[arg(long, value_name = "FILE", conflicts_with = "profile_start_s")]
    pub(crate) profile_times: Option<PathBuf>,
    /// Position of the first height of a row along the stripe, mm
    #[arg(long, value_name = "MM", requires = "x_step_mm", allow_negative_numbers = true)]
    pub(crate) x_start_mm: Option<f64>,
    /// Distance of two heights along the stripe, mm
    #[arg(long, value_name = "MM", requires = "x_start_mm", allow_negative_numbers = true)]
    pub(crate) x_step_mm: Option<f64>,
    /// Range of profiles that stands for no return, mm: such points are left out
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    pub(crate) no_return_mm: Option<f64>,
    /// Sensor, looked up in SRC and then in the current folder: sensor.toml, or the YAML of a camera by OpenCV, ROS or Kalibr
    #[arg(long, default_value = "sensor.toml")]
    pub(crate) sensor: PathBuf,
    /// Columns of the robot file, ours=theirs
    #[arg(long, value_delimiter = ',', value_parser = mapping)]
    pub(crate) robot_map: Vec<ColumnMapping>,
    /// Columns of the feature file, ours=theirs
    #[arg(long, value_delimiter = ',', value_parser = mapping)]
    pub(crate) features_map: Vec<ColumnMapping>,
    /// An external axis in a column of the robot file: table_deg=E1, track_mm=E2,robot; may be repeated, in the order of the chain
    #[arg(
        long = "axis",
        value_name = "NAME=COLUMN",
        long_help = "An external axis in a column of the robot file: table_deg=E1, track_mm=E2,robot; may be repeated, in the order of the chain. \
                     The unit stands in our name or in theirs. What it carries follows a comma: part, robot or sensor; a cell.toml beside \
                     the robot file may state it instead. Written to axes.csv and cell.toml"
    )]
    pub(crate) axes: Vec<AxisColumn>,
    /// Robot and sensor were stamped by unrelated clocks: estimate the shift between them
    #[arg(long)]
    pub(crate) align_clocks: bool,
    /// Character between columns, or tab, or blanks [default: recognised]
    #[arg(long, value_parser = separator)]
    pub(crate) delimiter: Option<Separator>,
}

fn mapping(item: &str) -> Result<ColumnMapping, String> {
    match item.split_once('=') {
        Some((ours, theirs)) if !ours.is_empty() && !theirs.is_empty() => {
            Ok(ColumnMapping { ours: ours.trim().to_owned(), theirs: theirs.trim().to_owned() })
        }
        _ => Err("write ours=theirs, for example x_mm=pos_x".to_owned()),
    }
}

fn folder(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    if path.is_file() {
        return Err("it is a file: give its folder, and its name as --robot-file or --profiles".to_owned());
    }
    Ok(path)
}

fn separator(text: &str) -> Result<Separator, String> {
    match text {
        "tab" | "\\t" => Ok(Separator::Character('\t')),
        "blanks" | " " => Ok(Separator::Blanks),
        _ => match text.chars().collect::<Vec<_>>()[..] {
            [one] => Ok(Separator::Character(one)),
            _ => Err("expected one character, tab or blanks".to_owned()),
        },
    }
}
