//! Regimes as the state keeps them, by the rows of welds and parts, and as the detector has them, by places in lists.

use crate::detect::{Fault, History, PieceInformation, Regime, Scatter, judge};
use crate::quadratic::Quadratic;
use crate::store::{StoredFault, StoredPart, StoredPiece, StoredRegime};

/// The lists, and the row of the weld that comes next.
#[derive(Clone, Copy)]
pub(crate) struct Lists<'a> {
    pub pieces: &'a [StoredPiece],
    pub parts: &'a [StoredPart],
    pub next_row: i64,
}

impl Lists<'_> {
    /// As the detector has them.
    pub(crate) fn places(&self, kept: &[StoredRegime]) -> Vec<Regime> {
        let weld = |row: i64| self.pieces.partition_point(|piece| piece.id < row);
        let part = |id: i64| self.parts.iter().position(|part| part.id == id).unwrap_or(0);
        let place = |regime: &StoredRegime| Regime {
            first: weld(regime.first),
            inside_s: regime.inside_s,
            fault: regime.fault.as_ref().map(|fault| Fault {
                kind: fault.kind,
                part: part(fault.part),
                raised: weld(fault.raised),
            }),
        };
        kept.iter().map(place).collect()
    }

    /// As the state keeps them. Rows before all welds of the list stay, and so do their claims.
    pub(crate) fn rows(&self, regimes: &[Regime], before: &[StoredRegime]) -> Vec<StoredRegime> {
        let weld = |place: usize| self.pieces.get(place).map_or(self.next_row, |piece| piece.id);
        let old = self.places(before);
        let row = |regime: &Regime| {
            let same = old.iter().zip(before).find(|(old, _)| old.first == regime.first);
            let first = same.map_or_else(|| weld(regime.first), |(_, kept)| kept.first);
            let fault = regime.fault.map(|fault| StoredFault {
                kind: fault.kind,
                part: self.parts.get(fault.part).map_or(0, |part| part.id),
                raised: weld(fault.raised),
            });
            let claimed = fault.is_none() && before.iter().any(|kept| kept.claimed && kept.first == first);
            StoredRegime { first, inside_s: regime.inside_s, fault, claimed }
        };
        regimes.iter().map(row).collect()
    }

    /// Evidence of each weld.
    pub(crate) fn information(&self) -> Vec<PieceInformation> {
        let of = |piece: &StoredPiece| {
            let place = self.parts.iter().position(|part| part.id == piece.part)?;
            let part = &self.parts[place];
            Some(PieceInformation::of(&piece.statistic, place, &part.part, part.scatter.as_ref()))
        };
        self.pieces.iter().filter_map(of).collect()
    }

    /// The scatter of each part.
    pub(crate) fn scatters(&self) -> Vec<Option<Scatter>> {
        self.parts.iter().map(|part| part.scatter.clone()).collect()
    }

    /// The rows of welds beyond the number that the detector uses. Good welds and others count separately: a
    /// change that stands for long must not leave only its own welds.
    pub(crate) fn too_old(&self, kept: &[StoredRegime], most: usize) -> Vec<i64> {
        let rows = |good: bool| {
            let own = self.pieces.iter().map(|piece| piece.id).filter(move |id| is_good(kept, *id) == good);
            let own: Vec<i64> = own.collect();
            own[..own.len().saturating_sub(most)].to_vec()
        };
        [rows(true), rows(false)].concat()
    }
}

/// The welds that are at the calibration.
pub(crate) fn good<'a>(
    pieces: &'a [StoredPiece],
    kept: &'a [StoredRegime],
) -> impl Iterator<Item = &'a StoredPiece> {
    pieces.iter().filter(|piece| is_good(kept, piece.id))
}

fn is_good(kept: &[StoredRegime], weld: i64) -> bool {
    kept.iter().rfind(|regime| regime.first <= weld).is_none_or(|regime| regime.fault.is_none())
}

/// The regimes of welds from before regimes were kept: each weld is judged again.
pub(crate) fn found_anew(lists: Lists<'_>, prior: &Quadratic) -> Vec<StoredRegime> {
    let (pieces, scatters) = (lists.information(), lists.scatters());
    let next = |regimes: Vec<Regime>, count: usize| {
        judge(&History { pieces: &pieces[..count], prior, scatters: &scatters, regimes: &regimes }, None)
            .regimes
    };
    lists.rows(&(1..=pieces.len()).fold(vec![Regime::good(0)], next), &[])
}
