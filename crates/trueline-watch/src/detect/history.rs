//! All welds of a calibration, and changes between some of them and the others.

use super::change::{Change, Confidence};
use super::piece::PieceInformation;
use super::regime::{Fault, Regime, is_good};
use super::scatter::Scatter;
use super::windows::{Standing, Sums, WindowEvidence};
use crate::parameters::Kind;
use crate::quadratic::Quadratic;
use std::ops::Range;

/// An alarm is raised at this log₁₀ probability of the most significant of all windows and kinds. It is meant for one false
/// alarm in 100,000 pieces: windows that overlap count as some two independent ones a piece. The study `false_alarms`
/// measures it.
pub const ALARM_P_LOG10: f64 = -6.25;

/// Welds of one calibration in order of time; the last is judged.
#[derive(Clone, Copy)]
pub struct History<'a> {
    /// Their evidence.
    pub pieces: &'a [PieceInformation],
    /// Uncertainty of the calibration itself.
    pub prior: &'a Quadratic,
    /// Scatter of each part, once learnt.
    pub scatters: &'a [Option<Scatter>],
    /// The regimes of the welds before the last, in order; none: all of them are at the calibration.
    pub regimes: &'a [Regime],
}

impl History<'_> {
    /// Sums over the welds that are named.
    pub(crate) fn sums(&self, welds: impl Iterator<Item = usize>) -> Sums {
        let mut sums = Sums::nothing(self.scatters.len());
        welds.filter_map(|weld| self.pieces.get(weld)).for_each(|piece| sums.add(piece));
        sums
    }

    /// Sums over the welds before one that are at the calibration.
    pub(crate) fn good_before(&self, regimes: &[Regime], weld: usize) -> Sums {
        self.sums((0..weld).filter(|weld| is_good(regimes, *weld)))
    }

    /// Variance of single pieces relative to their evidence about a kind.
    pub(crate) fn dispersion(&self, part: usize, kind: Kind) -> f64 {
        self.scatters.get(part).and_then(Option::as_ref).map_or(1.0, |s| s.dispersion[kind as usize])
    }

    fn change(&self, evidence: &WindowEvidence, part: usize, kind: Kind) -> Change {
        let scatter = self.scatters.get(part).and_then(Option::as_ref);
        let known = Confidence {
            noise_freedom: evidence.freedom,
            taught_by: scatter.map_or(0, |s| s.pieces),
            dispersion: self.dispersion(part, kind),
            pieces: evidence.pieces,
        };
        Change::of(kind, &evidence.about(kind), evidence.within(kind).as_ref(), known)
    }
}

/// Welds up to the last one, one after the other, that are cut into those before and those after a change.
pub(crate) struct Stretch<'a> {
    /// All welds.
    pub history: &'a History<'a>,
    /// Good welds before the stretch: always before the change.
    pub good: Sums,
    /// The first weld of the stretch.
    pub first: usize,
    /// The part that may be at another place.
    pub part: usize,
    /// The standing change of the stretch; another one is searched on top of it.
    pub standing: Option<Fault>,
}

impl Stretch<'_> {
    /// Number of welds.
    pub(crate) fn count(&self) -> usize {
        self.history.pieces.len().saturating_sub(self.first)
    }

    /// Changes of every kind that the last welds show, by how many they are: rising lengths, at least one and at most all.
    pub(crate) fn changes(&self, lengths: &[usize]) -> Vec<(Change, usize)> {
        let end = self.history.pieces.len();
        let total = self.history.sums(self.first..end);
        let mut inside = self.history.sums(std::iter::empty());
        let mut from = end;
        let mut found = Vec::new();
        for &length in lengths {
            for weld in (end - length..from).rev() {
                inside.add(&self.history.pieces[weld]);
            }
            from = end - length;
            let evidence = self.evidence(&total.without(&inside), &inside);
            let of = |kind| self.history.change(&evidence, self.part, kind);
            found.extend(Kind::ALL.map(|kind| (of(kind), length)));
        }
        found
    }

    /// A change of one kind between some welds of the stretch and others, with the good ones before.
    pub(crate) fn change_between(&self, before: Range<usize>, after: Range<usize>, kind: Kind) -> Change {
        let [before, after] = [before, after].map(|range| self.history.sums(range));
        self.history.change(&self.evidence(&before, &after), self.part, kind)
    }

    fn evidence(&self, own_before: &Sums, inside: &Sums) -> WindowEvidence {
        let prior = self.history.prior;
        match self.standing {
            Some(Fault { kind, part, .. }) => {
                let standing = Standing { sums: own_before, kind, part };
                WindowEvidence::beyond(Some(standing), &self.good, inside, self.part, prior)
            }
            None => WindowEvidence::of(&self.good.with(own_before), inside, self.part, prior),
        }
    }
}

/// Lengths between the windows before and after a tried one, at most this number.
pub(crate) fn near(length: usize, most: usize) -> Vec<usize> {
    (length / 2 + usize::from(length == 1)..=(2 * length).min(most)).collect()
}
