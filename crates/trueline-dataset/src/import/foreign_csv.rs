//! CSV files of any program as ours: their separators, their decimal sign, their names.

use super::robot_layout::{RobotLayout, time_column};
use crate::dialect::{Dialect, Separator, plain_csv, quoted};
use crate::error::{Error, Problem};
use std::path::Path;

/// Which column of the foreign file holds one of ours, for example `x_mm` ← `pos_x`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ColumnMapping {
    /// Our column, with its unit.
    pub ours: String,
    /// Their column.
    pub theirs: String,
}

/// How the names of a foreign table become ours. What is not renamed keeps its name; what then is none of ours is left out.
pub struct Renaming<'a> {
    /// What the user named.
    pub map: &'a [ColumnMapping],
    /// The robot's maker, for what the user did not name.
    pub layout: Option<&'a RobotLayout>,
    /// Whether a name is one of ours.
    pub is_ours: &'a dyn Fn(&str) -> bool,
}

/// A foreign table with our names, and what there is to say about it.
#[derive(Clone, Debug)]
pub struct ForeignTable {
    /// CSV text with our header; rows keep their line numbers.
    pub csv: Vec<u8>,
    /// How it was written.
    pub dialect: Dialect,
    /// Their header.
    pub header: Vec<String>,
    /// Columns that are none of ours.
    pub left_out: Vec<String>,
    /// Most decimals of an angle in degrees, where there are angles.
    pub angle_decimals: Option<usize>,
}

/// Reads a foreign table. A separator that the user names is used; else it is recognised.
///
/// Lines keep their numbers, so later errors point into the foreign file.
///
/// # Errors
/// A broken table, or a mapping that names a column the file does not have.
pub fn read(
    file: &Path,
    bytes: Vec<u8>,
    separator: Option<Separator>,
    renaming: &Renaming<'_>,
) -> Result<ForeignTable, Error> {
    let (plain, dialect) = plain_csv(file, bytes, separator)?;
    let broken = |error: csv::Error| Error::in_file(file, Problem::Csv(error.to_string()));
    let mut reader =
        csv::ReaderBuilder::new().flexible(true).trim(csv::Trim::All).from_reader(plain.as_slice());
    let header: Vec<String> = reader
        .headers()
        .map_err(broken)?
        .iter()
        .map(|n| n.trim_start_matches('\u{feff}').to_owned())
        .collect();
    // Lines before the header keep the count as well.
    let before = dialect.comment_lines;
    let names = renaming.names(file, before as u64 + 1, &header)?;
    let kept: Vec<(usize, &String)> =
        names.iter().enumerate().filter_map(|(k, name)| Some((k, name.as_ref()?))).collect();
    let mut out = "\n".repeat(before);
    out += &(kept.iter().map(|(_, name)| name.as_str()).collect::<Vec<_>>().join(",") + "\n");
    let mut line = before as u64 + 1;
    let mut angle_decimals = None;
    for record in reader.records() {
        let record = record.map_err(broken)?;
        let at = record.position().map_or(0, csv::Position::line);
        if record.len() != header.len() {
            let problem = Problem::FieldCount { expected: header.len(), found: record.len() };
            return Err(Error::at_line(file, at, problem));
        }
        // Empty lines keep the count.
        while line + 1 < at {
            out.push('\n');
            line += 1;
        }
        line += 1;
        for (place, (column, name)) in kept.iter().enumerate() {
            let field = &record[*column];
            if name.ends_with("_deg") {
                let decimals = field.split_once('.').map_or(0, |(_, fraction)| fraction.len());
                angle_decimals = angle_decimals.max(Some(decimals));
            }
            out.push_str(if place > 0 { "," } else { "" });
            out.push_str(&quoted(field));
        }
        out.push('\n');
    }
    let left_out =
        header.iter().zip(&names).filter(|(_, name)| name.is_none()).map(|(theirs, _)| theirs.clone());
    let left_out = left_out.collect();
    Ok(ForeignTable { csv: out.into_bytes(), dialect, header, left_out, angle_decimals })
}

impl Renaming<'_> {
    /// Our name of each column, or none.
    fn names(&self, file: &Path, line: u64, header: &[String]) -> Result<Vec<Option<String>>, Error> {
        for item in self.map {
            if !header.contains(&item.theirs) {
                let problem = Problem::MissingColumn { name: item.theirs.clone(), found: header.join(", ") };
                return Err(Error::at_line(file, line, problem));
            }
        }
        let ours = |theirs: &String| {
            self.ours(theirs).map_err(|problem| Error::at_line(file, line, problem).in_column(theirs))
        };
        header.iter().map(ours).collect()
    }

    /// How much a column of theirs is wanted: what the user names counts more than what has our name by chance.
    #[must_use]
    pub fn weight(&self, theirs: &str) -> usize {
        let named = self.map.iter().any(|item| item.theirs == theirs);
        // What is in a unit that is not known is wanted as well: it is refused where it is read.
        if named { 100 } else { usize::from(!matches!(self.ours(theirs), Ok(None))) }
    }

    /// Our name of a column of theirs, or none.
    ///
    /// # Errors
    /// A column whose header has a unit that is not known.
    pub fn ours(&self, theirs: &str) -> Result<Option<String>, Problem> {
        let by_layout = |name: &str| self.layout.map_or(Ok(None), |layout| layout.ours(name));
        if let Some(item) = self.map.iter().find(|item| item.theirs == theirs) {
            // A user may name what a column is to a robot, `e1_deg` say: the layout knows what that is to us.
            let name = item.ours.clone();
            return Ok(Some(if (self.is_ours)(&name) { name } else { by_layout(&name)?.unwrap_or(name) }));
        }
        if let Some(name) = by_layout(theirs)? {
            return Ok(Some(name));
        }
        Ok(if (self.is_ours)(theirs) { Some(theirs.to_owned()) } else { time_column(theirs) })
    }
}
