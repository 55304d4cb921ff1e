//! The rows of all frames in order of target and time, and their whitening.
//!
//! Neighbouring frames may share a row: the mean of theirs by weight, which says what they say together.

use crate::adjustment::coloured::{Coloured, Sums, Tick, Whitened, whiten};
use crate::adjustment::columns::Columns;
use crate::adjustment::sights::{Frame, State};
use nalgebra::{DVector, SVector};

/// Longest time over which frames share a row, s: a tenth of the period of a 1 Hz weave.
const LONGEST_ROW_S: f64 = 0.1;

/// A frame in the table.
struct Entry<const ROWS: usize> {
    /// Number of its row; `None` if the frame could not be evaluated.
    row: Option<usize>,
    /// Weight of each residual in the mean of that row. 0 for a missing one.
    weights: [f64; ROWS],
    /// Its residuals at the present state.
    residual: SVector<f64, ROWS>,
}

/// The rows of all frames, for each residual of a frame.
pub(crate) struct Table<const ROWS: usize> {
    width: usize,
    rows: [Vec<f64>; ROWS],
    ticks: [Vec<Tick>; ROWS],
    entries: Vec<Entry<ROWS>>,
}

impl<const ROWS: usize> Table<ROWS> {
    /// From frames sorted by target and time, with their weights. So many neighbours share a row. Some may not be evaluable.
    #[must_use]
    pub(crate) fn of<P: State, const LOCAL: usize>(
        frames: &[Option<Frame<ROWS, LOCAL>>],
        (columns, coefficients): (&Columns<P>, &DVector<f64>),
        weights: &[f64],
        together: usize,
    ) -> Self {
        let (width, numbers) = (columns.width(), row_numbers(frames, together));
        let ticks = ticks(frames, &numbers);
        let mut rows = [(); ROWS].map(|()| vec![0.0; width * ticks.len()]);
        let mut all = [(); ROWS].map(|()| ticks.clone());
        let mut own = [(); ROWS].map(|()| vec![0.0; width]);
        let mut entries = Vec::with_capacity(frames.len());
        for ((frame, number), weight) in frames.iter().zip(numbers).zip(weights) {
            let (Some(frame), Some(number)) = (frame, number) else {
                entries.push(Entry { row: None, weights: [0.0; ROWS], residual: SVector::zeros() });
                continue;
            };
            columns.fill(frame, coefficients, &mut own);
            let weights = frame.is_there.map(|is_there| if is_there { *weight } else { 0.0 });
            for (residual, weight) in weights.iter().enumerate() {
                all[residual][number].weight += weight;
                let row = &mut rows[residual][number * width..][..width];
                row.iter_mut().zip(&own[residual]).for_each(|(sum, own)| *sum += weight * own);
            }
            entries.push(Entry { row: Some(number), weights, residual: frame.residual });
        }
        for (rows, ticks) in rows.iter_mut().zip(&all) {
            for (row, tick) in rows.chunks_exact_mut(width).zip(ticks).filter(|(_, tick)| tick.weight > 0.0) {
                row.iter_mut().for_each(|sum| *sum /= tick.weight);
            }
        }
        Self { width, rows, ticks: all, entries }
    }

    /// Replaces the residuals of each frame. A frame that can no longer be evaluated keeps its old ones: losing it must not reduce the cost.
    pub(crate) fn set_residuals(&mut self, column: usize, residuals: &[Option<SVector<f64, ROWS>>]) {
        for rows in &mut self.rows {
            rows.chunks_exact_mut(self.width).for_each(|row| row[column] = 0.0);
        }
        for (entry, residual) in self.entries.iter_mut().zip(residuals) {
            entry.residual = residual.unwrap_or(entry.residual);
            let Some(number) = entry.row else { continue };
            for (k, rows) in self.rows.iter_mut().enumerate() {
                rows[number * self.width + column] += entry.weights[k] * entry.residual[k];
            }
        }
        for (rows, ticks) in self.rows.iter_mut().zip(&self.ticks) {
            for (row, tick) in rows.chunks_exact_mut(self.width).zip(ticks) {
                row[column] /= if tick.weight > 0.0 { tick.weight } else { 1.0 };
            }
        }
    }

    /// Sums of the whitened rows of one residual with the present residuals.
    #[must_use]
    pub(crate) fn sums(&self, whitened: &Whitened, residual: usize, column: usize) -> Sums {
        let residuals = self.rows[residual].chunks_exact(self.width).map(|row| row[column]);
        whitened.with_column(column, residuals)
    }

    /// The rows of one residual, whitened.
    #[must_use]
    pub(crate) fn whitened(&self, residual: usize, noise: Coloured) -> Whitened {
        whiten(&self.rows[residual], self.width, &self.ticks[residual], noise)
    }

    /// The residuals of each frame after a step of all columns. `None` if it could not be evaluated.
    #[must_use]
    pub(crate) fn left<P: State, const LOCAL: usize>(
        &self,
        frames: &[Option<Frame<ROWS, LOCAL>>],
        (columns, coefficients): (&Columns<P>, &DVector<f64>),
        step: &DVector<f64>,
    ) -> Vec<Option<SVector<f64, ROWS>>> {
        let mut own = [(); ROWS].map(|()| vec![0.0; self.width]);
        let mut left = |(frame, entry): (&Option<Frame<ROWS, LOCAL>>, &Entry<ROWS>)| {
            columns.fill(frame.as_ref()?, coefficients, &mut own);
            let moved =
                |row: usize| own[row].iter().zip(step.iter()).map(|(by, step)| by * step).sum::<f64>();
            Some(SVector::from_fn(|row, _| entry.residual[row] + moved(row)))
        };
        frames.iter().zip(&self.entries).map(&mut left).collect()
    }
}

/// Number of the row of each frame.
fn row_numbers<const ROWS: usize, const LOCAL: usize>(
    frames: &[Option<Frame<ROWS, LOCAL>>],
    together: usize,
) -> Vec<Option<usize>> {
    let mut last: Option<(&Frame<ROWS, LOCAL>, usize, usize)> = None;
    let mut numbers = Vec::with_capacity(frames.len());
    for frame in frames {
        let Some(frame) = frame else {
            numbers.push(None);
            continue;
        };
        last = Some(match last {
            Some((first, number, count))
                if count < together
                    && first.target == frame.target
                    && (frame.stamp_s - first.stamp_s).abs() < LONGEST_ROW_S =>
            {
                (first, number, count + 1)
            }
            Some((_, number, _)) => (frame, number + 1, 1),
            None => (frame, 0, 1),
        });
        numbers.push(last.map(|(_, number, _)| number));
    }
    numbers
}

/// The rows in time, at the mean stamp of their frames, without weights.
fn ticks<const ROWS: usize, const LOCAL: usize>(
    frames: &[Option<Frame<ROWS, LOCAL>>],
    numbers: &[Option<usize>],
) -> Vec<Tick> {
    /// Target, sum of the stamps (s) and number of frames.
    struct Sum(usize, f64, f64);
    let mut sums: Vec<Sum> = Vec::new();
    for (frame, number) in frames.iter().flatten().zip(numbers.iter().flatten()) {
        match sums.get_mut(*number) {
            Some(Sum(_, stamps_s, count)) => (*stamps_s, *count) = (*stamps_s + frame.stamp_s, *count + 1.0),
            None => sums.push(Sum(frame.target, frame.stamp_s, 1.0)),
        }
    }
    let stamp_s = |sum: &Sum| sum.1 / sum.2;
    let since_s = |k: usize| match k.checked_sub(1).map(|before| &sums[before]) {
        Some(before) if before.0 == sums[k].0 => stamp_s(&sums[k]) - stamp_s(before),
        _ => f64::INFINITY,
    };
    (0..sums.len()).map(|k| Tick { since_s: since_s(k), weight: 0.0 }).collect()
}
