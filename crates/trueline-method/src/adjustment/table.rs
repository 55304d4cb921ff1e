//! The rows of all frames in order of line and time, and their whitening.

use crate::adjustment::coloured::{Coloured, Sums, Tick, Whitened, whiten};
use crate::adjustment::columns::Columns;
use crate::adjustment::frames::Frame;
use crate::adjustment::weights::Off;
use nalgebra::{DVector, Vector2};

/// The rows of both directions of each frame.
pub(crate) struct Table {
    width: usize,
    rows: [Vec<f64>; 2],
    since_s: Vec<f64>,
    lines: Vec<usize>,
    /// Whether a frame could be evaluated.
    is_there: Vec<bool>,
}

impl Table {
    /// From frames sorted by line and time. Some may not be evaluable.
    #[must_use]
    pub(crate) fn of(frames: &[Option<Frame>], columns: &Columns, coefficients: &DVector<f64>) -> Self {
        let width = columns.width();
        let mut rows = [0, 1].map(|_| vec![0.0; width * frames.len()]);
        let (mut since_s, mut lines, mut last) = (Vec::new(), Vec::new(), None);
        for (k, frame) in frames.iter().enumerate() {
            let Some(frame) = frame else {
                since_s.push(0.0);
                lines.push(last.map_or(0, |(line, _)| line));
                continue;
            };
            let [one, other] = &mut rows;
            let of_frame = k * width..(k + 1) * width;
            columns.fill(frame, coefficients, [&mut one[of_frame.clone()], &mut other[of_frame]]);
            since_s.push(match last {
                Some((line, stamp_s)) if line == frame.line => frame.stamp_s - stamp_s,
                _ => f64::INFINITY,
            });
            lines.push(frame.line);
            last = Some((frame.line, frame.stamp_s));
        }
        Self { width, rows, since_s, lines, is_there: frames.iter().map(Option::is_some).collect() }
    }

    /// Replaces the residual of each frame. A frame that can no longer be evaluated keeps its old one: losing it must not reduce the cost.
    pub(crate) fn set_residuals(&mut self, column: usize, residuals: &[Option<Vector2<f64>>]) {
        for (k, residual) in residuals.iter().enumerate() {
            let Some(residual) = residual else { continue };
            for (row, rows) in self.rows.iter_mut().enumerate() {
                rows[k * self.width + column] = residual[row];
            }
        }
    }

    /// Sums of one direction's whitened rows with the present residuals.
    #[must_use]
    pub(crate) fn sums(&self, whitened: &Whitened, direction: usize, residual: usize) -> Sums {
        let residuals = self.rows[direction].chunks_exact(self.width).map(|row| row[residual]);
        whitened.with_column(residual, residuals)
    }

    /// One direction's rows, whitened.
    #[must_use]
    pub(crate) fn whitened(&self, direction: usize, weights: &[f64], noise: Coloured) -> Whitened {
        let there = self.is_there.iter().zip(weights).map(|(there, weight)| f64::from(*there) * weight);
        let tick = |(since_s, weight): (&f64, f64)| Tick { since_s: *since_s, weight };
        let ticks: Vec<Tick> = self.since_s.iter().zip(there).map(tick).collect();
        whiten(&self.rows[direction], self.width, &ticks, noise)
    }

    /// Each residual after a step of the unknowns, without the blocks. `None` if it cannot be evaluated.
    #[must_use]
    pub(crate) fn left(&self, step: &DVector<f64>) -> Vec<Option<Vector2<f64>>> {
        let one = |k: usize, direction: usize| {
            let row = &self.rows[direction][k * self.width..(k + 1) * self.width];
            row[step.len()] + row.iter().zip(step.iter()).map(|(by, by_step)| by * by_step).sum::<f64>()
        };
        let left = |(k, is_there): (usize, &bool)| is_there.then(|| Vector2::new(one(k, 0), one(k, 1)));
        self.is_there.iter().enumerate().map(left).collect()
    }

    /// Deviation of each frame in units of the spread of both directions.
    #[must_use]
    pub(crate) fn off(&self, left: &[Option<Vector2<f64>>], spread: [f64; 2]) -> Vec<Off> {
        let sigmas = |left: &Vector2<f64>| (left.x / spread[0]).hypot(left.y / spread[1]);
        let off = |(left, line): (&Option<Vector2<f64>>, &usize)| Off {
            line: *line,
            sigmas: left.as_ref().map(sigmas),
        };
        left.iter().zip(&self.lines).map(off).collect()
    }
}
