//! Time stamps: whole nanoseconds, so that an epoch time of ten digits keeps its last microsecond.

use crate::error::Problem;

/// No stamp is further from its clock's zero, ns: 95 years; Unix time gets there in 2065. Three such numbers fit into 64 bits, so that the
/// difference of two stamps can be added to a third.
pub const MOST_NS: i64 = 3_000_000_000_000_000_000;

/// Whether a number of nanoseconds can be a stamp.
#[must_use]
pub fn is_in_range(nanoseconds: i64) -> bool {
    nanoseconds.unsigned_abs() <= MOST_NS.unsigned_abs()
}

/// Fault of a text that [`parse_nanoseconds`] does not take.
#[must_use]
pub(crate) fn problem_of(text: &str) -> Problem {
    let text = text.to_owned();
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() => Problem::NotAStamp { text },
        Ok(_) => Problem::NotFinite { text },
        Err(_) => Problem::NotANumber { text },
    }
}

/// Reads a decimal number times a power of ten as whole nanoseconds, exactly: `scale_digits` is 9 for
/// seconds, 6 for milliseconds, 3 for microseconds, 0 for nanoseconds. Digits below one nanosecond are
/// rounded half away from zero.
///
/// Returns `None` if the text is not a finite decimal number or is further from zero than [`MOST_NS`].
#[must_use]
pub fn parse_nanoseconds(text: &str, scale_digits: usize) -> Option<i64> {
    decimal(text, scale_digits).filter(|nanoseconds| is_in_range(*nanoseconds))
}

fn decimal(text: &str, scale_digits: usize) -> Option<i64> {
    let text = text.trim();
    let (negative, digits) = match text.as_bytes().first()? {
        b'-' => (true, &text[1..]),
        b'+' => (false, &text[1..]),
        _ => (false, text),
    };
    if digits.bytes().any(|b| b == b'e' || b == b'E') {
        return from_scientific(text, scale_digits);
    }
    let (whole, fraction) = digits.split_once('.').unwrap_or((digits, ""));
    if whole.is_empty() && fraction.is_empty() {
        return None;
    }
    let mut value: i64 = 0;
    for byte in whole.bytes() {
        value = value.checked_mul(10)?.checked_add(i64::from(digit(byte)?))?;
    }
    let mut fraction = fraction.bytes();
    for _ in 0..scale_digits {
        let next = fraction.next().map_or(Some(0), digit)?;
        value = value.checked_mul(10)?.checked_add(i64::from(next))?;
    }
    if let Some(byte) = fraction.next() {
        value = value.checked_add(i64::from(digit(byte)? >= 5))?;
    }
    if !fraction.all(|b| b.is_ascii_digit()) {
        return None;
    }
    Some(if negative { -value } else { value })
}

fn digit(byte: u8) -> Option<u8> {
    byte.is_ascii_digit().then(|| byte - b'0')
}

fn from_scientific(text: &str, scale_digits: usize) -> Option<i64> {
    let value = text.parse::<f64>().ok()? * 10f64.powi(i32::try_from(scale_digits).ok()?);
    // 2⁶³ ns is 292 years.
    (value.is_finite() && value.abs() < 9.2e18).then(|| value.round() as i64)
}

/// Nanoseconds as seconds.
#[must_use]
pub fn seconds(nanoseconds: i64) -> f64 {
    nanoseconds as f64 * 1e-9
}

/// When an image was exposed by the robot's clock, ns: its stamp minus the time offset.
#[must_use]
pub fn exposed_ns(stamp_ns: i64, time_offset_s: f64) -> i64 {
    stamp_ns - (time_offset_s * 1e9).round() as i64
}

/// Nanoseconds as a decimal text in seconds, exact.
#[must_use]
pub fn format_seconds(nanoseconds: i64) -> String {
    let sign = if nanoseconds < 0 { "-" } else { "" };
    let magnitude = nanoseconds.unsigned_abs();
    format!("{sign}{}.{:09}", magnitude / 1_000_000_000, magnitude % 1_000_000_000)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stamps_end_where_a_difference_of_two_can_no_longer_be_added_to_a_third() {
        for (text, ns) in [("3000000000", MOST_NS), ("-3000000000", -MOST_NS), ("3e9", MOST_NS)] {
            assert_eq!(parse_nanoseconds(text, 9), Some(ns));
        }
        assert!(MOST_NS.checked_sub(-MOST_NS).and_then(|most| most.checked_add(MOST_NS)).is_some());
        for far in ["3000000000.000000001", "-3000000001", "9223372036.854775807", "3.1e9", "1e30"] {
            assert_eq!(parse_nanoseconds(far, 9), None, "{far}");
            assert!(matches!(problem_of(far), Problem::NotAStamp { .. }), "{far}");
        }
        assert!(!is_in_range(i64::MIN) && !is_in_range(i64::MAX) && is_in_range(-MOST_NS));
    }

    #[test]
    fn decimal_text_is_read_exactly() {
        assert_eq!(parse_nanoseconds("1763689200.123456789", 9), Some(1_763_689_200_123_456_789));
        assert_eq!(parse_nanoseconds("-0.0304914", 6), Some(-30_491));
        assert_eq!(parse_nanoseconds("11.8852", 6), Some(11_885_200));
        assert_eq!(parse_nanoseconds("1.5e-3", 9), Some(1_500_000));
        assert_eq!(parse_nanoseconds("17", 0), Some(17));
        assert_eq!(parse_nanoseconds(".5", 9), Some(500_000_000));
        for bad in ["", ".", "-", "1,5", "nan", "inf", "1.5x", "1.0000000000x", "99999999999999999999"] {
            assert_eq!(parse_nanoseconds(bad, 9), None, "{bad}");
        }
    }

    #[test]
    fn writing_and_reading_keep_every_nanosecond() {
        for ns in [0, 1, -1, 999_999_999, -1_000_000_001, 1_763_689_200_123_456_789] {
            assert_eq!(parse_nanoseconds(&format_seconds(ns), 9), Some(ns));
        }
    }
}
