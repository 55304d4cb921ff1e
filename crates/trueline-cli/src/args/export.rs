//! `trueline export`.

use clap::Args;
use clap::builder::PossibleValuesParser;
use std::path::PathBuf;
use trueline_report::export::FORMATS;
use trueline_report::export::axes::AXES;
use trueline_report::export::curves::CURVES;

/// Name of the sensor's frame where none is stated.
pub(crate) const DEFAULT_CHILD: &str = "laser";
/// Number of the tool where none is stated.
pub(crate) const DEFAULT_TOOL: u32 = 1;

#[derive(Args)]
#[command(after_help = "Examples:
  trueline export --list
  trueline export result.json --as kuka
  trueline export result.json --as urdf --parent tool0 --child laser > laser.urdf
  trueline export result.json --as kalibr --sensor scan/sensor.toml
  trueline export result.json --as curve-csv > seam.csv
  trueline export result.json --as axis-urdf > table.urdf

The text goes to stdout, its convention to stderr. All forms contain the \
same: the pose of the sensor in the frame whose pose the robot reported during \
the recording (the flange, or the active tool). The forms curve-… \
write the curve of a curved seam in the robot's base instead, and the forms \
axis-… each external axis.

Exit code: 0 written, 1 written although the result was not accepted, 2 could \
not be written.")]
pub(crate) struct ExportArgs {
    /// The JSON of `trueline calibrate --json`, or a TOML like initial.toml
    #[arg(required_unless_present = "list")]
    pub(crate) result: Option<PathBuf>,
    /// Form of the transform, or of the curve: see --list
    #[arg(long = "as", value_name = "NAME", required_unless_present = "list", hide_possible_values = true,
          value_parser = PossibleValuesParser::new(names()))]
    pub(crate) form: Option<String>,
    /// List all forms
    #[arg(long)]
    pub(crate) list: bool,
    /// Name of the frame that the sensor is mounted on [default: flange, or base for a sensor beside the robot]
    #[arg(long)]
    pub(crate) parent: Option<String>,
    /// Name of the sensor's frame
    #[arg(long, default_value = DEFAULT_CHILD)]
    pub(crate) child: String,
    /// Number of the tool on controllers that number them
    #[arg(long, default_value_t = DEFAULT_TOOL)]
    pub(crate) tool_number: u32,
    /// sensor.toml, for forms that describe the camera
    #[arg(long)]
    pub(crate) sensor: Option<PathBuf>,
    /// Print no words
    #[arg(long)]
    pub(crate) quiet: bool,
}

fn names() -> Vec<&'static str> {
    FORMATS
        .iter()
        .flat_map(|format| std::iter::once(format.name).chain(format.aliases.iter().copied()))
        .chain(CURVES.iter().map(|form| form.name))
        .chain(AXES.iter().map(|form| form.name))
        .collect()
}
