//! Start of a table: the separator of its columns, and the line that names them.
//!
//! Programs write lines of their own before a table, with `#` or without, a row of units below the names, or no names at
//! all. The line of names is the one with names in all cells, followed by rows of as many cells.

use crate::header_unit::{HeaderUnit, is_unit, stem_and_unit, suffix_of};
use crate::moment;
use crate::separator::{Separator, fields};

/// Lines that are searched for the names of the columns; no program writes as many before its table.
const LINES_BEFORE: usize = 2000;

/// Start of a table.
#[derive(Debug)]
pub(crate) struct Start {
    /// Separator of two columns.
    pub separator: Separator,
    /// How many lines stand before that of the names, or before the first row if no line has names.
    pub lines_before: usize,
    /// The names, if that line does not contain them plainly: they are behind a `#`, or have units in a row below
    /// them.
    pub names: Option<Vec<String>>,
    /// Lines of units below that of the names.
    pub units: usize,
}

/// Finds the start. A separator that the user named is used.
pub(crate) fn find(text: &str, named: Option<Separator>) -> Start {
    let lines: Vec<&str> = text.lines().take(LINES_BEFORE).collect();
    let head = Head { lines: &lines };
    let all = [';', '\t', ','].map(Separator::Character).into_iter().chain([Separator::Blanks]);
    let separators: Vec<Separator> = named.map_or_else(|| all.collect(), |named| vec![named]);
    for &separator in &separators {
        if let Some(start) = head.named_columns(separator) {
            return start;
        }
    }
    head.without_names(&separators)
}

/// The first lines of a file.
struct Head<'a> {
    lines: &'a [&'a str],
}

impl Head<'_> {
    /// The line of names above rows, with the separator; the last one, if tables of other widths that begin with words come before it.
    fn named_columns(&self, separator: Separator) -> Option<Start> {
        let mut found: Option<(usize, usize)> = None;
        let mut rows_since = false;
        for (index, line) in self.lines.iter().enumerate() {
            if !holds(line, separator) {
                continue;
            }
            let cells = header_cells(line, separator);
            let is_head = are_names(&cells) && self.rows_follow(index, cells.len(), separator);
            match found {
                None if is_head => found = Some((index, cells.len())),
                Some((_, width)) if is_head && !rows_since && width != cells.len() => {
                    found = Some((index, cells.len()));
                }
                Some((_, width)) => {
                    rows_since |= cells.len() == width && is_value(&cells[0]);
                }
                None => {}
            }
            // A line that begins with numbers is the table.
            if rows_since {
                break;
            }
        }
        let (index, width) = found?;
        Some(self.start_at(index, width, separator))
    }

    /// The start at a line of names, which may be that of the units.
    fn start_at(&self, index: usize, width: usize, separator: Separator) -> Start {
        let cells = header_cells(self.lines[index], separator);
        let above = (0..index).rev().find(|&k| !self.lines[k].trim().is_empty());
        if let Some(above) = above
            && cells.iter().all(|cell| is_unit(cell))
        {
            let names = header_cells(self.lines[above].trim_start_matches(COMMENT), separator);
            if names.len() == width && are_names(&names) {
                let names = names.into_iter().zip(&cells).map(|(name, unit)| with_unit(name, unit)).collect();
                return Start { separator, lines_before: above, names: Some(names), units: index - above };
            }
        }
        // Blanks around words in brackets separate nothing.
        let is_joined = separator == Separator::Blanks && fields(self.lines[index], separator).len() != width;
        Start { separator, lines_before: index, names: is_joined.then_some(cells), units: 0 }
    }

    /// Whether rows of `width` cells follow a line, at once or below a row of units.
    fn rows_follow(&self, index: usize, width: usize, separator: Separator) -> bool {
        let mut next = self.lines[index + 1..].iter().filter(|line| !line.trim().is_empty());
        let is_row = |line: &&&str| {
            let cells = row_cells(line, separator);
            cells.len() == width && is_row(&cells)
        };
        let first = next.next().filter(is_row).is_some();
        let second = next.next();
        first && second.is_none_or(|line| is_row(&line))
    }

    /// The start of a table without a line of names that fits: its first row, or the line that is meant for one.
    fn without_names(&self, separators: &[Separator]) -> Start {
        let is_comment = |line: &str| line.starts_with(COMMENT);
        let table = |line: &&str| !line.trim().is_empty() && !is_comment(line);
        let first = self.lines.iter().position(table).unwrap_or(0);
        let line = self.lines.get(first).copied().unwrap_or_default();
        let row = self.lines.iter().find_map(|line| {
            let fits = |separator: &&Separator| {
                let cells = row_cells(line, **separator);
                holds(line, **separator) && is_row(&cells) && is_value(&cells[0])
            };
            separators.iter().find(fits).map(|separator| (*line, *separator))
        });
        let usual = separators.iter().find(|separator| holds(line, **separator));
        let usual = usual.or(separators.first().filter(|_| separators.len() == 1));
        let usual = *usual.unwrap_or(&Separator::Character(','));
        let Some((row, separator)) = row else {
            return Start {
                separator: usual,
                lines_before: first_after_comments(self.lines),
                names: None,
                units: 0,
            };
        };
        let width = row_cells(row, separator).len();
        let fits = header_cells(line, usual).len() == row_cells(row, usual).len();
        let separator = if fits { usual } else { separator };
        // numpy and EuRoC write the names behind a `#`.
        let comment = self.lines[..first].iter().rev().find(|line| is_comment(line));
        let behind = comment.map(|line| line.trim_start_matches(COMMENT).trim());
        let is_first_row = std::ptr::eq(row, line);
        let names = behind.filter(|_| is_first_row).and_then(|words| {
            let all = [';', '\t', ','].map(Separator::Character).into_iter().chain([Separator::Blanks]);
            all.map(|s| header_cells(words, s)).find(|cells| cells.len() == width && are_names(cells))
        });
        match names {
            Some(names) => {
                let at = self.lines[..first].iter().rposition(|line| is_comment(line)).unwrap_or(0);
                Start { separator, lines_before: at, names: Some(names), units: 0 }
            }
            None => {
                let lines_before = first_after_comments(self.lines);
                Start { separator, lines_before, names: None, units: 0 }
            }
        }
    }
}

/// Start of a line of words in files of numbers.
const COMMENT: [char; 2] = ['#', '%'];

/// Number of lines up to the last that begins with `#`, before anything else but empty ones.
fn first_after_comments(lines: &[&str]) -> usize {
    let words = lines.iter().take_while(|line| line.starts_with(COMMENT) || line.trim().is_empty());
    let is_comment: Vec<bool> = words.map(|line| line.starts_with(COMMENT)).collect();
    is_comment.iter().rposition(|is| *is).map_or(0, |last| last + 1)
}

/// Whether a line can be one of a table with this separator.
fn holds(line: &str, separator: Separator) -> bool {
    match separator {
        _ if line.starts_with(COMMENT) => false,
        Separator::Character(character) => line.contains(character),
        Separator::Blanks => line.trim().contains([' ', '\t']),
    }
}

/// The cells of a row; a separator at its end makes none.
fn row_cells(line: &str, separator: Separator) -> Vec<String> {
    let mut cells = fields(line, separator);
    if cells.len() > 1 && cells.last().is_some_and(String::is_empty) {
        cells.pop();
    }
    cells
}

/// The cells of a line of names: `X [mm]` is one, with any separator.
fn header_cells(line: &str, separator: Separator) -> Vec<String> {
    let mut cells: Vec<String> = Vec::new();
    for cell in row_cells(line, separator) {
        match cells.last_mut() {
            Some(last) if separator == Separator::Blanks && cell.starts_with(['[', '(']) => {
                last.push(' ');
                last.push_str(&cell);
            }
            _ => cells.push(cell),
        }
    }
    cells
}

/// A name with the unit of the row below it, if it has none itself.
fn with_unit(name: String, unit: &str) -> String {
    let bare = unit.trim_matches(['[', ']', '(', ')', ' ']);
    match stem_and_unit(&name).1 {
        // `-` marks a missing unit.
        HeaderUnit::Absent if suffix_of(&bare.to_lowercase()) != Some("") => format!("{name} [{bare}]"),
        _ => name,
    }
}

/// Whether cells are all names; one in two may be empty.
fn are_names(cells: &[String]) -> bool {
    let named = cells.iter().filter(|cell| !cell.is_empty()).count();
    cells.len() > 1 && 2 * named >= cells.len() && cells.iter().all(|cell| !is_value(cell))
}

/// Whether cells are a row: at least half of them are values, and the first one if there are only two.
fn is_row(cells: &[String]) -> bool {
    let values = cells.iter().filter(|cell| is_value(cell)).count();
    cells.len() > 1 && 2 * values >= cells.len() && (cells.len() > 2 || is_value(&cells[0]))
}

/// Whether a cell is a number with either decimal sign, a time, or numbers in brackets.
pub(crate) fn is_value(cell: &str) -> bool {
    let number = |text: &str| text.parse::<f64>().is_ok();
    number(cell)
        || (cell.matches(',').count() == 1 && number(&cell.replace(',', ".")))
        || moment::parse(cell).is_some()
        || cell.trim_start_matches('p').starts_with(['[', '{'])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn start(text: &str) -> (usize, String, Option<Vec<String>>) {
        let start = find(text, None);
        (start.lines_before, start.separator.to_string(), start.names)
    }

    fn names(names: &[&str]) -> Option<Vec<String>> {
        Some(names.iter().map(|&name| name.to_owned()).collect())
    }

    #[test]
    fn the_names_are_found_below_lines_of_any_kind() {
        let block = "Trace;KRC4\nVersion;1.0\nName;Offset;Gain\nX;0;1\nY;0;1\n\nZeit [s];X;Y;Z\n0,0;1,5;2;3\n0,1;1,5;2;3\n";
        assert_eq!(start(block), (6, "semicolons".into(), None));
        assert_eq!(start("t,x,y\n0,1,2\n"), (0, "commas".into(), None));
        assert_eq!(start("LJ-X8000 Series\nt x y\n0,5 1,5 2\n"), (1, "blanks".into(), None));
        let units = start("made by\nZeit;X;A\ns;mm;°\n0;1;2\n0;1;2\n");
        assert_eq!(units, (1, "semicolons".into(), names(&["Zeit [s]", "X [mm]", "A [°]"])));
        assert_eq!(start("t [s] x [mm] y [mm]\n0 1 2\n").2, names(&["t [s]", "x [mm]", "y [mm]"]));
    }

    #[test]
    fn names_behind_a_hash_are_names_if_there_are_as_many_as_columns() {
        assert_eq!(start("# t,x,y\n0 1 2\n0 1 2\n"), (0, "blanks".into(), names(&["t", "x", "y"])));
        assert_eq!(
            start("# made\n#timestamp, x [m], y []\n1,2,3\n"),
            (1, "commas".into(), names(&["timestamp", "x [m]", "y []"]))
        );
        // Words are not names, and a line of names takes precedence.
        assert_eq!(start("# made by a logger\n1,2,3\n"), (1, "commas".into(), None));
        assert_eq!(start("# a,b,c\nt,x,y\n1,2,3\n"), (1, "commas".into(), None));
    }

    #[test]
    fn a_table_without_names_or_with_other_ones_is_left_as_it_is() {
        for text in ["1,2,3\n4,5,6\n", "t,x,y,z\n1,2,3\n1,2,3\n", "X,-1.5,-1\n0,1,2\n", "t,x\n", ""] {
            assert_eq!(start(text), (0, "commas".into(), None), "{text}");
        }
        // A second table of the same width does not belong to the first: its names are met as a row.
        assert_eq!(start("n,t,x\nrun,1,2\nrun,1,2\nn,t,x\nrun,1,2\n").0, 0);
    }
}
