//! `trueline simulate --shop`.

use crate::args::choice::{Choice, one_of};
use crate::args::seam_scan_options::SEAM_SCAN_OPTIONS;
use clap::Args;
use trueline_sim::shop::{ErrorRow, Level, Shop, ShopError, TABLE};

#[derive(Args)]
#[group(id = "of_shops")]
#[command(next_help_heading = "A whole cell with all errors of a shop (instead of a preset)")]
pub(crate) struct ShopArgs {
    /// Write such a cell, and a check pass in OUT/check: readings without noise, with their true places in truth.json. The seed
    /// draws arm, sensor, seam, motion and errors. With --plates a camera or a profiler measures whole stripes as well
    #[arg(long, value_name = "LEVEL", value_parser = one_of(&LEVELS), conflicts_with_all = not_of_shops())]
    pub(crate) shop: Option<Level>,
    /// Keep only these errors, in their size in this cell; `none` keeps none (--help lists them)
    #[arg(long, value_name = "ERROR[,ERROR]", value_parser = only, requires = "shop")]
    pub(crate) only: Option<OnlyErrors>,
}

/// The errors that are kept.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct OnlyErrors(pub Vec<ShopError>);

/// Options that do not apply to a shop: it draws its own scans.
fn not_of_shops() -> Vec<&'static str> {
    [&SEAM_SCAN_OPTIONS[..], &["time_offset_ms", "production", "boards", "images"], &DRAWN_PLATES].concat()
}

/// Options of plates elsewhere: a shop draws its own, and a curve has its own.
pub(crate) const DRAWN_PLATES: [&str; 12] = [
    "bow_mm",
    "twist_mm",
    "roughness_mm",
    "plates_deg",
    "step_mm",
    "one_plate",
    "gap_mm",
    "mismatch_mm",
    "column_noise_px",
    "parquet",
    "profile_look",
    "of_profiles_alone",
];

static LEVELS: [Choice<Level>; 3] = [
    ("calm", "Errors of 0.6 times the size; occasional ones are half as frequent", Level::Calm),
    ("ordinary", "Errors as in the list at the end of --help", Level::Ordinary),
    ("rough", "Both 1.7 times as large", Level::Rough),
];

impl ShopArgs {
    /// The cell of a seed; `None` where no shop is asked for.
    pub(crate) fn shop(&self, seed: u64, plates: bool) -> Option<Shop> {
        let only = self.only.as_ref().map(|only| only.0.clone());
        Some(Shop { only, plates, ..Shop::new(self.shop?, seed) })
    }
}

fn only(text: &str) -> Result<OnlyErrors, String> {
    if text == "none" {
        return Ok(OnlyErrors(Vec::new()));
    }
    let named = |name: &str| {
        ShopError::named(name.trim()).ok_or_else(|| {
            let names: Vec<&str> = TABLE.iter().map(|row| row.name).collect();
            format!("`{name}` is not an error of a shop; expected none, or some of {}", names.join(", "))
        })
    };
    text.split(',').map(named).collect::<Result<_, _>>().map(OnlyErrors)
}

/// The list of errors for the long help.
pub(crate) fn errors_help() -> String {
    let row = |row: &ErrorRow| {
        let (share, size) = (100.0 * row.share, format!("{} {}", row.median, row.unit.0));
        let cells =
            if row.share < 1.0 { format!("{share:.0} % of the cells") } else { "every cell".to_owned() };
        format!("  {}: {}, {cells}: {}\n", row.name, size.trim(), row.what)
    };
    let rows: String = TABLE.iter().map(row).collect();
    format!("Errors of an ordinary shop, with the median of their size:\n{rows}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_read_by_name_and_unknown_ones_refused() {
        let read = only("rounded-edge,bow");
        assert_eq!(read, Ok(OnlyErrors(vec![ShopError::RoundedEdge, ShopError::Bow])));
        assert_eq!(only("none"), Ok(OnlyErrors(Vec::new())));
        assert!(only("rounded").is_err_and(|why| why.contains("rounded-edge")));
    }
}
