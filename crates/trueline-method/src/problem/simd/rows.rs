//! Whitened residuals and Jacobians of single samples, computed four side by side.

use super::lanes::Lanes;
use super::samples::Samples;
use super::sums::whiteners_of;
use super::sweep::Visit;
use super::view::{Modelled, Seen, whiten};
use crate::input::noise_levels::Whitener;
use crate::problem::unknowns::{LOCAL_ALL, ROTATION, TRANSLATION};
use nalgebra::{Matrix3, SMatrix, Vector2};

/// A whitened residual and its Jacobian by the local unknowns. Columns of unmodelled unknowns are zero.
#[derive(Clone, Copy, Debug)]
pub(crate) struct WhitenedRow {
    /// The residual.
    pub residual: Vector2<f64>,
    /// Its Jacobian.
    pub jacobian: SMatrix<f64, 2, LOCAL_ALL>,
}

/// Collects them. `None` for observations that cannot be evaluated.
pub(crate) struct Rows<'a> {
    whiteners: &'a [Whitener],
    sheet_from_tool: Matrix3<f64>,
    rows: &'a mut [Option<WhitenedRow>],
}

impl<'a> Rows<'a> {
    /// For one observation per whitener. `sheet_from_tool` rotates sheet into tool axes.
    pub(crate) fn new(
        whiteners: &'a [Whitener],
        sheet_from_tool: Matrix3<f64>,
        rows: &'a mut [Option<WhitenedRow>],
    ) -> Self {
        Self { whiteners, sheet_from_tool, rows }
    }
}

impl Visit for Rows<'_> {
    #[inline(always)]
    fn samples<const FUSED: bool, M: Modelled>(
        &mut self,
        _line: usize,
        samples: &Samples,
        seen: &Seen<FUSED, M::Rows<FUSED>>,
    ) {
        let w = whiteners_of::<FUSED>(self.whiteners, samples, &seen.usable);
        let residual = whiten(&w, seen.residual);
        let mut whitened = seen.columns::<M>(&w);
        for first in [ROTATION, TRANSLATION] {
            let in_sheet = [whitened[first], whitened[first + 1], whitened[first + 2]];
            for k in 0..3 {
                let [x, y, z] = [0, 1, 2].map(|axis| self.sheet_from_tool[(axis, k)]);
                for row in 0..2 {
                    whitened[first + k][row] = (in_sheet[0][row] * Lanes::splat(x))
                        .plus_product(in_sheet[1][row], Lanes::splat(y))
                        .plus_product(in_sheet[2][row], Lanes::splat(z));
                }
            }
        }
        for lane in 0..samples.count as usize {
            let index = samples.index[lane] as usize;
            if !seen.usable[lane] {
                self.rows[index] = None;
                continue;
            }
            let mut jacobian = SMatrix::<f64, 2, LOCAL_ALL>::zeros();
            for k in 0..LOCAL_ALL {
                jacobian[(0, k)] = whitened[k][0].0[lane];
                jacobian[(1, k)] = whitened[k][1].0[lane];
            }
            let residual = Vector2::new(residual[0].0[lane], residual[1].0[lane]);
            self.rows[index] = Some(WhitenedRow { residual, jacobian });
        }
    }

    #[inline(always)]
    fn unplaced(&mut self, index: usize) {
        self.rows[index] = None;
    }
}
