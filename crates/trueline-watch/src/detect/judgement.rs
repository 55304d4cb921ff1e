//! The verdict on the last weld, by all that came before.
//!
//! The welds are cut into regimes ([`super::regime`]). If the last one is at the calibration, windows of its last
//! welds are compared with all good welds before. For a standing change the first question is whether it is over or
//! has become another one (`detect::over`). Otherwise its kind, date and amount are estimated again with one weld
//! more.

use super::change::Change;
use super::history::{ALARM_P_LOG10, History, Stretch, near};
use super::inside::{self, CutWeld};
use super::links::{self, BeforeAndAfter, Link};
use super::over;
use super::regime::{Fault, Regime, is_good, out_since};
use super::windows::WINDOWS;
use crate::parameters::Kind;

/// The limit of an alarm for a cut inside a weld. There are sixty cuts by kind. Together they get a third of
/// the false alarms, whatever their correlation.
pub(crate) const INSIDE_P_LOG10: f64 = -7.25;

/// Required lead of the best cut inside a weld over the best window of whole welds, log₁₀: there are more
/// cuts than windows.
const CUT_MUST_GAIN: f64 = 2.0;

/// A change that stands is taken back above this log₁₀ probability: as much above the limit of an alarm as it takes to end one,
/// [`over::OVER_ONCE_IN`].
const TAKEN_BACK_P_LOG10: f64 = ALARM_P_LOG10 + 3.0;

/// Two kinds cannot be separated if the sums of squares they explain, less their dimensions, differ by less: three standard
/// deviations.
const TOLD_APART: f64 = 9.0;

/// When something changed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Since {
    /// Index of the first weld after the change, or of the weld in which it happened.
    pub piece: usize,
    /// Time inside that weld, s after its first robot sample; `None` where the change lies between two welds.
    pub inside_s: Option<f64>,
}

/// Something changed.
#[derive(Clone, Debug)]
pub struct Alarm {
    /// The change and its amount.
    pub change: Change,
    /// Since when.
    pub since: Since,
    /// Index of the first weld that was not at the calibration, with none at it since: before `since` if one
    /// change has become another.
    pub out_since: usize,
    /// Index of the part that lies elsewhere, if that is it.
    pub part: usize,
    /// Kinds that would explain it nearly as well.
    pub not_told_apart: Vec<Kind>,
    /// The links of the cell that may have moved, one or more.
    pub links: Vec<Link>,
}

/// State after a weld.
#[derive(Clone, Debug)]
pub struct Judgement {
    /// Something changed.
    pub alarm: Option<Alarm>,
    /// log₁₀ probability of the most significant change of each kind, in the order of [`Kind::ALL`].
    pub p_log10: [f64; 4],
    /// The regimes up to this weld.
    pub regimes: Vec<Regime>,
    /// Index of the first weld that is at the calibration again, if this weld ended a change; `None` also if
    /// a change was withdrawn because later welds do not confirm it.
    pub good_since: Option<usize>,
    /// Whether the alarm is about another change than that of the weld before.
    pub is_another: bool,
}

/// Judges the last weld; `cut` is that weld in stretches, if it is tested inside as well.
#[must_use]
pub fn judge(history: &History<'_>, cut: Option<&CutWeld<'_>>) -> Judgement {
    let mut regimes = history.regimes.to_vec();
    if regimes.is_empty() {
        regimes.push(Regime::good(0));
    }
    if history.pieces.is_empty() {
        return Judgement { alarm: None, p_log10: [0.0; 4], regimes, good_since: None, is_another: false };
    }
    let end = over::end(history, &regimes);
    regimes.extend(end.map(Regime::good));
    let mut judging = Judging { history, regimes, p_log10: [0.0; 4] };
    let current = judging.regimes.last().copied().unwrap_or(Regime::good(0));
    let alarm = match current.fault {
        Some(fault) => judging.standing(current, fault),
        None => judging.found(current.first, end.is_some(), cut),
    };
    let Judging { regimes, p_log10, .. } = judging;
    let is_another = end.is_some() && alarm.is_some();
    Judgement { good_since: end.filter(|_| !is_another), alarm, p_log10, regimes, is_another }
}

struct Judging<'a> {
    history: &'a History<'a>,
    regimes: Vec<Regime>,
    p_log10: [f64; 4],
}

impl<'a> Judging<'a> {
    fn last(&self) -> usize {
        self.history.pieces.len() - 1
    }

    fn stretch(&self, first: usize, part: usize) -> Stretch<'a> {
        let good = self.history.good_before(&self.regimes, first);
        Stretch { history: self.history, good, first, part, standing: None }
    }

    /// A change since the welds are at the calibration. `ended`: they have only just been found to have changed, so all of
    /// them are one window.
    fn found(&mut self, first: usize, ended: bool, cut: Option<&CutWeld<'_>>) -> Option<Alarm> {
        let part = self.history.pieces[self.last()].part;
        let stretch = self.stretch(first, part);
        let most = stretch.count();
        let windows: Vec<usize> = WINDOWS.into_iter().filter(|length| *length <= most).collect();
        let lengths = if ended { vec![most] } else { windows };
        let found = stretch.changes(&lengths);
        let best = strongest(&found);
        let inside = cut.filter(|_| !ended).and_then(|weld| {
            let before = stretch.good.with(&self.history.sums(first..self.last()));
            inside::strongest(weld, &before.level(self.history.prior))
        });
        let limit = best.map_or(0.0, |(change, _)| change.p_log10);
        let inside = inside.filter(|(change, _)| change.p_log10 < limit - CUT_MUST_GAIN);
        let named = match (&inside, best) {
            (None, Some((best, length))) if best.p_log10 <= ALARM_P_LOG10 => {
                let lengths = if ended { vec![most] } else { near(length, most) };
                named(&stretch, &stretch.changes(&lengths), best.kind, None)
            }
            _ => None,
        };
        self.note(&found);
        if let Some((change, at_s)) = inside {
            self.note(&[(change.clone(), 1)]);
            let raised = change.p_log10 <= INSIDE_P_LOG10;
            let since = Since { piece: self.last(), inside_s: Some(at_s) };
            return raised.then(|| self.raised(change, since, Vec::new()));
        }
        named.map(|(change, since, others)| self.raised(change, since, others))
    }

    fn raised(&mut self, change: Change, since: Since, not_told_apart: Vec<Kind>) -> Alarm {
        let part = self.history.pieces[self.last()].part;
        let fault = Fault { kind: change.kind, part, raised: self.last() };
        self.regimes.push(Regime { first: since.piece, inside_s: since.inside_s, fault: Some(fault) });
        self.alarm(change, since, not_told_apart)
    }

    fn alarm(&self, change: Change, since: Since, not_told_apart: Vec<Kind>) -> Alarm {
        let out_since = out_since(&self.regimes).unwrap_or(since.piece);
        let part = self.regimes.last().and_then(|regime| regime.fault).map_or(0, |fault| fault.part);
        let named: Vec<Kind> = not_told_apart.iter().copied().chain([change.kind]).collect();
        // A part that an axis displaces is elsewhere at each angle: the detector may take that for one change after another.
        let first = out_since + usize::from(out_since == since.piece && since.inside_s.is_some());
        let good = (0..first).filter(|weld| is_good(&self.regimes, *weld));
        let welds = BeforeAndAfter {
            before: good.map(|weld| &self.history.pieces[weld]).collect(),
            after: &self.history.pieces[first.min(self.last())..],
            prior: self.history.prior,
            part,
        };
        let links = links::of(&welds, &named, |kind| self.history.dispersion(part, kind), TOLD_APART);
        Alarm { change, since, out_since, part, not_told_apart, links }
    }

    /// A change that stands, with one weld more. Its start is at most as long before the first sign as the detection took,
    /// and before the detection.
    fn standing(&mut self, current: Regime, fault: Fault) -> Option<Alarm> {
        let before = self.regimes.iter().rev().nth(1).copied();
        let took = fault.raised + 1 - current.first;
        let earliest = before
            .filter(|regime| regime.fault.is_none())
            .map(|regime| regime.first.max(current.first.saturating_sub(took)));
        let earliest = earliest.unwrap_or(current.first);
        let latest = earliest.max(match (before, current.inside_s) {
            (Some(Regime { fault: Some(_), .. }), _) => current.first,
            (_, Some(_)) => fault.raised + 1,
            (_, None) => fault.raised,
        });
        let part = match fault.kind {
            Kind::Seam => fault.part,
            _ => self.history.pieces[self.last()].part,
        };
        let stretch = self.stretch(earliest, part);
        let shortest = (self.last() + 1).saturating_sub(latest).max(1);
        let found = stretch.changes(&(shortest..=stretch.count()).collect::<Vec<_>>());
        let best = strongest(&found).filter(|(change, _)| change.p_log10 <= TAKEN_BACK_P_LOG10);
        let dated = current.inside_s.map(|_| Since { piece: current.first, inside_s: current.inside_s });
        let named = best.and_then(|(best, _)| named(&stretch, &found, best.kind, dated));
        self.note(&found);
        self.regimes.pop();
        let Some((change, since, others)) = named else {
            // No change after all: its welds are good ones.
            if self.regimes.last().is_none_or(|regime| regime.fault.is_some()) {
                self.regimes.push(Regime::good(current.first));
            }
            return None;
        };
        let fault = Fault { kind: change.kind, part, raised: fault.raised };
        self.regimes.push(Regime { first: since.piece, inside_s: since.inside_s, fault: Some(fault) });
        Some(self.alarm(change, since, others))
    }

    fn note(&mut self, found: &[(Change, usize)]) {
        for (change, _) in found {
            let own = &mut self.p_log10[change.kind as usize];
            *own = own.min(change.p_log10);
        }
    }
}

fn strongest(found: &[(Change, usize)]) -> Option<(&Change, usize)> {
    let best = found.iter().min_by(|a, b| a.0.p_log10.total_cmp(&b.0.p_log10));
    best.map(|(change, length)| (change, *length))
}

/// The change of a kind, located to a single piece, and the kinds that it may be confused with.
fn named(
    stretch: &Stretch<'_>,
    all: &[(Change, usize)],
    kind: Kind,
    dated: Option<Since>,
) -> Option<(Change, Since, Vec<Kind>)> {
    let (own, length) = all
        .iter()
        .filter(|(change, _)| change.kind == kind)
        .max_by(|a, b| a.0.explained.total_cmp(&b.0.explained))?;
    let worth = |change: &Change| change.explained - change.dimensions as f64;
    let rivals: Vec<&Change> = all
        .iter()
        .filter(|(change, other)| other == length && change.kind != own.kind)
        .map(|(change, _)| change)
        .filter(|change| worth(change) > worth(own) - TOLD_APART)
        .collect();
    // A part at another place harms no calibration, a displaced sensor harms every weld: in doubt the sensor's bracket
    // must be checked.
    let doubt = rivals.iter().find(|rival| own.kind == Kind::Seam && rival.kind == Kind::Bracket);
    let change = doubt.map_or_else(|| own.clone(), |bracket| (*bracket).clone());
    let since = since(dated, stretch.history.pieces.len() - length);
    let change = sized(stretch, &change, since);
    let kinds = rivals.iter().map(|rival| rival.kind).chain([own.kind]);
    let mut not_told_apart: Vec<Kind> = kinds.filter(|kind| *kind != change.kind).collect();
    not_told_apart.sort_unstable();
    Some((change, since, not_told_apart))
}

/// Time of a change, if `first` is the first whole weld after it. A weld with a change in its middle
/// resembles those before it or those after it: the finding inside it stays.
fn since(dated: Option<Since>, first: usize) -> Since {
    let dated = dated.filter(|dated| dated.piece == first || dated.piece + 1 == first);
    dated.unwrap_or(Since { piece: first, inside_s: None })
}

/// The same change with its amount from welds that lie wholly before or wholly after it. The weld in which it
/// happened shows an amount between none and all of it. Two welds can be that one: the first that resembles
/// those after, and the one before it.
fn sized(stretch: &Stretch<'_>, change: &Change, since: Since) -> Change {
    let count = stretch.history.pieces.len();
    let (before, after) = match since {
        Since { piece, inside_s: Some(_) } => (piece, piece + 1),
        Since { piece, inside_s: None } => (piece.saturating_sub(1), piece + 1),
    };
    // The only weld after a change alone determines its size.
    let after = if after < count { after } else { count - 1 };
    let before = stretch.first..before.max(stretch.first);
    change.with_amount_of(stretch.change_between(before, after..count, change.kind))
}
