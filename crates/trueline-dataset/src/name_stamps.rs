//! Meaning of the numbers in pictures' names: a stamp, a date, or seconds and their fraction.

use crate::error::{Error, Problem};
use crate::log_problem::LogProblem;
use crate::moment::{DAY_NS, since_1970};
use std::path::{Path, PathBuf};

/// Content of pictures' names.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NameStamps {
    /// The last number in each.
    Numbers,
    /// Year, month, day, hour, minute, second and its fraction: nanoseconds since 1970 by a clock of no known zone.
    Dates,
    /// Seconds and nanoseconds or microseconds.
    SecondsAndFraction,
}

/// The number of each picture: with a unit, ns of that many for each. Dates and fractions of seconds are ns for any unit.
///
/// # Errors
/// Names without a number, and those with several changing numbers, of which the last does not rise with the others.
pub(crate) fn of(
    paths: Vec<PathBuf>,
    unit_ns: Option<i64>,
) -> Result<(Vec<(i64, PathBuf)>, NameStamps), Error> {
    let groups: Vec<Vec<&str>> = paths.iter().map(|path| digits(path)).collect();
    if let Some(dated) = all(&groups, date_ns).filter(|_| fractions_are_padded(&groups)) {
        drop(groups);
        return Ok((dated.into_iter().zip(paths).collect(), NameStamps::Dates));
    }
    if unit_ns.is_some()
        && let Some(split) = all(&groups, seconds_and_fraction_ns)
    {
        drop(groups);
        return Ok((split.into_iter().zip(paths).collect(), NameStamps::SecondsAndFraction));
    }
    let mut numbered = Vec::new();
    for (path, groups) in paths.iter().zip(&groups) {
        let none = || Error::in_file(path, Problem::NoNumberInName);
        let last: i64 = groups.last().and_then(|last| last.parse().ok()).ok_or_else(none)?;
        numbered.push((last.checked_mul(unit_ns.unwrap_or(1)).ok_or_else(none)?, path.clone()));
    }
    expect_one_order(&numbered)?;
    Ok((numbered, NameStamps::Numbers))
}

fn all(groups: &[Vec<&str>], read: impl Fn(&[&str]) -> Option<i64>) -> Option<Vec<i64>> {
    groups.iter().map(|groups| read(groups)).collect::<Option<Vec<i64>>>().filter(|all| !all.is_empty())
}

/// The groups of digits in a file's name without its ending.
fn digits(path: &Path) -> Vec<&str> {
    let name = path.file_stem().and_then(|name| name.to_str()).unwrap_or_default();
    name.split(|c: char| !c.is_ascii_digit()).filter(|part| !part.is_empty()).collect()
}

/// A date: 2026 03 04 09 15 01 864, 20260304 091501 864, or all in one number.
fn date_ns(groups: &[&str]) -> Option<i64> {
    let at = groups.iter().position(|group| is_year(group))?;
    let mut text = groups[at..].iter();
    let mut clock: Vec<i64> = Vec::new();
    let mut fraction = "";
    for group in text.by_ref() {
        // Year 4, month, day, hour, minute and second 2 digits each, together or apart.
        let mut rest = *group;
        while clock.len() < 6 && !rest.is_empty() {
            let length = if clock.is_empty() { 4 } else { 2 };
            clock.push(rest.get(..length)?.parse().ok()?);
            rest = &rest[length..];
        }
        if clock.len() == 6 {
            fraction = rest;
            break;
        }
    }
    if fraction.is_empty() {
        fraction = text.next().copied().unwrap_or("");
    }
    let [year, month, day, hour, minute, second] = clock[..] else { return None };
    if text.next().is_some() || fraction.len() > 9 || hour > 23 || minute > 59 || second > 59 {
        return None;
    }
    let days = since_1970(i16::try_from(year).ok()?, month as i16, day as i16)?;
    let fraction_ns: i64 = format!("{fraction:0<9}").parse().ok()?;
    Some(days * DAY_NS + (hour * 3600 + minute * 60 + second) * 1_000_000_000 + fraction_ns)
}

fn is_year(group: &str) -> bool {
    let year = group.get(..4).and_then(|year| year.parse::<i64>().ok());
    matches!(group.len(), 4 | 8 | 12 | 14 | 17 | 20 | 23)
        && year.is_some_and(|year| (1990..2100).contains(&year))
}

/// Whether the last groups have the same number of digits: `_9` may be 0.9 s or 9 ms.
fn fractions_are_padded(groups: &[Vec<&str>]) -> bool {
    let length = |groups: &Vec<&str>| groups.last().map_or(0, |last| last.len());
    groups.windows(2).all(|two| length(&two[0]) == length(&two[1]) && two[0].len() == two[1].len())
}

/// Seconds since 1970 in ten digits, and nine digits of nanoseconds or six of microseconds.
fn seconds_and_fraction_ns(groups: &[&str]) -> Option<i64> {
    let [.., seconds, fraction] = groups else { return None };
    if !(seconds.len() == 10 && matches!(fraction.len(), 6 | 9)) {
        return None;
    }
    let fraction_ns: i64 = format!("{fraction:0<9}").parse().ok()?;
    seconds.parse::<i64>().ok()?.checked_mul(1_000_000_000)?.checked_add(fraction_ns)
}

/// Fails where another number that changes from name to name puts the pictures into another order than the last one.
fn expect_one_order(numbered: &[(i64, PathBuf)]) -> Result<(), Error> {
    let mut order: Vec<(&i64, Vec<&str>, &PathBuf)> =
        numbered.iter().map(|(number, path)| (number, digits(path), path)).collect();
    order.sort();
    for two in order.windows(2) {
        let ([(_, before, first), (_, after, second)], same) =
            ([&two[0], &two[1]], two[0].1.len() == two[1].1.len());
        let earlier = |(a, b): (&&str, &&str)| a.parse::<u64>().ok() > b.parse::<u64>().ok();
        let others = before.len().saturating_sub(1);
        if same && before[..others].iter().zip(&after[..others]).any(earlier) {
            let name = |path: &Path| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            let problem = LogProblem::SeveralNumbers { one: name(first), other: name(second) };
            return Err(Error::in_file(first, problem.into()));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;

    fn read(names: &[&str]) -> Result<(Vec<i64>, NameStamps), String> {
        let paths = names.iter().map(PathBuf::from).collect();
        let (numbered, kind) = of(paths, Some(1_000_000)).map_err(|error| error.to_string())?;
        Ok((numbered.into_iter().map(|(ns, _)| ns).collect(), kind))
    }

    #[test]
    fn dates_in_names_are_stamps() {
        // `date -u -d "2026-03-04 09:15:01" +%s` is 1772615701.
        let expected = vec![1_772_615_701_864_000_000, 1_772_615_702_044_000_000];
        for names in [
            ["2026-03-04_09_15_01_864.png", "2026-03-04_09_15_02_044.png"],
            ["20260304_091501_864.png", "20260304_091502_044.png"],
            ["cam0-20260304T091501.864.png", "cam0-20260304T091502.044.png"],
            ["20260304091501864.png", "20260304091502044.png"],
            ["2026.03.04 09.15.01.864.bmp", "2026.03.04 09.15.02.044.bmp"],
        ] {
            assert_eq!(read(&names), Ok((expected.clone(), NameStamps::Dates)), "{names:?}");
        }
    }

    #[test]
    fn what_could_be_two_stamps_is_refused_and_a_number_is_one() {
        let numbers = |names: &[&str]| read(names).unwrap();
        assert_eq!(
            numbers(&["cam0_12.png", "cam0_33.png"]),
            (vec![12_000_000, 33_000_000], NameStamps::Numbers)
        );
        // A counter beside a stamp rises with it.
        assert_eq!(numbers(&["f1_900.png", "f2_933.png"]).1, NameStamps::Numbers);
        let split = numbers(&["1690000000_900000000.png", "1690000001_000000000.png"]);
        assert_eq!(
            split,
            (vec![1_690_000_000_900_000_000, 1_690_000_001_000_000_000], NameStamps::SecondsAndFraction)
        );
        for names in [
            // Seconds and an unpadded fraction, a day that could be a month, and a counter that starts again.
            ["9_15_1_864.png", "9_15_2_44.png"],
            ["2026-03-04_09_15_01_864.png", "2026-03-04_09_15_02_4.png"],
            ["04-03-2026_09_15_01_864.png", "04-03-2026_09_15_02_044.png"],
        ] {
            assert!(read(&names).unwrap_err().contains("several numbers that change"), "{names:?}");
        }
    }
}
