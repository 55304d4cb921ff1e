//! Whether a change that stands is over, or has become another one.
//!
//! Over: all welds since it began are as it was (H₁), or those from weld j on are at the calibration again (H₀ⱼ). Both have
//! the same unknowns, so the ratio of their likelihoods, each with its unknowns integrated out, needs only a broad prior of
//! the amount. Summed over j it is the statistic of Shiryaev and Roberts: while the change stands it reaches A by chance
//! once in A welds at the most.
//!
//! Another one: the windows that find a first change, on top of the one that stands.

use super::history::{ALARM_P_LOG10, History, Stretch, near};
use super::regime::{Fault, Regime};
use super::windows::{Sums, WINDOWS, WindowEvidence};
use crate::quadratic::Quadratic;

/// A: an active change is cleared wrongly at most once in this number of welds. An alarm that is cleared
/// wrongly is raised again by the next welds, so the limit may be much less strict than that of a false
/// alarm.
pub(crate) const OVER_ONCE_IN: f64 = 1000.0;

/// One standard deviation of the amount of a change, in units: 10 ms, 5°, 10 mm, 30 %, as good as unknown.
const AMOUNT: f64 = 100.0;

/// Each of this number of last welds is tried as the first good one; of earlier ones, the beginnings of windows.
const EVERY: usize = 16;

/// The first weld after the standing change: at the calibration again, or changed once more; `None` while it stands.
pub(crate) fn end(history: &History<'_>, regimes: &[Regime]) -> Option<usize> {
    let (first, fault) = regimes.last().and_then(|regime| Some((regime.first, regime.fault?)))?;
    let good = history.good_before(regimes, first);
    Standing { history, good: &good, first, fault }.mended().or_else(|| {
        // The first weld of the change may have seen it happen: it has no information on how large it is.
        let part = history.pieces.last().map_or(0, |piece| piece.part);
        changed_again(&Stretch { history, good: good.clone(), first: first + 1, part, standing: Some(fault) })
    })
}

/// The welds since a change, and the good ones before.
struct Standing<'a> {
    history: &'a History<'a>,
    good: &'a Sums,
    first: usize,
    fault: Fault,
}

impl Standing<'_> {
    /// The most likely first good weld, if the sum over all of them confirms it.
    fn mended(&self) -> Option<usize> {
        let end = self.history.pieces.len();
        let most = (end - self.first).checked_sub(1)?;
        let stands = self.ln_likelihood(end)?;
        let gain = |length: usize| Some((length, self.ln_likelihood(end - length)? - stands));
        let long = WINDOWS.into_iter().filter(|length| *length > EVERY);
        let tried: Vec<(usize, f64)> =
            (1..=EVERY).chain(long).filter(|length| *length <= most).filter_map(gain).collect();
        if tried.iter().map(|(_, gain)| gain.exp()).sum::<f64>() < OVER_ONCE_IN {
            return None;
        }
        let best =
            |all: &[(usize, f64)]| all.iter().max_by(|a, b| a.1.total_cmp(&b.1)).map(|(length, _)| *length);
        let about = best(&tried)?;
        let between: Vec<(usize, f64)> = near(about, most).into_iter().filter_map(gain).collect();
        Some(end - if about > EVERY { best(&between)? } else { about })
    }

    /// ln of the likelihood if the change lasts up to before weld j.
    fn ln_likelihood(&self, j: usize) -> Option<f64> {
        let Fault { kind, part, .. } = self.fault;
        let changed = self.history.sums(self.first..j);
        let unchanged = self.good.with(&self.history.sums(j..self.history.pieces.len()));
        let evidence = WindowEvidence::of(&unchanged, &changed, part, self.history.prior);
        integrated(evidence.about(kind), self.history.dispersion(part, kind))
    }
}

fn changed_again(since: &Stretch<'_>) -> Option<usize> {
    let most = since.count().checked_sub(1)?;
    let lengths: Vec<usize> = WINDOWS.into_iter().filter(|length| *length <= most).collect();
    let found = since.changes(&lengths);
    let (best, length) = found.iter().min_by(|a, b| a.0.p_log10.total_cmp(&b.0.p_log10))?;
    if best.p_log10 > ALARM_P_LOG10 {
        return None;
    }
    let all = since.changes(&near(*length, most));
    let own = all.iter().filter(|(change, _)| change.kind == best.kind);
    let (_, length) = own.max_by(|a, b| a.0.explained.total_cmp(&b.0.explained))?;
    Some(since.history.pieces.len() - length)
}

/// ln of a likelihood integrated over the amount δ, up to a constant: ½ bᵀ H⁻¹ b − ½ ln |H|, where H has the prior.
fn integrated(evidence: Quadratic, dispersion: f64) -> Option<f64> {
    let mut matrix = evidence.matrix / dispersion;
    let vector = evidence.vector / dispersion;
    for k in 0..matrix.nrows() {
        matrix[(k, k)] += AMOUNT.powi(-2);
    }
    let root = matrix.cholesky()?;
    let explained = vector.dot(&root.solve(&vector));
    let half_ln_determinant: f64 = root.l_dirty().diagonal().iter().map(|x| x.ln()).sum();
    Some(0.5 * explained - half_ln_determinant)
}
