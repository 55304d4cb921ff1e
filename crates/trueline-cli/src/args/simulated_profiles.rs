//! How the profiles of `trueline simulate --plates` look.

use crate::args::number;
use clap::Args;
use trueline_sim::ProfileLook;

/// Reads a number in its unit.
type Number = fn(&str) -> Result<f64, String>;

/// Parts of a look, by the names that a user types.
const PARTS: [(&str, Number); 7] = [
    ("column-mm", number::column_mm),
    ("drop-outs", number::share),
    ("edge-drop-outs", number::share),
    ("mixed", number::share),
    ("reflections", number::share),
    ("gap-filled", number::share),
    ("rounded-mm", number::zero_or_more),
];

/// One of [`PARTS`] by its index, and its value.
type Part = (usize, f64);

#[derive(Args)]
#[group(id = "of_profiles")]
pub(crate) struct ProfileLookArgs {
    /// How a profiler's profiles look, NAME=VALUE,…: column-mm=0.1 (distance of columns); the parts (0 to 1) of the columns that do not
    /// return (drop-outs=0.03; within 0.5 mm of an edge edge-drop-outs=0.2), that see both plates at once next to the corner or at the edge
    /// of a lap (mixed=0.3), a reflection up to 6 mm off (reflections=0.01), or something below a gap (gap-filled=0.3); rounded-mm=0
    /// (radius of the edges of a plate over nothing and beside a gap)
    #[arg(long, requires = "plates", value_name = "NAME=VALUE,…", value_delimiter = ',', value_parser = part)]
    pub(crate) profile_look: Vec<Part>,
    #[command(flatten)]
    pub(crate) alone: AloneArgs,
}

/// The same, each by an option of its own: for scripts.
#[derive(Args)]
#[group(id = "of_profiles_alone")]
pub(crate) struct AloneArgs {
    #[arg(long, requires = "plates", value_parser = number::column_mm, hide = true)]
    column_mm: Option<f64>,
    #[arg(long, requires = "plates", value_parser = number::share, hide = true)]
    drop_outs: Option<f64>,
    #[arg(long, requires = "plates", value_parser = number::share, hide = true)]
    edge_drop_outs: Option<f64>,
    #[arg(long, requires = "plates", value_parser = number::share, hide = true)]
    mixed: Option<f64>,
    #[arg(long, requires = "plates", value_parser = number::share, hide = true)]
    reflections: Option<f64>,
    #[arg(long, requires = "plates", value_parser = number::share, hide = true)]
    gap_filled: Option<f64>,
    #[arg(long, requires = "plates", value_parser = number::zero_or_more, hide = true)]
    rounded_mm: Option<f64>,
}

fn part(text: &str) -> Result<Part, String> {
    let names = || PARTS.map(|(name, _)| name).join(", ");
    let (name, value) =
        text.split_once('=').ok_or_else(|| format!("write NAME=VALUE; names are {}", names()))?;
    let at = PARTS.iter().position(|(known, _)| *known == name);
    let at = at.ok_or_else(|| format!("there is no {name}; names are {}", names()))?;
    PARTS[at].1(value).map(|value| (at, value)).map_err(|why| format!("{name}: {why}"))
}

impl ProfileLookArgs {
    /// The given value of each of [`PARTS`]; the last one counts.
    fn values(&self) -> [Option<f64>; 7] {
        let mut values = self.alone.values();
        self.profile_look.iter().for_each(|(at, value)| values[*at] = Some(*value));
        values
    }

    /// The look, changed.
    pub(crate) fn look(&self, usual: ProfileLook) -> ProfileLook {
        let [column_mm, drop_outs, edge_drop_outs, mixed, reflections, gap_filled, rounded_mm] =
            self.values();
        let mm = |option: Option<f64>, usual_m: f64| option.map_or(usual_m, |mm| mm * 1e-3);
        ProfileLook {
            column_m: mm(column_mm, usual.column_m),
            drop_outs: drop_outs.unwrap_or(usual.drop_outs),
            edge_drop_outs: edge_drop_outs.unwrap_or(usual.edge_drop_outs),
            mixed: mixed.unwrap_or(usual.mixed),
            reflections: reflections.unwrap_or(usual.reflections),
            gap_filled: gap_filled.unwrap_or(usual.gap_filled),
            rounded_m: mm(rounded_mm, usual.rounded_m),
            ..usual
        }
    }

    /// Whether a part is given.
    pub(crate) fn says(&self, name: &str) -> bool {
        PARTS.iter().zip(self.values()).any(|((known, _), value)| *known == name && value.is_some())
    }

    /// The option by which something was given.
    pub(crate) fn given(&self) -> Option<&'static str> {
        let together = (!self.profile_look.is_empty()).then_some("--profile-look");
        together.or_else(|| {
            let alone = ALONE.iter().zip(self.alone.values());
            alone.into_iter().find_map(|(name, value)| value.map(|_| *name))
        })
    }
}

/// The options of [`AloneArgs`].
const ALONE: [&str; 7] = [
    "--column-mm",
    "--drop-outs",
    "--edge-drop-outs",
    "--mixed",
    "--reflections",
    "--gap-filled",
    "--rounded-mm",
];

impl AloneArgs {
    fn values(&self) -> [Option<f64>; 7] {
        let Self { column_mm, drop_outs, edge_drop_outs, mixed, reflections, gap_filled, rounded_mm } = *self;
        [column_mm, drop_outs, edge_drop_outs, mixed, reflections, gap_filled, rounded_mm]
    }
}

#[cfg(test)]
mod tests {
    use super::part;

    #[test]
    fn a_part_has_a_name_and_a_value_in_its_range() {
        assert_eq!(part("mixed=0.25"), Ok((3, 0.25)));
        assert!(part("mixed").is_err_and(|why| why.contains("NAME=VALUE")));
        assert!(part("mix=0.25").is_err_and(|why| why.contains("there is no mix; names are column-mm, ")));
        assert!(part("mixed=2").is_err_and(|why| why.starts_with("mixed: ")));
    }
}
