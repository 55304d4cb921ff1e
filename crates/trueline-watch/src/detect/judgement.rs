//! The verdict on the last weld, by all that came before.

use super::change::{Change, Confidence};
use super::inside::{self, CutWeld};
use super::piece::PieceInformation;
use super::scatter::Scatter;
use super::windows::{Sums, WINDOWS, WindowEvidence};
use crate::parameters::Kind;
use crate::quadratic::Quadratic;

/// An alarm is raised at this log₁₀ probability of the most significant of all windows and kinds. It is meant for one false
/// alarm in 100,000 pieces: windows that overlap count as some two independent ones a piece. The example `false_alarms`
/// measures it.
pub const ALARM_P_LOG10: f64 = -6.25;

/// The same for a cut inside of a weld, of which there are sixty by kind: together they are left a third of the false
/// alarms, whatever their correlation.
pub(crate) const INSIDE_P_LOG10: f64 = -7.25;

/// How much better the best cut inside a weld must be than the best window of whole welds to be believed, log₁₀: there
/// are more cuts than windows.
const CUT_MUST_GAIN: f64 = 2.0;

/// Two kinds are not told apart if the sums of squares they explain, less their dimensions, differ by less: three standard
/// deviations.
const TOLD_APART: f64 = 9.0;

/// Welds of one calibration in order of time; the last is judged.
#[derive(Clone, Copy)]
pub struct History<'a> {
    /// What they say.
    pub pieces: &'a [PieceInformation],
    /// What is known of the calibration itself.
    pub prior: &'a Quadratic,
    /// Scatter of each part, where it has been learnt.
    pub scatters: &'a [Option<Scatter>],
    /// When an alarm that stands began, if that was found to be inside of a weld.
    pub dated: Option<Since>,
}

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
    /// What, and how much.
    pub change: Change,
    /// Since when.
    pub since: Since,
    /// Kinds that would explain it nearly as well.
    pub not_told_apart: Vec<Kind>,
}

/// What is known after a weld.
#[derive(Clone, Debug)]
pub struct Judgement {
    /// Something changed.
    pub alarm: Option<Alarm>,
    /// log₁₀ probability of the most significant change of each kind, in the order of [`Kind::ALL`].
    pub p_log10: [f64; 4],
}

/// Judges the last weld; `cut` is that weld in stretches, where it is tested inside as well.
#[must_use]
pub fn judge(history: &History<'_>, cut: Option<&CutWeld<'_>>) -> Judgement {
    let Some(last) = history.pieces.last() else {
        return Judgement { alarm: None, p_log10: [0.0; 4] };
    };
    let total = sums(history, 0..history.pieces.len());
    let lengths: Vec<usize> = WINDOWS.into_iter().filter(|length| *length <= history.pieces.len()).collect();
    let found = changes(history, &total, last.part, &lengths);
    let mut p_log10 = [0.0_f64; 4];
    for (change, _) in &found {
        let own = &mut p_log10[change.kind as usize];
        *own = own.min(change.p_log10);
    }
    let inside = cut.and_then(|weld| {
        let before = sums(history, 0..history.pieces.len() - 1);
        inside::strongest(weld, &before.level(history.prior))
    });
    let best = found.iter().map(|(change, _)| change.p_log10).fold(0.0, f64::min);
    if let Some((change, at_s)) = inside.filter(|(change, _)| change.p_log10 < best - CUT_MUST_GAIN) {
        let own = &mut p_log10[change.kind as usize];
        *own = own.min(change.p_log10);
        let since = Since { piece: history.pieces.len() - 1, inside_s: Some(at_s) };
        let raised = change.p_log10 <= INSIDE_P_LOG10;
        let alarm = raised.then_some(Alarm { change, since, not_told_apart: Vec::new() });
        return Judgement { alarm, p_log10 };
    }
    let alarm = (best <= ALARM_P_LOG10).then(|| named(history, &total, last.part, &found)).flatten();
    Judgement { alarm, p_log10 }
}

fn sums(history: &History<'_>, range: std::ops::Range<usize>) -> Sums {
    let mut sums = Sums::nothing(history.scatters.len());
    history.pieces[range].iter().for_each(|piece| sums.add(piece));
    sums
}

/// Changes of every kind at the beginning of each window, with the window's length.
fn changes(history: &History<'_>, total: &Sums, part: usize, lengths: &[usize]) -> Vec<(Change, usize)> {
    let mut inside = Sums::nothing(history.scatters.len());
    let mut found = Vec::new();
    let mut next = lengths.iter();
    let mut wanted = next.next();
    for (k, piece) in history.pieces.iter().rev().enumerate() {
        let Some(length) = wanted else { break };
        inside.add(piece);
        if k + 1 == *length {
            let evidence = WindowEvidence::of(&total.without(&inside), &inside, part, history.prior);
            let of = |kind| change(history, &evidence, part, kind);
            found.extend(Kind::ALL.map(|kind| (of(kind), *length)));
            wanted = next.next();
        }
    }
    found
}

fn change(history: &History<'_>, evidence: &WindowEvidence, part: usize, kind: Kind) -> Change {
    let scatter = history.scatters.get(part).and_then(Option::as_ref);
    let known = Confidence {
        noise_freedom: evidence.freedom,
        taught_by: scatter.map_or(0, |s| s.pieces),
        dispersion: scatter.map_or(1.0, |s| s.dispersion[kind as usize]),
        pieces: evidence.pieces,
    };
    Change::of(kind, &evidence.about(kind), evidence.within(kind).as_ref(), known)
}

/// The most significant change, its place found to a single piece, and what could be taken for it.
fn named(history: &History<'_>, total: &Sums, last_part: usize, found: &[(Change, usize)]) -> Option<Alarm> {
    let (best, length) = found.iter().min_by(|a, b| a.0.p_log10.total_cmp(&b.0.p_log10))?;
    // Between the windows before and after the best.
    let shortest = length / 2 + usize::from(*length == 1);
    let lengths: Vec<usize> = (shortest..=(2 * length).min(history.pieces.len())).collect();
    let all = changes(history, total, last_part, &lengths);
    let (own, length) = all
        .iter()
        .filter(|(change, _)| change.kind == best.kind)
        .max_by(|a, b| a.0.explained.total_cmp(&b.0.explained))?;
    let worth = |change: &Change| change.explained - change.dimensions as f64;
    let rivals: Vec<&Change> = all
        .iter()
        .filter(|(change, other)| other == length && change.kind != own.kind)
        .map(|(change, _)| change)
        .filter(|change| worth(change) > worth(own) - TOLD_APART)
        .collect();
    // A part that lies elsewhere harms no calibration, a sensor that does harms every weld: in doubt it is the sensor's
    // bracket that must be looked at.
    let doubt = rivals.iter().find(|rival| own.kind == Kind::Seam && rival.kind == Kind::Bracket);
    let change = doubt.map_or_else(|| own.clone(), |bracket| (*bracket).clone());
    let since = since(history, history.pieces.len() - length);
    let change = sized(history, &change, since, last_part);
    let kinds = rivals.iter().map(|rival| rival.kind).chain([own.kind]);
    let mut not_told_apart: Vec<Kind> = kinds.filter(|kind| *kind != change.kind).collect();
    not_told_apart.sort_unstable();
    Some(Alarm { change, since, not_told_apart })
}

/// When something changed, if whole welds say that `first` was the first one after it. A weld in the middle of which something
/// changed is like those before it or like those after it: what was found inside of it stays.
fn since(history: &History<'_>, first: usize) -> Since {
    let dated = history.dated.filter(|dated| dated.piece == first || dated.piece + 1 == first);
    dated.unwrap_or(Since { piece: first, inside_s: None })
}

/// The same change with its amount from welds that lie wholly before or wholly after it. The one in which it happened says an
/// amount between none and all of it, and which one that was is known to two welds: the first that is more like those after,
/// and the one before it.
fn sized(history: &History<'_>, change: &Change, since: Since, last_part: usize) -> Change {
    let count = history.pieces.len();
    let (before, after) = match since {
        Since { piece, inside_s: Some(_) } => (piece, piece + 1),
        Since { piece, inside_s: None } => (piece.saturating_sub(1), piece + 1),
    };
    // The only weld after a change is all that there is to say how large it is.
    let after = if after < count { after } else { count - 1 };
    let [before, after] = [0..before, after..count].map(|range| sums(history, range));
    let evidence = WindowEvidence::of(&before, &after, last_part, history.prior);
    change.with_amount_of(self::change(history, &evidence, last_part, change.kind))
}
