//! Welds in order of time, cut at the changes between them: stretches at the calibration, and stretches with a difference
//! from it.
//!
//! Knowledge of the calibration and of the fixture comes from the former alone. A mended fault leaves nothing
//! behind: the welds after it are compared with the calibration and with the good welds before it.

use crate::parameters::Kind;

/// Welds between two changes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Regime {
    /// Index of its first weld.
    pub first: usize,
    /// Time inside this weld at which it begins, s after the first robot sample; `None` if it begins between two
    /// welds.
    pub inside_s: Option<f64>,
    /// Difference from the calibration; `None` means none.
    pub fault: Option<Fault>,
}

/// Difference from the calibration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fault {
    /// Its kind.
    pub kind: Kind,
    /// Index of the part at another place, if that is the change.
    pub part: usize,
    /// Index of the weld at which it was found.
    pub raised: usize,
}

impl Regime {
    /// A stretch at the calibration.
    #[must_use]
    pub fn good(first: usize) -> Self {
        Self { first, inside_s: None, fault: None }
    }
}

/// Whether a weld is at the calibration. Of two stretches that begin with the same weld the first is empty.
#[must_use]
pub fn is_good(regimes: &[Regime], weld: usize) -> bool {
    regimes.iter().rfind(|regime| regime.first <= weld).is_none_or(|regime| regime.fault.is_none())
}

/// The first weld of the last stretches between which none was at the calibration; `None` where the last one is.
#[must_use]
pub fn out_since(regimes: &[Regime]) -> Option<usize> {
    let mut end = usize::MAX;
    let mut since = None;
    for regime in regimes.iter().rev() {
        if regime.fault.is_some() {
            since = Some(regime.first);
        } else if regime.first < end {
            break;
        }
        end = regime.first;
    }
    since
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bad(first: usize) -> Regime {
        let fault = Fault { kind: Kind::Timing, part: 0, raised: first };
        Regime { fault: Some(fault), ..Regime::good(first) }
    }

    #[test]
    fn empty_stretches_count_for_nothing() {
        let regimes = [Regime::good(0), bad(4), Regime::good(6), bad(6), bad(9)];
        let good: Vec<usize> = (0..12).filter(|weld| is_good(&regimes, *weld)).collect();
        assert_eq!(good, [0, 1, 2, 3]);
        assert_eq!(out_since(&regimes), Some(4), "no weld was good between");
        assert_eq!(out_since(&[Regime::good(0), bad(4), Regime::good(6), bad(7)]), Some(7));
        assert_eq!(out_since(&[Regime::good(0), bad(4), Regime::good(6)]), None);
        assert!(is_good(&[], 3) && out_since(&[]).is_none());
    }
}
