//! The sums of a Gauss–Newton step: JᵀWJ, JᵀWr and the cost, without a matrix per sample.

use super::lanes::{Lanes, WIDTH};
use super::robust::weigh;
use super::samples::Samples;
use super::sweep::Visit;
use super::view::{Modelled, Seen, whiten};
use crate::input::noise_levels::Whitener;
use crate::problem::unknowns::{LOCAL_ALL, LOCAL_BOWED, LOCAL_STRAIGHT, ROTATION, TRANSLATION, Unknowns};
use crate::problem::usable::UNUSABLE_SQUARED;
use nalgebra::{Matrix3, SMatrix, SVector};
use trueline_lsq::{Loss, NormalEquations};

/// Sums of one line over its N local unknowns, lane by lane. Rotation and translation are in the sheet's axes. Only the upper half of the symmetric
/// matrix is used.
#[derive(Clone)]
struct LineSums<const N: usize> {
    hessian: [[[f64; WIDTH]; N]; N],
    gradient: [[f64; WIDTH]; N],
    cost: [f64; WIDTH],
}

impl<const N: usize> LineSums<N> {
    const ZERO: Self =
        Self { hessian: [[[0.0; WIDTH]; N]; N], gradient: [[0.0; WIDTH]; N], cost: [0.0; WIDTH] };

    #[inline(always)]
    fn add_row<const FUSED: bool, const ROW: usize>(
        &mut self,
        columns: &[[Lanes<FUSED>; 2]; N],
        residual: &[Lanes<FUSED>; 2],
    ) {
        if ROW >= N {
            return;
        }
        let [a, b] = columns[ROW];
        let gradient = Lanes::<FUSED>(self.gradient[ROW]);
        self.gradient[ROW] = gradient.plus_product(a, residual[0]).plus_product(b, residual[1]).0;
        for column in ROW..N {
            let [c, d] = columns[column];
            let sum = Lanes::<FUSED>(self.hessian[ROW][column]);
            self.hessian[ROW][column] = sum.plus_product(a, c).plus_product(b, d).0;
        }
    }
}

/// The whiteners of four samples. Zero for lanes without one, or without an intersection.
#[inline(always)]
pub(super) fn whiteners_of<const FUSED: bool>(
    whiteners: &[Whitener],
    samples: &Samples,
    usable: &[bool; WIDTH],
) -> [Lanes<FUSED>; 3] {
    let w = [
        whiteners[samples.index[0] as usize].0,
        whiteners[samples.index[1] as usize].0,
        whiteners[samples.index[2] as usize].0,
        whiteners[samples.index[3] as usize].0,
    ];
    let mut lanes = [[0.0; WIDTH]; 3];
    for lane in 0..WIDTH {
        for k in 0..3 {
            lanes[k][lane] = f64::from(w[lane][k]);
        }
    }
    if (samples.count as usize) < WIDTH || *usable != [true; WIDTH] {
        for lane in (0..WIDTH).filter(|lane| *lane >= samples.count as usize || !usable[*lane]) {
            for whitener in &mut lanes {
                whitener[lane] = 0.0;
            }
        }
    }
    let [w11, w21, w22] = lanes;
    [Lanes(w11), Lanes(w21), Lanes(w22)]
}

/// Number of lanes with a sample without an intersection.
#[inline(always)]
pub(super) fn unusable(samples: &Samples, usable: &[bool; WIDTH]) -> usize {
    usable[..samples.count as usize].iter().filter(|usable| !**usable).count()
}

/// Adds up the equations of all lines.
pub(crate) struct Equations<'a, const N: usize> {
    whiteners: &'a [Whitener],
    loss: Loss,
    sums: Vec<LineSums<N>>,
    without: usize,
}

impl<'a, const N: usize> Equations<'a, N> {
    /// Zero sums.
    pub(crate) fn new(whiteners: &'a [Whitener], loss: Loss, lines: usize) -> Self {
        Self { whiteners, loss, sums: vec![LineSums::ZERO; lines], without: 0 }
    }

    /// Adds the sums to the equations of these unknowns. `sheet_from_tool` rotates them back into the tool frame.
    pub(crate) fn add_to(
        &self,
        equations: &mut NormalEquations,
        unknowns: &Unknowns,
        sheet_from_tool: &Matrix3<f64>,
    ) {
        let mut sheet_from_unknowns = SMatrix::<f64, N, N>::identity();
        for first in [ROTATION, TRANSLATION] {
            sheet_from_unknowns.view_mut((first, first), (3, 3)).copy_from(sheet_from_tool);
        }
        for (line, sums) in self.sums.iter().enumerate() {
            let total = |lanes: &[f64; WIDTH]| (lanes[0] + lanes[1]) + (lanes[2] + lanes[3]);
            let mut hessian = SMatrix::<f64, N, N>::zeros();
            let mut gradient = SVector::<f64, N>::zeros();
            for row in 0..N {
                gradient[row] = total(&sums.gradient[row]);
                for column in row..N {
                    hessian[(row, column)] = total(&sums.hessian[row][column]);
                    hessian[(column, row)] = hessian[(row, column)];
                }
            }
            let hessian = sheet_from_unknowns.transpose() * hessian * sheet_from_unknowns;
            let gradient = sheet_from_unknowns.transpose() * gradient;
            let places: [usize; N] = std::array::from_fn(|local| unknowns.place(local, line));
            for row in 0..N {
                equations.gradient[places[row]] += gradient[row];
                for column in 0..N {
                    equations.hessian[(places[row], places[column])] += hessian[(row, column)];
                }
            }
            equations.cost += 0.5 * total(&sums.cost);
        }
        equations.cost += 0.5 * self.without as f64 * self.loss.value(UNUSABLE_SQUARED);
    }
}

impl<const N: usize> Visit for Equations<'_, N> {
    const STRAIGHT: bool = N == LOCAL_STRAIGHT;
    const BOWED: bool = N == LOCAL_BOWED;
    const SHAPED: bool = N == LOCAL_ALL;
    const TO_LINE: bool = N == LOCAL_STRAIGHT;

    #[inline(always)]
    fn samples<const FUSED: bool, M: Modelled>(
        &mut self,
        line: usize,
        samples: &Samples,
        seen: &Seen<FUSED, M::Rows<FUSED>>,
    ) {
        let w = whiteners_of::<FUSED>(self.whiteners, samples, &seen.usable);
        self.without += unusable(samples, &seen.usable);
        let whitened = whiten(&w, seen.residual);
        let squared = (whitened[0] * whitened[0]).plus_product(whitened[1], whitened[1]);
        let (value, weight) = weigh(self.loss, squared);
        let root = weight.sqrt();
        let w = [w[0] * root, w[1] * root, w[2] * root];
        let residual = [whitened[0] * root, whitened[1] * root];
        let all = seen.columns::<M>(&w);
        let mut columns = [[Lanes::<FUSED>::splat(0.0); 2]; N];
        columns.copy_from_slice(&all[..N]);

        let sums = &mut self.sums[line];
        sums.cost = (Lanes::<FUSED>(sums.cost) + value).0;
        // Each row has a length known at compile time, so that the compiler unrolls the loops.
        sums.add_row::<FUSED, 0>(&columns, &residual);
        sums.add_row::<FUSED, 1>(&columns, &residual);
        sums.add_row::<FUSED, 2>(&columns, &residual);
        sums.add_row::<FUSED, 3>(&columns, &residual);
        sums.add_row::<FUSED, 4>(&columns, &residual);
        sums.add_row::<FUSED, 5>(&columns, &residual);
        sums.add_row::<FUSED, 6>(&columns, &residual);
        sums.add_row::<FUSED, 7>(&columns, &residual);
        sums.add_row::<FUSED, 8>(&columns, &residual);
        sums.add_row::<FUSED, 9>(&columns, &residual);
        sums.add_row::<FUSED, 10>(&columns, &residual);
        sums.add_row::<FUSED, 11>(&columns, &residual);
        sums.add_row::<FUSED, 12>(&columns, &residual);
        sums.add_row::<FUSED, 13>(&columns, &residual);
        sums.add_row::<FUSED, 14>(&columns, &residual);
        sums.add_row::<FUSED, 15>(&columns, &residual);
        sums.add_row::<FUSED, 16>(&columns, &residual);
        sums.add_row::<FUSED, 17>(&columns, &residual);
    }

    #[inline(always)]
    fn unplaced(&mut self, _index: usize) {
        self.without += 1;
    }
}

/// Adds up the cost alone.
pub(crate) struct Cost<'a> {
    whiteners: &'a [Whitener],
    loss: Loss,
    sum: [f64; WIDTH],
    without: usize,
}

impl<'a> Cost<'a> {
    /// Zero sums.
    pub(crate) fn new(whiteners: &'a [Whitener], loss: Loss) -> Self {
        Self { whiteners, loss, sum: [0.0; WIDTH], without: 0 }
    }

    /// ½ Σ ρ.
    pub(crate) fn total(&self) -> f64 {
        let sum = (self.sum[0] + self.sum[1]) + (self.sum[2] + self.sum[3]);
        0.5 * (sum + self.without as f64 * self.loss.value(UNUSABLE_SQUARED))
    }
}

impl Visit for Cost<'_> {
    #[inline(always)]
    fn samples<const FUSED: bool, M: Modelled>(
        &mut self,
        _line: usize,
        samples: &Samples,
        seen: &Seen<FUSED, M::Rows<FUSED>>,
    ) {
        let squared = squared(self.whiteners, samples, seen);
        self.without += unusable(samples, &seen.usable);
        self.sum = (Lanes::<FUSED>(self.sum) + weigh(self.loss, squared).0).0;
    }

    #[inline(always)]
    fn unplaced(&mut self, _index: usize) {
        self.without += 1;
    }
}

/// Squared whitened residuals. Zero for lanes without one.
#[inline(always)]
fn squared<const FUSED: bool, B>(
    whiteners: &[Whitener],
    samples: &Samples,
    seen: &Seen<FUSED, B>,
) -> Lanes<FUSED> {
    let [a, b] = whiten(&whiteners_of::<FUSED>(whiteners, samples, &seen.usable), seen.residual);
    (a * a).plus_product(b, b)
}

/// Collects the squared whitened residuals.
pub(crate) struct Squared<'a> {
    whiteners: &'a [Whitener],
    /// One for each observation. NaN where it cannot be evaluated.
    pub values: Vec<f64>,
}

impl<'a> Squared<'a> {
    /// No values yet.
    pub(crate) fn new(whiteners: &'a [Whitener]) -> Self {
        Self { whiteners, values: vec![f64::NAN; whiteners.len()] }
    }
}

impl Visit for Squared<'_> {
    #[inline(always)]
    fn samples<const FUSED: bool, M: Modelled>(
        &mut self,
        _line: usize,
        samples: &Samples,
        seen: &Seen<FUSED, M::Rows<FUSED>>,
    ) {
        let squared = squared(self.whiteners, samples, seen);
        for lane in 0..samples.count as usize {
            if seen.usable[lane] {
                self.values[samples.index[lane] as usize] = squared.0[lane];
            }
        }
    }

    #[inline(always)]
    fn unplaced(&mut self, _index: usize) {}
}

/// Adds up squared residuals in m², not whitened.
#[derive(Default)]
pub(crate) struct SquaredLengths {
    sum: [f64; WIDTH],
    count: usize,
}

impl SquaredLengths {
    /// RMS, m.
    pub(crate) fn root_mean(&self) -> f64 {
        let sum = (self.sum[0] + self.sum[1]) + (self.sum[2] + self.sum[3]);
        (sum / self.count.max(1) as f64).sqrt()
    }
}

impl Visit for SquaredLengths {
    const STRAIGHT: bool = false;
    const BOWED: bool = false;
    const SHAPED: bool = false;

    #[inline(always)]
    fn samples<const FUSED: bool, M: Modelled>(
        &mut self,
        _line: usize,
        samples: &Samples,
        seen: &Seen<FUSED, M::Rows<FUSED>>,
    ) {
        let [a, b] = seen.residual;
        let squared = (a * a).plus_product(b, b);
        for lane in 0..samples.count as usize {
            if seen.usable[lane] {
                self.sum[lane] += squared.0[lane];
                self.count += 1;
            }
        }
    }

    #[inline(always)]
    fn unplaced(&mut self, _index: usize) {}
}
