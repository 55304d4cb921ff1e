//! `trueline simulate --production`.

use crate::args::choice::{Choice, one_of};
use crate::args::seam_scan_options::SEAM_SCAN_OPTIONS;
use clap::Args;
use trueline_sim::production::{Layout, ScheduledChange};

#[derive(Args)]
pub(crate) struct ProductionArgs {
    /// Number of welds of one part to write, up to 10,000: weld-0000 and on, each in its own folder in --out
    #[arg(long, value_name = "PIECES", value_parser = clap::value_parser!(u32).range(1..=10_000), conflicts_with_all = not_of_production())]
    pub(crate) production: Option<u32>,
    /// How the part is welded
    #[arg(long, value_parser = one_of(&LAYOUTS), default_value = "box-angles", requires = "production")]
    pub(crate) layout: Layout,
    /// Change from this piece on, counted from 0 (20.6 is after 60 % of piece 20): timing=MS@PIECE,
    /// bracket-x=MM@PIECE, bracket-turn-x=DEG@PIECE, sensor-width=PERCENT@PIECE, seam-x=MM@PIECE, …
    #[arg(long, value_name = "WHAT=AMOUNT@PIECE", requires = "production")]
    pub(crate) change: Option<ScheduledChange>,
}

/// Options that do not apply to a production: its layout has its own scans.
fn not_of_production() -> Vec<&'static str> {
    [&SEAM_SCAN_OPTIONS[..], &["time_offset_ms", "profile_look", "of_profiles_alone", "images"]].concat()
}

static LAYOUTS: [Choice<Layout>; 6] = [
    ("one-seam", "One straight seam of 300 mm, steady within 1°", Layout::OneSeam),
    ("box", "Four seams around a box", Layout::Box),
    ("box-weave", "The same with a weave of 3 mm at 2 Hz", Layout::BoxWeave),
    ("box-angles", "The same with work angles of 0, 10, -10 and 5° that swing by 5°", Layout::BoxAngles),
    ("box-good-fixture", "The same in a fixture that repeats within 0.05 mm", Layout::BoxGoodFixture),
    ("check-scan", "A scan of 5 s over a fixed edge", Layout::CheckScan),
];
