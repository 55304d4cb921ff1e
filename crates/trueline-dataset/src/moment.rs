//! Clock times and dates, as programs write them in place of a number of seconds.
//!
//! | written | meaning |
//! |---|---|
//! | `14:03:12.3450`, `14:03:12,345`, `14:03:12:345`, `2:03:12.345 PM` | time of day |
//! | `2026-03-04 09:15:01.000064`, `2026-03-04T09:15:01Z`, `…+01:00` | date and time; without a zone of no known one |
//! | `04.03.2026 09:15:01`, `2026/03/04 09:15:01` | likewise: points have the day first, a year in front has the month next |
//! | `13/03/2026 09:15:01` | likewise, where only one order of day and month is possible |

use crate::stamp::parse_nanoseconds;
use jiff::civil::Date;

const SECOND_NS: i64 = 1_000_000_000;
/// Nanoseconds of a day.
pub(crate) const DAY_NS: i64 = 86_400 * SECOND_NS;

/// The time in a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Moment {
    /// Nanoseconds since midnight.
    OfDay(i64),
    /// Nanoseconds since 1970; in UTC if `zone` states it, else by a clock of an unknown zone.
    Dated {
        /// Since 1970-01-01 00:00.
        ns: i64,
        /// Whether the cell names a zone.
        zone: bool,
    },
    /// Day and month are ambiguous.
    Ambiguous,
}

/// The time in a cell; `None` for anything else, a number above all.
pub(crate) fn parse(text: &str) -> Option<Moment> {
    let text = text.trim();
    if !text.contains(':') || !text.starts_with(|c: char| c.is_ascii_digit()) {
        return None;
    }
    let date_end = text.find(['T', ' ']).filter(|&end| !text[..end].contains(':'));
    let Some(end) = date_end else { return of_day(text).map(Moment::OfDay) };
    let (date, clock) = (&text[..end], text[end + 1..].trim());
    let (clock, zone_ns) = split_zone(clock)?;
    let clock_ns = of_day(clock)?;
    match day(date)? {
        Day::Ambiguous => Some(Moment::Ambiguous),
        Day::Since1970(days) => {
            let ns = days.checked_mul(DAY_NS)?.checked_add(clock_ns - zone_ns.unwrap_or(0))?;
            Some(Moment::Dated { ns, zone: zone_ns.is_some() })
        }
    }
}

/// Nanoseconds since midnight of hours, minutes and seconds.
pub(crate) fn of_day(text: &str) -> Option<i64> {
    let upper = text.trim().to_ascii_uppercase();
    let (clock, noon) = match (upper.strip_suffix("AM"), upper.strip_suffix("PM")) {
        (Some(clock), _) => (clock.trim(), Some(0)),
        (_, Some(clock)) => (clock.trim(), Some(12)),
        _ => (upper.as_str(), None),
    };
    let parts: Vec<&str> = clock.split(':').collect();
    let (hour, minute, seconds) = match parts[..] {
        [hour, minute, seconds] => (hour, minute, seconds.replace(',', ".")),
        // Some loggers write the milliseconds behind a fourth colon.
        [hour, minute, seconds, ms] if ms.len() == 3 => (hour, minute, format!("{seconds}.{ms}")),
        _ => return None,
    };
    let whole = |text: &str, below: i64| {
        let digits = (1..=2).contains(&text.len()) && text.bytes().all(|byte| byte.is_ascii_digit());
        text.parse::<i64>().ok().filter(|value| digits && *value < below)
    };
    let hour = match (whole(hour, 24)?, noon) {
        (hour, None) => hour,
        (hour @ 1..=12, Some(noon)) => hour % 12 + noon,
        _ => return None,
    };
    let digits = seconds.bytes().all(|byte| byte.is_ascii_digit() || byte == b'.');
    let seconds_ns = parse_nanoseconds(&seconds, 9).filter(|ns| digits && *ns < 60 * SECOND_NS)?;
    Some((hour * 3600 + whole(minute, 60)? * 60) * SECOND_NS + seconds_ns)
}

/// The clock without its zone, and how far the zone is ahead of UTC, ns.
fn split_zone(clock: &str) -> Option<(&str, Option<i64>)> {
    if let Some(rest) = clock.strip_suffix(['Z', 'z']).or_else(|| clock.strip_suffix("UTC")) {
        return Some((rest.trim(), Some(0)));
    }
    let Some(at) = clock.rfind(['+', '-']) else { return Some((clock, None)) };
    let (rest, sign) = (&clock[..at], if clock[at..].starts_with('-') { -1 } else { 1 });
    let digits: String = clock[at + 1..].chars().filter(|c| *c != ':').collect();
    if !digits.bytes().all(|digit| digit.is_ascii_digit()) {
        return None;
    }
    let number = |text: &str| text.parse::<i64>().ok();
    let (hours, minutes) = match digits.len() {
        2 => (number(&digits)?, 0),
        4 => (number(&digits[..2])?, number(&digits[2..])?),
        _ => return None,
    };
    Some((rest.trim(), Some(sign * (hours * 3600 + minutes * 60) * SECOND_NS)))
}

/// Whether a cell is a day without a time.
pub(crate) fn is_day(text: &str) -> bool {
    day(text).is_some()
}

/// A day as a file writes it.
enum Day {
    Since1970(i64),
    Ambiguous,
}

fn day(text: &str) -> Option<Day> {
    let parts: Vec<&str> = text.split(['-', '/', '.']).collect();
    let [a, b, c] = parts[..] else { return None };
    let number = |text: &str| text.parse::<i16>().ok().filter(|_| text.bytes().all(|b| b.is_ascii_digit()));
    let (first, second) = (number(a)?, number(b)?);
    let (year, month, day) = match (a.len(), c.len()) {
        (4, _) => (first, second, number(c)?),
        (_, 4) if text.contains('.') => (number(c)?, second, first),
        (_, 4) if first > 12 => (number(c)?, second, first),
        (_, 4) if second > 12 => (number(c)?, first, second),
        (_, 4) if first == second => (number(c)?, first, second),
        (_, 4) => return Some(Day::Ambiguous),
        _ => return None,
    };
    since_1970(year, month, day).map(Day::Since1970)
}

/// Days from 1970-01-01 to a date; `None` if there is no such date.
pub(crate) fn since_1970(year: i16, month: i16, day: i16) -> Option<i64> {
    let date = Date::new(year, i8::try_from(month).ok()?, i8::try_from(day).ok()?).ok()?;
    let epoch = Date::new(1970, 1, 1).ok()?;
    Some(i64::from(date.duration_since(epoch).as_hours() as i32 / 24))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 2026-03-04 is 20516 days after 1970-01-01: `date -u -d 2026-03-04 +%s` is 1772582400.
    const MIDNIGHT_S: i64 = 1_772_582_400;

    #[test]
    fn clock_times_of_every_writing() {
        let ns = 50_592_345_000_000;
        for text in ["14:03:12.345", "14:03:12,3450", "14:03:12:345", "2:03:12.345 PM", "02:03:12.345pm"] {
            assert_eq!(parse(text), Some(Moment::OfDay(ns)), "{text}");
        }
        assert_eq!(parse("12:00:01 AM"), Some(Moment::OfDay(1_000_000_000)));
        for text in [
            "24:00:00",
            "14:60:00",
            "14:03",
            "14:03:60",
            "x:03:12",
            "1.5",
            "",
            "14:03:-1",
            "13:00:00 PM",
            "1 Naht: Nord-Süd",
        ] {
            assert_eq!(parse(text), None, "{text}");
        }
    }

    #[test]
    fn dates_of_every_writing_are_one_moment() {
        let at = |seconds: i64, zone| Some(Moment::Dated { ns: (MIDNIGHT_S + seconds) * SECOND_NS, zone });
        for text in
            ["2026-03-04 09:15:01", "2026-03-04T09:15:01.000", "04.03.2026 09:15:01", "2026/03/04 09:15:01"]
        {
            assert_eq!(parse(text), at(33_301, false), "{text}");
        }
        assert_eq!(parse("2026-03-04T09:15:01Z"), at(33_301, true));
        assert_eq!(parse("2026-03-04T09:15:01+01:00"), at(29_701, true));
        assert_eq!(parse("2026-03-04 09:15:01-0730"), at(60_301, true));
        // Either one order of day and month is possible, or both mean the same day, or neither can be determined.
        assert_eq!(parse("13/03/2026 00:00:00"), parse("2026-03-13 00:00:00"));
        assert_eq!(parse("03/13/2026 00:00:00"), parse("2026-03-13 00:00:00"));
        assert_eq!(parse("03/04/2026 09:15:01"), Some(Moment::Ambiguous));
        for text in ["2026-02-30 00:00:00", "2026-13-01 00:00:00", "26-03-04 00:00:00", "2026-03-04"] {
            assert_eq!(parse(text), None, "{text}");
        }
    }
}
