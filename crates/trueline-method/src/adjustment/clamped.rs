//! A part that is clamped again between passes over its seam: six numbers for each pass after the first.
//!
//! A point of the seam is off its place in the first pass by δ + θ × a, with the shift δ, the turn θ and the lever a from the middle of the seam.

use crate::adjustment::sights::Frame;
use crate::config::PartMoves;
use crate::order_statistics::median;
use nalgebra::{SVector, Vector3};
use trueline_geometry::so3;

/// Numbers of a pass.
const PLACE: usize = 6;

/// The passes over a part, and how far it moves between them.
#[derive(Clone, Debug)]
pub(crate) struct Clamped {
    /// Stamp at which each pass but the last ends, s.
    pub ends_s: Vec<f64>,
    /// Middle of the seam, m in base.
    pub middle: Vector3<f64>,
    /// Expected moves.
    pub moves: PartMoves,
}

impl Clamped {
    /// Its number of columns.
    #[must_use]
    pub(crate) fn columns(&self) -> usize {
        PLACE * self.ends_s.len()
    }

    /// Pass at a stamp, s; the first is 0.
    #[must_use]
    pub(crate) fn pass(&self, stamp_s: f64) -> usize {
        self.ends_s.partition_point(|end_s| *end_s <= stamp_s)
    }

    /// Columns of a frame's pass, with the residual by one standard deviation of each number. None in the first pass.
    pub(crate) fn at<const ROWS: usize, const LOCAL: usize>(
        &self,
        frame: &Frame<ROWS, LOCAL>,
    ) -> impl Iterator<Item = (usize, SVector<f64, ROWS>)> {
        // A part that moves is a robot that moves the other way.
        let tool_from_middle = frame.base_from_tool.translation.vector - self.middle;
        let shift = frame.by_shift * -self.moves.shift_m;
        let turn = (frame.by_shift * so3::hat(&tool_from_middle) - frame.by_turn) * self.moves.turn_rad;
        let first = self.pass(frame.stamp_s).checked_sub(1).map(|before| PLACE * before);
        let of_axis = move |first: usize, axis: usize| {
            let (shift, turn) = (shift.column(axis).into_owned(), turn.column(axis).into_owned());
            [(first + axis, shift), (first + 3 + axis, turn)]
        };
        first.into_iter().flat_map(move |first| (0..3).flat_map(move |axis| of_axis(first, axis)))
    }

    /// Largest shift of a pass relative to the first, m, from the coefficients of its columns.
    #[must_use]
    pub(crate) fn largest_m(&self, coefficients: &[f64]) -> f64 {
        let shift = |place: &[f64]| Vector3::from_column_slice(&place[..3]).norm() * self.moves.shift_m;
        coefficients.chunks_exact(PLACE).map(shift).fold(0.0, f64::max)
    }
}

/// Residuals of a first state. Those of a part that moves are relative to the median of their pass: a pass at another place is not one of outliers.
#[must_use]
pub(crate) fn first_residuals<const ROWS: usize, const LOCAL: usize>(
    frames: &[Option<Frame<ROWS, LOCAL>>],
    clamped: Option<&Clamped>,
) -> Vec<Option<SVector<f64, ROWS>>> {
    let residual = |frame: &Option<Frame<ROWS, LOCAL>>| Some(frame.as_ref()?.residual);
    let Some(clamped) = clamped else { return frames.iter().map(residual).collect() };
    let of_pass =
        |pass: usize| frames.iter().flatten().filter(move |frame| clamped.pass(frame.stamp_s) == pass);
    let middle = |pass: usize| {
        SVector::from_fn(|k, _| median(of_pass(pass).map(|frame| frame.residual[k])).unwrap_or(0.0))
    };
    let middles: Vec<SVector<f64, ROWS>> = (0..=clamped.ends_s.len()).map(middle).collect();
    let centred = |frame: &Option<Frame<ROWS, LOCAL>>| {
        let frame = frame.as_ref()?;
        Some(frame.residual - middles[clamped.pass(frame.stamp_s)])
    };
    frames.iter().map(centred).collect()
}
