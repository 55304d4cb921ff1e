//! Counters that wrap: after the largest number of their 16 or 32 bit the smallest follows.

/// Bits of counters.
const BITS: [i32; 2] = [16, 32];
/// At a wrap the encoder goes at most so many times as far as at any other step, and so many counts more: else the counter was set back.
const LONGER: f64 = 4.0;
const FURTHER: f64 = 2.0;

/// How a counter wraps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Wrap {
    /// Counts from one turn to the next.
    modulus: f64,
}

impl Wrap {
    /// That of stamped counts, which it makes go on beyond each wrap; `None` of counts that do not wrap.
    pub(crate) fn of(rows: &mut [(i64, f64)]) -> Option<Self> {
        let mut counters = BITS.into_iter().map(|bits| Self { modulus: 2_f64.powi(bits) });
        let wrap = counters.find(|wrap| wrap.is_in(rows))?;
        let mut turns = 0.0;
        let mut last = rows.first()?.1;
        for (_, count) in rows {
            let shown = *count;
            turns -= ((shown - last) / wrap.modulus).round();
            *count += turns * wrap.modulus;
            last = shown;
        }
        Some(wrap)
    }

    /// Whether all counts are within a counter's range, and its wraps are steps like all others.
    fn is_in(self, rows: &[(i64, f64)]) -> bool {
        let counts = || rows.iter().map(|(_, count)| *count);
        let is_within = |least: f64| counts().all(|count| (least..least + self.modulus).contains(&count));
        if !is_within(0.0) && !is_within(-0.5 * self.modulus) {
            return false;
        }
        let (mut usual, mut at_wraps) = (0.0_f64, None::<f64>);
        for (last, count) in counts().zip(counts().skip(1)) {
            let turns = ((count - last) / self.modulus).round();
            let step = (count - last - turns * self.modulus).abs();
            if turns == 0.0 {
                usual = usual.max(step);
            } else {
                at_wraps = Some(at_wraps.unwrap_or(0.0).max(step));
            }
        }
        at_wraps.is_some_and(|step| step <= LONGER * usual + FURTHER)
    }

    /// The counts between two ends, in either order, that the counter shows as `count`.
    pub(crate) fn turns(self, count: f64, ends: [f64; 2]) -> impl Iterator<Item = f64> {
        let [from, to] = [ends[0].min(ends[1]), ends[0].max(ends[1])];
        let first = ((from - count) / self.modulus).ceil();
        let turns = ((to - count) / self.modulus).floor() - first;
        (0..=turns as i64).map(move |k| count + (first + k as f64) * self.modulus)
    }
}
