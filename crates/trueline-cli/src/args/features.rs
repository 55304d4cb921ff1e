//! `trueline features`.

use crate::args::choice::{Choice, one_of};
use clap::Args;
use std::num::NonZeroUsize;
use std::path::PathBuf;
use trueline_vision::{Joint, StripeChoice};

#[derive(Args)]
#[command(after_help = "Examples:
  trueline features scan
  trueline features scan --joint lap --overlay looked-at
  trueline features scan --json - --quiet | jq .found

An existing features.csv is kept under another name.

The stripes on the joint's plates are written to stripes.csv as well.

Exit code: 0 features were written, 1 there is no seam in any picture or profile, 2 could not run.")]
pub(crate) struct FeaturesArgs {
    /// Dataset folder with sensor.toml and images/index.csv, profiles.csv or profiles.parquet
    pub(crate) dataset: PathBuf,
    /// Joint type
    #[arg(long, value_parser = one_of(&JOINTS), default_value = "auto")]
    pub(crate) joint: JointChoice,
    /// Region to search, px: U0,V0,U1,V1, or the corners U,V,U,V,… of a polygon [default: sensor.toml's region_of_interest]
    #[arg(long, value_name = "PX")]
    pub(crate) region: Option<String>,
    /// Which of several corners, grooves, gaps or ends to take: strongest, nearest, farthest, upper, lower, left or right
    #[arg(long, value_parser = stripe, default_value = "strongest")]
    pub(crate) stripe: StripeChoice,
    /// Without images/index.csv: the last number in each name counts the pictures at this rate, Hz; the index is written
    #[arg(long, value_name = "RATE", value_parser = rate, conflicts_with = "stamps_from_name")]
    pub(crate) fps: Option<f64>,
    /// Without images/index.csv: the last number in each name is its stamp in s, ms, us or ns, or a date in it; the index is written
    #[arg(long, value_name = "UNIT", value_parser = one_of(&STAMP_UNITS))]
    pub(crate) stamps_from_name: Option<i64>,
    /// Folder for pictures of the findings; it must not hold any yet
    #[arg(long)]
    pub(crate) overlay: Option<PathBuf>,
    /// Replace the folder of --overlay if it has trueline's files alone; it is kept as OVERLAY.replaced-1
    #[arg(long, requires = "overlay")]
    pub(crate) force: bool,
    /// Draw every n-th picture
    #[arg(long, default_value_t = NonZeroUsize::MIN, requires = "overlay")]
    pub(crate) overlay_every: NonZeroUsize,
    /// Threads; the default is one for each core
    #[arg(long)]
    pub(crate) threads: Option<NonZeroUsize>,
    /// Write the summary as JSON; - is stdout
    #[arg(long)]
    pub(crate) json: Option<PathBuf>,
    /// Write a report that opens in a browser
    #[arg(long)]
    pub(crate) report: Option<PathBuf>,
    /// Print no summary
    #[arg(long)]
    pub(crate) quiet: bool,
}

/// Units of stamps in names, ns.
pub(crate) static STAMP_UNITS: [Choice<i64>; 4] =
    [("s", "", 1_000_000_000), ("ms", "", 1_000_000), ("us", "", 1_000), ("ns", "", 1)];

fn rate(text: &str) -> Result<f64, String> {
    let rate = text.parse().ok().filter(|rate: &f64| rate.is_finite() && *rate > 0.0);
    rate.ok_or_else(|| "expected pictures a second, above 0".to_owned())
}

fn stripe(name: &str) -> Result<StripeChoice, String> {
    let names = StripeChoice::ALL.map(StripeChoice::name).join(", ");
    let found = StripeChoice::ALL.into_iter().find(|choice| choice.name() == name);
    found.ok_or_else(|| format!("expected one of {names}"))
}

/// A joint, or whatever most pictures show.
pub(crate) type JointChoice = Option<Joint>;

/// Joints that are looked for.
pub(crate) static JOINTS: [Choice<JointChoice>; 10] = [
    ("auto", "The joint that most pictures show", None),
    ("fillet", "Two plates at an angle: their corner", Some(Joint::Fillet)),
    ("lap", "A plate on a plate: the edge of the upper one", Some(Joint::Lap)),
    ("v-groove", "Bevelled plates: the bottom of the groove", Some(Joint::VGroove)),
    ("butt", "Two plates side by side: the middle of the gap", Some(Joint::Butt)),
    ("corner", "The outside corner of a block, where its faces meet", Some(Joint::Corner)),
    ("edge", "A plate or straightedge over nothing: where the stripe ends", Some(Joint::Edge)),
    ("step", "A step whose riser is lit: two lines, its edge (0) and its foot (1)", Some(Joint::Step)),
    (
        "groove",
        "A groove with lit faces and any root: two lines, its left shoulder (0) and its right one (1)",
        Some(Joint::Groove),
    ),
    (
        "v-block",
        "A V-block or a machined V: where its faces would meet, with or without a slot",
        Some(Joint::VBlock),
    ),
];
