//! How the profiles of `trueline simulate --plates` look.

use crate::args::number;
use clap::Args;
use trueline_sim::ProfileLook;

#[derive(Args)]
#[group(id = "of_profiles")]
pub(crate) struct ProfileLookArgs {
    /// Distance of a profiler's columns, mm [default: 0.1]
    #[arg(long, requires = "plates", value_parser = number::column_mm)]
    pub(crate) column_mm: Option<f64>,
    /// Fraction of a profiler's columns without a return, 0 to 1 [default: 0.03]
    #[arg(long, requires = "plates", value_parser = number::share)]
    pub(crate) drop_outs: Option<f64>,
    /// Fraction of the columns within 0.5 mm of an edge without a return, 0 to 1 [default: 0.2]
    #[arg(long, requires = "plates", value_parser = number::share)]
    pub(crate) edge_drop_outs: Option<f64>,
    /// Fraction of the columns at the corner, or at the edge of a lap, that see both plates at once, 0 to 1 [default: 0.3]
    #[arg(long, requires = "plates", value_parser = number::share)]
    pub(crate) mixed: Option<f64>,
    /// Fraction of a profiler's columns that see a reflection, up to 6 mm off, 0 to 1 [default: 0.01]
    #[arg(long, requires = "plates", value_parser = number::share)]
    pub(crate) reflections: Option<f64>,
    /// Fraction of the columns in a gap that see something below it, 0 to 1 [default: 0.3]
    #[arg(long, requires = "plates", value_parser = number::share)]
    pub(crate) gap_filled: Option<f64>,
    /// Radius of the edges of a plate over nothing and beside a gap, mm [default: 0]
    #[arg(long, requires = "plates", value_parser = number::zero_or_more)]
    pub(crate) rounded_mm: Option<f64>,
}

impl ProfileLookArgs {
    /// The look, changed.
    pub(crate) fn look(&self, usual: ProfileLook) -> ProfileLook {
        let mm = |option: Option<f64>, usual_m: f64| option.map_or(usual_m, |mm| mm * 1e-3);
        ProfileLook {
            column_m: mm(self.column_mm, usual.column_m),
            drop_outs: self.drop_outs.unwrap_or(usual.drop_outs),
            edge_drop_outs: self.edge_drop_outs.unwrap_or(usual.edge_drop_outs),
            mixed: self.mixed.unwrap_or(usual.mixed),
            reflections: self.reflections.unwrap_or(usual.reflections),
            gap_filled: self.gap_filled.unwrap_or(usual.gap_filled),
            rounded_m: mm(self.rounded_mm, usual.rounded_m),
            ..usual
        }
    }

    /// One of these options that was given.
    pub(crate) fn given(&self) -> Option<&'static str> {
        let options = [
            ("--column-mm", self.column_mm),
            ("--drop-outs", self.drop_outs),
            ("--edge-drop-outs", self.edge_drop_outs),
            ("--mixed", self.mixed),
            ("--reflections", self.reflections),
            ("--gap-filled", self.gap_filled),
            ("--rounded-mm", self.rounded_mm),
        ];
        options.iter().find_map(|(name, value)| value.map(|_| *name))
    }
}
