//! Pose formats of the makers of robots: names and units of the columns, and the meaning of the rotation.

use super::makers::{Column, MAKERS, Maker};
use crate::error::Problem;
use crate::header_unit::stem_and_unit;
use trueline_geometry::EulerSequence;

/// The columns of a robot's pose, in the words of its maker.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RobotLayout {
    /// The assumption, in words; reported whenever the layout is used.
    pub words: String,
    columns: Vec<LayoutColumn>,
}

#[derive(Clone, Debug, PartialEq, Eq)]
struct LayoutColumn {
    /// Names in lower case, without unit.
    theirs: &'static [&'static str],
    /// Our name, without unit.
    ours: String,
    /// Our suffix if the header states no unit; `None` if it must.
    unit: Option<&'static str>,
}

/// Names of the three angles where the sequence is named by the user.
const ANGLES: [&[&str]; 3] =
    [&["a", "rx", "e1", "angle1"], &["b", "ry", "e2", "angle2"], &["c", "rz", "e3", "angle3"]];

impl RobotLayout {
    /// All names known to [`RobotLayout::named`].
    pub fn names() -> impl Iterator<Item = &'static str> {
        MAKERS.iter().map(|maker| maker.name)
    }

    /// The layout of a maker.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        let maker = MAKERS.iter().find(|maker| maker.name == name)?;
        let column =
            |&(theirs, ours, unit): &Column| LayoutColumn { theirs, ours: ours.to_owned(), unit: Some(unit) };
        let columns = maker.columns.iter().map(column).collect();
        Some(Self { words: maker.words.to_owned(), columns })
    }

    /// The columns of an index of pictures, of any program.
    pub(crate) fn of_pictures() -> Self {
        let column = |theirs, ours: &str| LayoutColumn { theirs, ours: ours.to_owned(), unit: Some("") };
        Self {
            words: String::new(),
            columns: vec![
                column(&["file", "filename", "file name", "image", "picture", "name", "path"], "file"),
                column(&["frame", "frame_id", "counter", "index", "no.", "nr."], "frame"),
            ],
        }
    }

    /// Angles A B C, Rx Ry Rz, e1 e2 e3 or angle1 angle2 angle3 in a sequence that the user names. Units are in the header,
    /// or are mm and degrees if a maker's layout states it.
    #[must_use]
    pub fn with_sequence(maker: Option<&Self>, sequence: EulerSequence) -> Self {
        let unit = |unit| maker.map(|_| unit);
        let stem = sequence.to_string().replace('-', "_");
        let positions = match maker {
            Some(maker) => maker
                .columns
                .iter()
                .filter(|c| matches!(c.ours.as_str(), "x" | "y" | "z" | "time"))
                .cloned()
                .collect(),
            None => Vec::new(),
        };
        let angles = ANGLES.iter().zip(1..).map(|(theirs, number)| LayoutColumn {
            theirs,
            ours: format!("euler_{stem}_{number}"),
            unit: unit("_deg"),
        });
        Self {
            words: format!("three angles, {sequence}, in the order of their names"),
            columns: positions.into_iter().chain(angles).collect(),
        }
    }

    /// Whether its lengths are metres where the header names no unit.
    #[must_use]
    pub(crate) fn is_in_metres(&self) -> bool {
        self.columns.iter().any(|column| column.ours == "x" && column.unit == Some("_m"))
    }

    /// Our name, with unit, for a column of the foreign header; `None` if the layout does not have it.
    ///
    /// # Errors
    /// A column of the layout with an unknown unit: it is then not in the maker's.
    pub fn ours(&self, header: &str) -> Result<Option<String>, Problem> {
        // Of Kawasaki T is an angle, and t is the time of all.
        if header.trim() == "t" {
            return Ok(None);
        }
        let (stem, unit) = stem_and_unit(header);
        let Some(column) = self.columns.iter().find(|column| is_called(&stem, column.theirs)) else {
            return Ok(None);
        };
        Ok(Some(format!("{}{}", column.ours, unit.suffix()?.or(column.unit).unwrap_or(""))))
    }

    /// All makers with columns in a header.
    #[must_use]
    pub fn recognised(header: &[String]) -> Vec<&'static str> {
        MAKERS.iter().filter(|maker| maker.found_in(header).is_some()).map(|maker| maker.name).collect()
    }

    /// The one maker with columns in a header under unique names of more than one or two letters.
    #[must_use]
    pub(crate) fn unmistakable(header: &[String]) -> Option<Self> {
        let named: Vec<(&Maker, Vec<usize>)> =
            MAKERS.iter().filter_map(|maker| Some((maker, maker.found_in(header)?))).collect();
        let [(maker, columns)] = named.as_slice() else { return None };
        let is_own = |column: &usize| stem_and_unit(&header[*column]).0.len() > 4;
        columns.iter().all(is_own).then(|| Self::named(maker.name)).flatten()
    }

    /// Every maker on a line: its name, and the assumption.
    pub fn list() -> impl Iterator<Item = (&'static str, &'static str)> {
        MAKERS.iter().map(|maker| (maker.name, maker.words))
    }

    /// The columns that a maker's log usually has, as `--columns` takes them.
    #[must_use]
    pub fn usual_columns(name: &str) -> Option<&'static str> {
        MAKERS.iter().find(|maker| maker.name == name).map(|maker| maker.usual)
    }
}

impl Maker {
    /// The maker's columns in a header, if it has them all.
    fn found_in(&self, header: &[String]) -> Option<Vec<usize>> {
        let place =
            |(theirs, ..): &Column| header.iter().position(|name| is_called(&stem_and_unit(name).0, theirs));
        let pose = self.columns.iter().filter(|(_, ours, _)| *ours != "time");
        let places: Vec<usize> = pose.map(place).collect::<Option<_>>()?;
        (places.len() >= 6).then_some(places)
    }
}

/// Whether a column has one of these names. `pose.position.x`, `field.pose.position.x` and `/robot/pose/position/x` are `position.x`.
fn is_called(stem: &str, names: &[&str]) -> bool {
    let dotted = stem.replace('/', ".");
    let ends = |name: &&str| name.contains('.') && dotted.ends_with(&format!(".{name}"));
    names.iter().any(|name| dotted == *name || ends(name))
}
