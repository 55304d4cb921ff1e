//! Stamps → seconds from an origin that moves along: no stream is too long for double precision.

/// Nanoseconds in a second.
pub(crate) const NS_PER_S: f64 = 1e9;
/// No stamp is further from its clock's zero, ns: 95 years.
pub(crate) const MOST_NS: u64 = 3_000_000_000_000_000_000;

/// Whether a number of nanoseconds can be a stamp.
pub(crate) fn is_stamp(stamp_ns: i64) -> bool {
    stamp_ns.unsigned_abs() <= MOST_NS
}

/// Seconds from an origin to a stamp; both are stamps.
pub(crate) fn seconds(stamp_ns: i64, origin_ns: i64) -> f64 {
    (stamp_ns - origin_ns) as f64 / NS_PER_S
}

/// The stamp at this many seconds from an origin.
pub(crate) fn stamp(time_s: f64, origin_ns: i64) -> i64 {
    origin_ns.saturating_add((time_s * NS_PER_S).round() as i64)
}
