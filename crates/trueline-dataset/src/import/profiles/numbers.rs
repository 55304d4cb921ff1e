//! Text tables of numbers with an optional header of words or column positions.

use crate::dialect::plain_csv;
use crate::error::{Error, Problem};
use crate::moment;
use std::collections::BTreeMap;
use std::path::Path;

/// The lines of a table: header lines as words, then rows of numbers. An empty field, or one that is not a number, is no
/// value.
pub(super) struct NumberTable {
    /// The last line before the first row of numbers that has as many fields, if any.
    pub header: Option<Vec<String>>,
    /// Rows with their line numbers.
    pub rows: Vec<(u64, Vec<Option<f64>>)>,
    /// The first fields of each row as they were written: a time among them may be no number.
    pub words: Vec<Vec<String>>,
}

/// This many fields before the numbers may be a counter, a time, an encoder and more.
const WORDS: usize = 4;

impl NumberTable {
    /// A column as written; empty if it is not among the first.
    pub(super) fn words_of(&self, column: usize) -> impl Iterator<Item = &str> + Clone {
        self.words.iter().map(move |row| row.get(column).map_or("", String::as_str))
    }

    /// Drops the last field of every row, which is empty in all of them: a separator at the end of a row begins no column.
    /// If the header names it, it is a column without measurements.
    fn drop_unnamed_last(&mut self, width: usize) {
        let named =
            self.header.as_ref().filter(|header| header.len() == width).map(|header| &header[width - 1]);
        if width < 3 || named.is_some_and(|name| !name.is_empty()) {
            return;
        }
        self.header
            .iter_mut()
            .filter(|header| header.len() == width)
            .for_each(|header| header.truncate(width - 1));
        self.rows.iter_mut().for_each(|(_, row)| row.truncate(width - 1));
        self.words.iter_mut().for_each(|words| words.truncate(width - 1));
    }
}

/// Reads a table; everything before the first row of numbers is header.
///
/// # Errors
/// Broken text, or no row of numbers.
pub(super) fn read(file: &Path, bytes: Vec<u8>) -> Result<NumberTable, Error> {
    let (csv, _) = plain_csv(file, bytes, None)?;
    let text = String::from_utf8(csv)
        .map_err(|_| Error::in_file(file, Problem::Csv("it is not text".to_owned())))?;
    let width = usual_width(&text);
    let (mut header, mut rows, mut words): (Option<Vec<String>>, Vec<_>, Vec<Vec<String>>) =
        (None, Vec::new(), Vec::new());
    let mut all_end_empty = true;
    for (index, line) in text.lines().enumerate() {
        let fields: Vec<&str> = fields(line).collect();
        if fields.iter().all(|field| field.is_empty()) {
            continue;
        }
        let numbers: Vec<Option<f64>> =
            fields.iter().map(|field| field.parse().ok().filter(|value: &f64| value.is_finite())).collect();
        let count = numbers.iter().flatten().count();
        // If the first column has no value, or is a time, a row is recognised by its width.
        let begins = numbers[0].is_some() || moment::parse(fields[0]).is_some() || moment::is_day(fields[0]);
        let is_first_row =
            fields.len() == width && (begins || fields[0].is_empty()) && count * 2 >= numbers.len();
        if is_first_row || (!rows.is_empty() && (begins || fields.len() == width)) {
            all_end_empty &= fields.len() == width && fields[width - 1].is_empty();
            rows.push((index as u64 + 1, numbers));
            words.push(fields.iter().take(WORDS).map(|&field| field.to_owned()).collect());
        } else if rows.is_empty() {
            if !line.starts_with('#') || fields.len() == width {
                let bare = |field: &&str| field.trim_start_matches(['#', ' ']).to_owned();
                header = Some(fields.iter().map(bare).collect());
            }
        } else {
            let text = fields[0].to_owned();
            return Err(Error::at_line(file, index as u64 + 1, Problem::NotANumber { text }));
        }
    }
    if rows.is_empty() {
        let what = format!("not a table of numbers (it begins with `{}`)", beginning(&text));
        let hint = "check that it is the sensor's file. Export its profiles as CSV; `--profile-format` names \
            their format";
        return Err(match text.trim().is_empty() {
            true => Error::in_file(file, Problem::NoRows),
            false => Error::unreadable(file, what, hint),
        });
    }
    let mut table = NumberTable { header, rows, words };
    if all_end_empty {
        table.drop_unnamed_last(width);
    }
    Ok(table)
}

/// The fields of a line; a comma between quotes is the decimal sign of a time.
fn fields(line: &str) -> impl Iterator<Item = &str> {
    let mut quoted = false;
    let separates = move |letter: char| {
        quoted ^= letter == '"';
        letter == ',' && !quoted
    };
    line.trim_start_matches('\u{feff}').split(separates).map(|field| field.trim().trim_matches('"').trim())
}

/// The number of fields that most lines of numbers have; of as many the larger one.
fn usual_width(text: &str) -> usize {
    let mut widths: BTreeMap<usize, usize> = BTreeMap::new();
    for line in text.lines() {
        let (all, numbers) = fields(line).fold((0, 0), |(all, numbers), field| {
            (all + 1, numbers + usize::from(field.parse::<f64>().is_ok()))
        });
        if numbers * 2 >= all && numbers > 0 {
            *widths.entry(all).or_default() += 1;
        }
    }
    widths.into_iter().max_by_key(|(width, lines)| (*lines, *width)).map_or(0, |(width, _)| width)
}

/// The first words of a text.
fn beginning(text: &str) -> String {
    text.trim().chars().take_while(|c| *c != '\n').take(40).collect()
}
