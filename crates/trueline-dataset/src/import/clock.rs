//! Origin of a log's times: seconds from anywhere, times of day, or dates.

use crate::error::Problem;
use crate::log_problem::LogProblem;
use crate::moment::{self, DAY_NS, Moment};
use crate::stamp::format_seconds;

/// Origin of a stream's times.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Clock {
    /// A number of seconds from anywhere.
    #[default]
    Seconds,
    /// Midnight of the day on which the log began.
    Midnight,
    /// 1970, by a clock of no known zone.
    Date,
    /// 1970 in UTC.
    DateUtc,
}

/// Turns the cells of a column of clock times or dates into seconds, row by row.
#[derive(Clone, Debug)]
pub(crate) struct ClockReader {
    clock: Clock,
    last_ns: Option<i64>,
    days: i64,
}

/// A time of day that is this much earlier than the one before is of the next day.
const HALF_A_DAY_NS: i64 = DAY_NS / 2;

impl ClockReader {
    /// For a column that begins with such a cell; `None` for one of numbers.
    pub(crate) fn of(cell: &str) -> Option<Self> {
        let clock = match moment::parse(cell)? {
            Moment::OfDay(_) => Clock::Midnight,
            Moment::Dated { zone: true, .. } => Clock::DateUtc,
            Moment::Dated { .. } | Moment::Ambiguous => Clock::Date,
        };
        Some(Self { clock, last_ns: None, days: 0 })
    }

    pub(crate) fn clock(&self) -> Clock {
        self.clock
    }

    /// Nanoseconds of a cell.
    ///
    /// # Errors
    /// A cell of another kind than the first one, or a date with ambiguous day and month.
    pub(crate) fn ns(&mut self, cell: &str) -> Result<i64, Problem> {
        let other = || LogProblem::NotATime { text: cell.to_owned(), like: self.clock.words() };
        match (moment::parse(cell), self.clock) {
            (Some(Moment::OfDay(ns)), Clock::Midnight) => {
                if self.last_ns.is_some_and(|last| last - ns > HALF_A_DAY_NS) {
                    self.days += 1;
                }
                self.last_ns = Some(ns);
                let whole_ns = self.days.checked_mul(DAY_NS).and_then(|days_ns| days_ns.checked_add(ns));
                whole_ns.ok_or_else(|| other().into())
            }
            (Some(Moment::Dated { ns, zone: false }), Clock::Date)
            | (Some(Moment::Dated { ns, zone: true }), Clock::DateUtc) => Ok(ns),
            (Some(Moment::Ambiguous), _) => Err(LogProblem::AmbiguousDate { text: cell.to_owned() }.into()),
            _ => Err(other().into()),
        }
    }

    /// The same as a decimal number of seconds.
    ///
    /// # Errors
    /// As [`ClockReader::ns`].
    pub(crate) fn seconds(&mut self, cell: &str) -> Result<String, Problem> {
        self.ns(cell).map(format_seconds)
    }
}

impl Clock {
    /// Appearance of its cells.
    pub(crate) fn words(self) -> &'static str {
        match self {
            Self::Seconds => "a number of seconds",
            Self::Midnight => "a time of day like 14:03:12.345",
            Self::Date => "a date like 2026-03-04 14:03:12.345",
            Self::DateUtc => "a date with its zone like 2026-03-04T14:03:12.345Z",
        }
    }
}

/// Rows of a robot's log are not nearer to each other, ns, ...
const SHORTEST_STEP_NS: f64 = 0.5e6;
/// ... nor, ns, further apart than this.
const LONGEST_STEP_NS: f64 = 0.5e9;
/// Steps in this range may be of this unit or of one a thousand times as large: a millisecond, and a second of a slow
/// logger.
const EITHER: std::ops::RangeInclusive<f64> = 0.5..=2.0;

/// The unit of numbers without a named unit, by the median step. Only one of s, ms, µs and ns gives the step of a log.
/// `None` if none does, or if two could.
pub(crate) fn unit_of_steps(first: &[&str]) -> Option<(&'static str, f64)> {
    let numbers: Vec<f64> = first.iter().filter_map(|text| text.parse().ok()).collect();
    let mut steps: Vec<f64> =
        numbers.windows(2).map(|two| two[1] - two[0]).filter(|step| *step > 0.0).collect();
    steps.sort_by(f64::total_cmp);
    let step = *steps.get(steps.len() / 2)?;
    if numbers.len() != first.len() || EITHER.contains(&step) {
        return None;
    }
    let units = [("_s", 1e9), ("_ms", 1e6), ("_us", 1e3), ("_ns", 1.0)];
    let fits = |(_, ns): &&(&'static str, f64)| (SHORTEST_STEP_NS..LONGEST_STEP_NS).contains(&(step * ns));
    units.iter().find(fits).map(|(unit, ns)| (*unit, step * ns * 1e-6))
}

/// Amount to add to the stamps of a second stream so that both count from the same origin, ns, and a remark about it.
/// `first` and `second` are where the streams begin and end, ns.
pub(crate) fn to_common(
    [first, second]: [Clock; 2],
    [first_ns, second_ns]: [(i64, i64); 2],
) -> (i64, Option<String>) {
    let middle = |(from, to): (i64, i64)| from + (to - from) / 2;
    let days_apart = |ns: i64| (ns as f64 / DAY_NS as f64).round() as i64;
    let dated = |clock| matches!(clock, Clock::Date | Clock::DateUtc);
    match (first, second) {
        // A time of day is known up to whole days.
        (Clock::Midnight, Clock::Midnight) => {
            let days = days_apart(middle(first_ns) - middle(second_ns));
            let said = (days != 0)
                .then(|| "one log began before midnight and one after it: the dates are aligned".into());
            (days * DAY_NS, said)
        }
        (Clock::Midnight, clock) | (clock, Clock::Midnight) if dated(clock) => {
            let days = days_apart(middle(first_ns) - middle(second_ns));
            let said = "one log has dates and the other times of day: the same day and time zone are assumed";
            (days * DAY_NS, Some(said.to_owned()))
        }
        (a, b) if dated(a) && dated(b) && a != b => (
            0,
            Some(
                "one log names its time zone and the other does not: UTC is assumed for the other".to_owned(),
            ),
        ),
        (a, b) if (a == Clock::Seconds) != (b == Clock::Seconds) => {
            let said = "one log has clock times and the other seconds: if their origins differ, \
                --align-clocks estimates the shift";
            (0, Some(said.to_owned()))
        }
        _ => (0, None),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;

    #[test]
    fn times_of_day_go_on_after_midnight() {
        let mut reader = ClockReader::of("23:59:59.5").unwrap();
        let read: Vec<String> = ["23:59:59.5", "00:00:00.1", "00:00:01"]
            .iter()
            .map(|cell| reader.seconds(cell).unwrap())
            .collect();
        assert_eq!(read, ["86399.500000000", "86400.100000000", "86401.000000000"]);
        // A stamp that is a little earlier is not of the next day: it is reported as time that runs backwards.
        assert_eq!(reader.seconds("00:00:00.9").unwrap(), "86400.900000000");
        assert!(reader.seconds("1.5").is_err() && ClockReader::of("1.5").is_none());
        assert!(ClockReader::of("03/04/2026 09:15:01").unwrap().ns("03/04/2026 09:15:01").is_err());
    }

    #[test]
    fn the_unit_of_a_step_is_known_where_one_alone_makes_sense() {
        let of = |step: f64| {
            let cells: Vec<String> = (0..5).map(|k| (1000.0 + step * f64::from(k)).to_string()).collect();
            unit_of_steps(&cells.iter().map(String::as_str).collect::<Vec<_>>()).map(|(unit, _)| unit)
        };
        assert_eq!(of(0.004), Some("_s"));
        assert_eq!(of(12.0), Some("_ms"));
        assert_eq!(of(4000.0), Some("_us"));
        assert_eq!(of(4e6), Some("_ns"));
        // 1 kHz in ms, or a pose a second.
        assert_eq!((of(1.0), of(0.0), of(1e12)), (None, None, None));
    }

    #[test]
    fn two_streams_are_brought_onto_one_day() {
        let hour = DAY_NS / 24;
        let at = |hours: i64| (hours * hour, hours * hour + 1);
        // 23 h and the hour after midnight.
        assert_eq!(to_common([Clock::Midnight; 2], [at(23), at(0)]).0, DAY_NS);
        assert_eq!(to_common([Clock::Midnight; 2], [at(9), at(10)]), (0, None));
        let days = 20_516 * DAY_NS;
        let dated = (days + 9 * hour, days + 9 * hour + 1);
        assert_eq!(to_common([Clock::Midnight, Clock::Date], [at(9), dated]).0, -days);
        assert_eq!(to_common([Clock::Date; 2], [dated, dated]), (0, None));
        assert!(
            to_common([Clock::Seconds, Clock::Date], [at(0), dated]).1.unwrap().contains("--align-clocks")
        );
    }
}
