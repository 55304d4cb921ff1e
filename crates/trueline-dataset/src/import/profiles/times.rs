//! A list of stamps, one a line: seconds, another unit that its first line names, clock times or dates.

use crate::dialect::decode;
use crate::error::Error;
use crate::header_unit::time_column;
use crate::import::clock::{Clock, ClockReader};
use crate::source_file;
use crate::stamp::{parse_nanoseconds, problem_of};
use std::path::Path;

/// Stamps of profiles.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Times {
    /// The stamps, ns.
    pub stamps_ns: Vec<i64>,
    /// Their origin.
    pub clock: Clock,
}

impl Times {
    /// Their rate, in words: a user can compare it with the sensor's settings.
    #[must_use]
    pub fn words(&self) -> String {
        let count = self.stamps_ns.len();
        let mut steps: Vec<i64> = self.stamps_ns.windows(2).map(|two| two[1] - two[0]).collect();
        steps.sort_unstable();
        match steps.get(steps.len() / 2) {
            Some(&step_ns) if step_ns > 0 => format!("{count} stamps, {:.3} a second", 1e9 / step_ns as f64),
            _ => format!("{count} stamps"),
        }
    }
}

/// Reads the stamps; blank lines and lines that begin with `#` are skipped. A first line such as `time_ms` names the unit.
///
/// # Errors
/// A line that is not one time.
pub fn read(file: &Path) -> Result<Times, Error> {
    let bytes = source_file::named(source_file::bytes(file))?;
    source_file::expect_lines(file, &bytes)?;
    let (text, _) = decode(file, bytes)?;
    let lines =
        text.lines().map(|line| line.trim_start_matches('\u{feff}').trim_end_matches([';', ',']).trim());
    let rows = lines.enumerate().filter(|(_, line)| !line.is_empty() && !line.starts_with('#'));
    let (mut times, mut digits, mut reader) = (Times::default(), 9, None::<ClockReader>);
    for (place, (index, line)) in rows.enumerate() {
        let at = |problem| Error::at_line(file, index as u64 + 1, problem);
        if place == 0
            && let Some(unit) = time_column(line)
        {
            digits = match unit.as_str() {
                "time_ns" => 0,
                "time_us" => 3,
                "time_ms" => 6,
                _ => 9,
            };
            continue;
        }
        if times.stamps_ns.is_empty() {
            reader = ClockReader::of(line);
        }
        let decimal = line.replacen(',', ".", 1);
        times.stamps_ns.push(match &mut reader {
            Some(reader) => reader.ns(line).map_err(at)?,
            None => parse_nanoseconds(&decimal, digits).ok_or_else(|| at(problem_of(line)))?,
        });
    }
    times.clock = reader.map_or(Clock::Seconds, |reader| reader.clock());
    Ok(times)
}

/// One time as a user writes it: seconds, a clock time or a date.
#[must_use]
pub fn of_text(text: &str) -> Option<(i64, Clock)> {
    match ClockReader::of(text) {
        Some(mut reader) => Some((reader.ns(text).ok()?, reader.clock())),
        None => Some((parse_nanoseconds(text, 9)?, Clock::Seconds)),
    }
}
