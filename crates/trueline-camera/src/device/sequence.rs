//! When exposures begin: by the camera's own clock, or by the signal on its input.

use super::pictures::{Edge, Pictures};
use super::registers::{Wanted, WantedTrigger};
use super::shared::Shared;
use crate::trigger::TriggerEdge;

/// The counter of the stream goes from here back to 1.
const LAST_BLOCK: u16 = u16::MAX;

/// The exposures of a frame.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Turn {
    /// Its number in the stream.
    pub block_id: u16,
    /// Steady time at which each of its rows begins to be exposed, ns; a camera exposes all at once.
    pub starts_ns: Vec<i64>,
    /// Until the next one, ns; `None` if unknown.
    pub period_ns: Option<f64>,
    /// Signals until then, including the missed ones.
    pub signals: u64,
}

/// State of the camera in its sequence of exposures.
pub(super) struct Sequence {
    /// Steady time of the exposure from which the present period counts, ns.
    from_ns: i64,
    period_ns: f64,
    /// Exposures since.
    number: u64,
    block_id: u16,
    /// Steady time of the last processed signal, ns.
    looked_ns: i64,
    /// Steady time until which signals are ignored, ns.
    busy_until_ns: i64,
    /// Rows of a frame that waits for more signals, ns.
    rows_ns: Vec<i64>,
    /// Signals so far.
    signals: u64,
}

impl Sequence {
    /// Begins now.
    pub(super) fn start(shared: &Shared, wanted: &Wanted) -> Self {
        let now_ns = shared.now_ns();
        Self {
            from_ns: now_ns,
            period_ns: shared.clock.steady_length_ns(wanted.period_s * 1e9),
            number: 0,
            block_id: 0,
            looked_ns: now_ns,
            busy_until_ns: now_ns,
            rows_ns: Vec::new(),
            signals: 0,
        }
    }

    /// The next exposures; `None` if there is no signal to begin them.
    pub(super) fn next(
        &mut self,
        shared: &Shared,
        wanted: &Wanted,
        pictures: &mut dyn Pictures,
    ) -> Option<Turn> {
        let Some(trigger) = wanted.trigger else {
            let (begin_ns, period_ns) = self.by_itself(shared.clock.steady_length_ns(wanted.period_s * 1e9));
            return Some(self.turn(rows(shared, wanted, begin_ns), Some(period_ns)));
        };
        let begin_ns = self.signal(shared, wanted, trigger, pictures)?;
        if !trigger.each_row {
            let starts_ns = rows(shared, wanted, begin_ns);
            let last_ns = starts_ns.last().copied().unwrap_or(begin_ns);
            self.busy_until_ns += last_ns - begin_ns;
            return Some(self.turn(starts_ns, None));
        }
        self.rows_ns.push(begin_ns);
        (self.rows_ns.len() >= wanted.size[1] as usize).then(|| {
            let starts_ns = std::mem::take(&mut self.rows_ns);
            self.turn(starts_ns, None)
        })
    }

    fn turn(&mut self, starts_ns: Vec<i64>, period_ns: Option<f64>) -> Turn {
        self.block_id = if self.block_id == LAST_BLOCK { 1 } else { self.block_id + 1 };
        Turn { block_id: self.block_id, starts_ns, period_ns, signals: self.signals }
    }

    /// The next exposure of a free-running camera, with a possibly new period; ns both.
    fn by_itself(&mut self, period_ns: f64) -> (i64, f64) {
        let at_ns =
            |sequence: &Self| sequence.from_ns + (sequence.number as f64 * sequence.period_ns).round() as i64;
        if self.block_id == 0 {
            return (self.from_ns, period_ns);
        }
        self.number += 1;
        if period_ns != self.period_ns {
            self.number -= 1;
            self.from_ns = at_ns(self) + period_ns.round() as i64;
            (self.period_ns, self.number) = (period_ns, 0);
        }
        (at_ns(self), period_ns)
    }

    /// Steady time of the next signal that the camera can heed, ns.
    fn signal(
        &mut self,
        shared: &Shared,
        wanted: &Wanted,
        trigger: WantedTrigger,
        pictures: &mut dyn Pictures,
    ) -> Option<i64> {
        let counts = |edge: Edge| match trigger.edge {
            TriggerEdge::Rising => edge.rises,
            TriggerEdge::Falling => !edge.rises,
            TriggerEdge::Any => true,
        };
        while let Some(edge) = pictures.edge_after(self.looked_ns).filter(|_| trigger.is_wired) {
            self.looked_ns = edge.at_ns;
            if !counts(edge) {
                continue;
            }
            self.signals += 1;
            if edge.at_ns < self.busy_until_ns {
                shared.count(|counts| counts.missed_triggers += 1);
                continue;
            }
            self.busy_until_ns = edge.at_ns + ((wanted.exposure_s + shared.settings.readout_s) * 1e9) as i64;
            return Some(edge.at_ns);
        }
        None
    }
}

/// When the rows of a frame that begins at a steady time are exposed, ns.
fn rows(shared: &Shared, wanted: &Wanted, begin_ns: i64) -> Vec<i64> {
    let rows = if wanted.line_period_s > 0.0 { wanted.size[1] } else { 1 };
    let line_ns = shared.clock.steady_length_ns(wanted.line_period_s * 1e9);
    (0..rows).map(|row| begin_ns + (f64::from(row) * line_ns).round() as i64).collect()
}
