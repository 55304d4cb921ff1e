//! External axes in columns of a robot's log: `--axis table_deg=E1`, the unit in our name or in theirs.
//!
//! The log is read once: poses and axes have one clock. Then the columns of the axes are taken out of the table.

use super::foreign_csv::{ColumnMapping, ForeignTable, OF_AXIS};
use crate::axes::{AxisRecord, Carries, is_axis_name};
use crate::axes_csv;
use crate::dialect::quoted;
use crate::error::{Error, Problem};
use crate::header_unit::stem_and_unit;
use crate::log_problem::LogProblem;
use crate::stop_poses::StopPoses;
use crate::unit::Quantity;
use std::path::Path;
use std::str::FromStr;
use trueline_geometry::AxisKind;

/// An axis, and where the values of it are.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AxisColumn {
    /// Its name.
    pub name: String,
    /// The unit of its values in our columns' form (`_deg`, `_mm`, …), if stated.
    pub unit: Option<&'static str>,
    /// Their column, or their joint.
    pub theirs: String,
    /// The body that it moves, if stated.
    pub carries: Option<Carries>,
}

impl FromStr for AxisColumn {
    type Err = String;

    /// Reads `NAME=COLUMN`, `NAME_deg=COLUMN` or `NAME_mm=COLUMN`, optionally followed by `,part`, `,robot` or `,sensor`.
    fn from_str(text: &str) -> Result<Self, String> {
        let form =
            || "write NAME_deg=COLUMN or NAME_mm=COLUMN, as in table_deg=E1 or track_mm=E2,robot".to_owned();
        let (ours, theirs) = text.split_once('=').ok_or_else(form)?;
        let (name, unit) = name_and_unit(ours.trim());
        let stated =
            theirs.rsplit_once(',').and_then(|(column, word)| Some((column, Carries::named(word.trim())?)));
        let (theirs, carries) = stated.map_or((theirs, None), |(column, carries)| (column, Some(carries)));
        if theirs.trim().is_empty() {
            return Err(form());
        }
        if !is_axis_name(name) {
            return Err(format!("`{name}` is not a valid name of an axis: letters, digits, - and _"));
        }
        Ok(Self { name: name.to_owned(), unit, theirs: theirs.trim().to_owned(), carries })
    }
}

/// `table_deg` → `table`, `_deg`.
fn name_and_unit(ours: &str) -> (&str, Option<&'static str>) {
    let units = [Quantity::Angle, Quantity::Length].into_iter().flat_map(Quantity::suffixes);
    let longest = units
        .filter_map(|(suffix, _)| Some((ours.strip_suffix(suffix)?, *suffix)))
        .filter(|(name, _)| !name.is_empty())
        .max_by_key(|(_, suffix)| suffix.len());
    longest.map_or((ours, None), |(name, suffix)| (name, Some(suffix)))
}

/// The kind of an axis with values in a unit.
#[must_use]
pub fn kind_of_unit(unit: &str) -> Option<AxisKind> {
    let is_of = |quantity: Quantity| quantity.suffixes().iter().any(|(suffix, _)| *suffix == unit);
    if is_of(Quantity::Angle) {
        Some(AxisKind::Rotary)
    } else {
        is_of(Quantity::Length).then_some(AxisKind::Linear)
    }
}

/// The size of a unit of axes in SI: rad or m.
#[must_use]
pub fn size_of_unit(unit: &str) -> f64 {
    let units = [Quantity::Angle, Quantity::Length].into_iter().flat_map(Quantity::suffixes);
    units.into_iter().find(|(suffix, _)| *suffix == unit).map_or(1.0, |(_, size)| *size)
}

/// The usual carriage of a kind of axis: a table turns the part, a track shifts the robot.
#[must_use]
pub fn usually_carries(kind: AxisKind) -> Carries {
    match kind {
        AxisKind::Rotary => Carries::Part,
        AxisKind::Linear => Carries::Robot,
    }
}

impl AxisColumn {
    /// The axis by its unit and by its description elsewhere; `note` is the remark about an assumption.
    ///
    /// # Errors
    /// No unit, and a unit that is not of its kind.
    pub fn record(
        &self,
        unit: Option<&'static str>,
        described: Option<&AxisRecord>,
        note: &mut Option<String>,
    ) -> Result<AxisRecord, LogProblem> {
        let without = || LogProblem::AxisWithoutUnit { name: self.name.clone(), theirs: self.theirs.clone() };
        let kind = unit.and_then(kind_of_unit).ok_or_else(without)?;
        let contradicts = |what: String| LogProblem::AxisContradicts { name: self.name.clone(), what };
        if let Some(described) = described {
            if described.kind != kind {
                return Err(contradicts(format!("kind = \"{}\"", described.kind.name())));
            }
            if self.carries.is_some_and(|carries| carries != described.carries) {
                return Err(contradicts(format!("carries = \"{}\"", described.carries.name())));
            }
            return Ok(described.clone());
        }
        let carries = self.carries.unwrap_or_else(|| {
            let usual = usually_carries(kind);
            *note = Some(format!(
                "axis {}: {}, taken to carry the {}; if not, --axis {}{}={},{} or correct cell.toml",
                self.name,
                kind.name(),
                usual.name(),
                self.name,
                unit.unwrap_or_default(),
                self.theirs,
                if usual == Carries::Part { "robot" } else { "part" },
            ));
            usual
        });
        Ok(AxisRecord::new(&self.name, kind, carries))
    }

    /// The mapping by which its column is found.
    #[must_use]
    pub(super) fn mapping(&self) -> ColumnMapping {
        ColumnMapping { ours: format!("{OF_AXIS}{}", self.name), theirs: self.theirs.clone() }
    }
}

/// The columns of the axes of a log.
pub(super) struct AxisTable {
    /// The axes, without values.
    pub axes: Vec<AxisRecord>,
    /// The text of their table, under the names of `axes.csv`.
    pub csv: Vec<u8>,
}

/// The requested axes of a log.
pub(super) struct AskedAxes<'a> {
    /// The requested axes.
    pub columns: &'a [AxisColumn],
    /// The statements of `cell.toml` beside the log.
    pub described: &'a [AxisRecord],
    /// Units of a rotary and of a linear axis without a stated unit, as usual for the robot's maker.
    pub usual_units: Option<[&'static str; 2]>,
}

impl AskedAxes<'_> {
    /// Takes the columns of the axes out of a table and reads them; none if none are requested.
    ///
    /// # Errors
    /// The first column that cannot be used.
    pub(super) fn taken_out(
        &self,
        file: &Path,
        table: &mut ForeignTable,
        stops: Option<&StopPoses>,
        notes: &mut Vec<String>,
    ) -> Result<Vec<AxisRecord>, Error> {
        let Some(AxisTable { axes, csv }) = self.text(file, table, notes)? else { return Ok(Vec::new()) };
        axes_csv::read(file, &csv, axes, stops)
    }

    /// The axes without values, and the table of their values, taken from the log's; `None` if none are requested.
    ///
    /// # Errors
    /// An axis without a unit, or one that contradicts its description; a described axis that is not requested.
    pub(super) fn text(
        &self,
        file: &Path,
        table: &mut ForeignTable,
        notes: &mut Vec<String>,
    ) -> Result<Option<AxisTable>, Error> {
        if self.columns.is_empty() {
            return Ok(None);
        }
        let in_file = |problem: LogProblem| Error::in_file(file, problem.into());
        let is_asked = |axis: &&AxisRecord| self.columns.iter().any(|column| column.name == axis.name);
        if let Some(left) = self.described.iter().find(|axis| !is_asked(axis)) {
            return Err(in_file(LogProblem::AxisNotNamed { name: left.name.clone() }));
        }
        let mut records = Vec::new();
        let mut names = Vec::new();
        for column in self.columns {
            let described = self.described.iter().find(|axis| axis.name == column.name);
            let unit = self.unit(column, described, table).map_err(|p| Error::in_file(file, p))?;
            let mut note = None;
            let record = column.record(unit, described, &mut note).map_err(in_file)?;
            notes.extend(note.map(|words| format!("{}: {words}", file.display())));
            names.push((
                format!("{OF_AXIS}{}", column.name),
                format!("{}{}", column.name, unit.unwrap_or("")),
            ));
            records.push(record);
        }
        // The order of the chain is that of the file that describes it.
        let place = |record: &AxisRecord| self.described.iter().position(|axis| axis.name == record.name);
        records.sort_by_key(place);
        let (poses, csv) = split(&table.csv, &names);
        table.csv = poses;
        Ok(Some(AxisTable { axes: records, csv }))
    }

    /// The unit of a column: ours, theirs, or the maker's.
    fn unit(
        &self,
        column: &AxisColumn,
        described: Option<&AxisRecord>,
        table: &ForeignTable,
    ) -> Result<Option<&'static str>, Problem> {
        if column.unit.is_some() {
            return Ok(column.unit);
        }
        let mapping = column.mapping();
        let theirs = table.header.iter().find(|theirs| mapping.means(theirs, &table.header));
        let of_header = theirs.map(|theirs| stem_and_unit(theirs).1.suffix()).transpose()?.flatten();
        let of_kind = described.map(|axis| usize::from(axis.kind == AxisKind::Linear));
        Ok(of_header.filter(|unit| !unit.is_empty()).or_else(|| Some(self.usual_units?[of_kind?])))
    }
}

/// A table without the columns of the axes, and these with the key of their rows, under other names; lines keep their
/// numbers.
fn split(csv: &[u8], names: &[(String, String)]) -> (Vec<u8>, Vec<u8>) {
    let text = String::from_utf8_lossy(csv);
    let (mut poses, mut axes) = (String::new(), String::new());
    let mut header: Option<Vec<String>> = None;
    for line in text.lines() {
        let mut fields = fields_of(line);
        let columns = match &header {
            _ if line.is_empty() => Vec::new(),
            Some(header) => header.clone(),
            None => {
                header = Some(fields.clone());
                let renamed = |field: &String| names.iter().find(|(own, _)| own == field);
                let columns = fields.clone();
                for field in &mut fields {
                    if let Some((_, name)) = renamed(field) {
                        field.clone_from(name);
                    }
                }
                columns
            }
        };
        let chosen = |is_wanted: &dyn Fn(&str) -> bool| {
            let kept = columns.iter().zip(&fields).filter(|(column, _)| is_wanted(column));
            kept.map(|(_, field)| quoted(field).into_owned()).collect::<Vec<_>>().join(",") + "\n"
        };
        let is_axis = |column: &str| column.starts_with(OF_AXIS);
        let is_key = |column: &str| column.starts_with("time_") || matches!(column, "stop" | "picture");
        poses += &chosen(&|column| !is_axis(column));
        axes += &chosen(&|column| is_axis(column) || is_key(column));
    }
    (poses.into_bytes(), axes.into_bytes())
}

/// The fields of a line.
fn fields_of(line: &str) -> Vec<String> {
    if !line.contains('"') {
        return line.split(',').map(str::to_owned).collect();
    }
    let mut reader = csv::ReaderBuilder::new().has_headers(false).from_reader(line.as_bytes());
    let record = reader.records().next().and_then(Result::ok).unwrap_or_default();
    record.iter().map(str::to_owned).collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;

    #[test]
    fn an_axis_is_named_with_its_unit_and_what_it_carries() {
        let axis = |text: &str| AxisColumn::from_str(text).unwrap();
        let table = axis("table_deg=E1");
        assert_eq!((table.name.as_str(), table.unit, table.theirs.as_str()), ("table", Some("_deg"), "E1"));
        assert_eq!(table.carries, None);
        let track = axis("track_mm=$AXIS_ACT.E2 [mm],robot");
        assert_eq!((track.theirs.as_str(), track.carries), ("$AXIS_ACT.E2 [mm]", Some(Carries::Robot)));
        // A comma that belongs to their name.
        assert_eq!(axis("table=a,b").theirs, "a,b");
        assert_eq!(axis("my_table=E1").name, "my_table");
        for wrong in ["table", "time_deg=E1", "_deg=", "a b=E1", "=E1"] {
            assert!(AxisColumn::from_str(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn columns_of_axes_are_taken_out_and_lines_stay_where_they_are() {
        let csv = b"\ntime_s,x_mm,axis table,qw\n1,2,\"3\",4\n\n5,6,7,8\n";
        let names = [("axis table".to_owned(), "table_deg".to_owned())];
        let (poses, axes) = split(csv, &names);
        assert_eq!(String::from_utf8(poses).unwrap(), "\ntime_s,x_mm,qw\n1,2,4\n\n5,6,8\n");
        assert_eq!(String::from_utf8(axes).unwrap(), "\ntime_s,table_deg\n1,3\n\n5,7\n");
    }
}
