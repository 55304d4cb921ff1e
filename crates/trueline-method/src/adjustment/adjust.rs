//! Adjusts the unknowns and every systematic error under one covariance, in rounds.
//!
//! The blocks' columns are held during a round. They define the covariance of the blocks. A solve that moved them would maximise that covariance
//! instead of minimising the residuals.

use crate::adjustment::amplitudes;
use crate::adjustment::blocks::Block;
use crate::adjustment::clamped::first_residuals;
use crate::adjustment::coloured::{Coloured, Sums, Whitened};
use crate::adjustment::columns::Columns;
use crate::adjustment::equations::{Equations, Factors, Prior, Solved};
use crate::adjustment::frames::{Frame, Scan, places};
use crate::adjustment::neighbours::Neighbours;
use crate::adjustment::noise_search::{Given, Reach, about, likeliest};
use crate::adjustment::table::Table;
use crate::adjustment::weights::{Weights, weights};
use crate::assess::tilt_bias::TiltBias;
use crate::input::shape_prior::ShapePrior;
use crate::order_statistics::median;
use crate::parallel;
use crate::problem::parameters::Parameters;
use nalgebra::{DMatrix, DVector, Vector1, Vector2};

/// Cuts of the rounds, standard deviations. A frame beyond the cut is left out.
const CUTS: [f64; 5] = [4.0, 4.5, 5.5, 5.5, 5.5];
/// First round in which the amplitudes follow the scan. Earlier, outliers and tacks would inflate them.
const FIRST_OF_AMPLITUDES: usize = 1;
/// Round in which the noise model is chosen …
const ROUND_OF_NOISE: usize = 1;
/// … and the round in which it is chosen again, near the first choice, beside the blocks' amplitudes.
const ROUND_BESIDE_AMPLITUDES: usize = 2;
/// Maximum number of steps in a round.
const STEPS: usize = 4;
/// Steps below this fraction of the standard deviations count as converged.
const SMALL: f64 = 0.02;
/// Halvings of a step that makes the fit worse.
const HALVINGS: usize = 6;

/// The state of an adjustment.
pub(crate) struct Adjustment<'a> {
    /// The scan.
    pub scan: Scan<'a>,
    /// The detector's tilt convention.
    pub tilt: TiltBias,
    /// Prior of the sensor's shape, if it is estimated.
    pub shape_prior: Option<ShapePrior>,
    /// Unknowns, blocks and consider parameters.
    pub columns: Columns,
    /// The unknowns.
    pub at: Parameters,
    /// The coefficients of the blocks; zero for the unknowns.
    pub coefficients: DVector<f64>,
    /// Standard deviation of the white noise in each direction, in units of the expected noise.
    pub sigmas: [f64; 2],
    /// Correlated noise.
    pub noise: [Coloured; 2],
    /// The noise of a similar model of the same scan. The search starts there. `None` for a search over all.
    pub known_noise: Option<[Coloured; 2]>,
    /// The weights of the frames.
    pub weights: Weights,
    /// Threads that share the work.
    pub threads: usize,
}

/// Quantities that are held during a round while the unknowns move.
struct Seen<'a> {
    frames: &'a [Option<Frame>],
    whitened: &'a [Whitened],
    factors: &'a Factors,
}

/// The end of an adjustment.
pub(crate) struct Adjusted {
    /// The equations there.
    pub equations: Equations,
    /// Their solution.
    pub solved: Solved,
}

impl Adjustment<'_> {
    /// Runs all rounds from a first state. `None` if the equations have no solution.
    #[must_use]
    pub(crate) fn run(&mut self) -> Option<Adjusted> {
        self.begin();
        for (round, cut) in CUTS.into_iter().enumerate() {
            self.round(round, cut)?;
        }
        self.end()
    }

    /// Updates the unknowns once more, with noise, amplitudes and weights held.
    fn end(&mut self) -> Option<Adjusted> {
        let frames = self.scan.frames(&self.at, &self.tilt);
        let mut table = Table::of(&frames, &self.columns, &self.coefficients);
        let (sums, solved) = self.steps(&mut table, &frames)?;
        let equations = self.equations(&sums);
        self.coefficients = self.of_blocks(&solved.step);
        Some(Adjusted { equations, solved })
    }

    /// Initial noise and weights from the residuals.
    fn begin(&mut self) {
        let frames = self.scan.frames(&self.at, &self.tilt);
        let as_they_are = first_residuals(&frames, self.columns.blocks.iter().find_map(Block::clamped));
        let residuals: Vec<Vec<f64>> =
            [0, 1].map(|k| as_they_are.iter().flatten().map(|residual| residual[k]).collect()).into();
        let mut spread = [1.0; 2];
        for (direction, of_direction) in residuals.iter().enumerate() {
            let differences = of_direction.windows(2).map(|two| (two[1] - two[0]).abs());
            let all = NORMAL * median(of_direction.iter().map(|r| r.abs())).unwrap_or(1.0);
            // With 40 % outliers most differences contain one, and most residuals do not.
            let sigma = (NORMAL * median(differences).unwrap_or(1.0) / std::f64::consts::SQRT_2).min(all);
            // No amplitude that is tried exceeds this.
            self.sigmas[direction] = sigma.max(all / MOST_LASTING).max(LEAST_SIGMA);
            spread[direction] = all.max(self.sigmas[direction]);
            let lasting = (spread[direction] / self.sigmas[direction]).powi(2) - 1.0;
            self.noise[direction] = self.known_noise.map_or_else(|| about(lasting), |known| known[direction]);
        }
        let table = Table::of(&frames, &self.columns, &self.coefficients);
        self.weights = weights(&table.off(&as_they_are, spread), CUTS[0]);
    }

    fn round(&mut self, round: usize, cut: f64) -> Option<()> {
        let frames = self.scan.frames(&self.at, &self.tilt);
        let mut table = Table::of(&frames, &self.columns, &self.coefficients);
        self.choose_noise(round, &table);
        let (sums, solved) = self.steps(&mut table, &frames)?;
        let equations = self.equations(&sums);
        let solved = if round >= FIRST_OF_AMPLITUDES {
            let (at, columns, shape_prior) = (&self.at, self.columns.clone(), self.shape_prior);
            amplitudes::follow(&mut self.columns.blocks, &equations, |blocks| {
                prior(at, &columns.free, blocks, shape_prior.as_ref())
            })?
        } else {
            solved
        };
        self.coefficients = self.of_blocks(&solved.step);
        let left = table.left(&solved.step);
        self.follow_sigmas(&sums, &solved);
        let spread =
            [0, 1].map(|direction| self.sigmas[direction] * (1.0 + self.noise[direction].lasting()).sqrt());
        self.weights = weights(&table.off(&left, spread), cut);
        Some(())
    }

    fn choose_noise(&mut self, round: usize, table: &Table) {
        let reach = match round {
            ROUND_OF_NOISE if self.known_noise.is_none() => Reach::ALL,
            ROUND_OF_NOISE | ROUND_BESIDE_AMPLITUDES => Reach::NEAR,
            _ => return,
        };
        let (prior, sigmas, threads) = (self.prior(), self.sigmas, self.threads);
        let given = Given { table, weights: &self.weights.of, sigmas, prior: &prior, threads };
        self.noise = likeliest(&given, self.noise, reach);
    }

    /// Steps of the unknowns with held columns. Returns the equations at the end with their solution.
    fn steps(&mut self, table: &mut Table, frames: &[Option<Frame>]) -> Option<([Sums; 2], Solved)> {
        let whitened = self.whitened(table);
        let mut sums = [0, 1].map(|direction| whitened[direction].sums.clone());
        let factors = self.equations(&sums).factors(&self.prior(), self.columns.free.len())?;
        let mut cost = self.equations(&sums).square_of_blocks(&factors, &self.prior());
        for _ in 0..STEPS {
            let solved = self.equations(&sums).solve_with(&factors, &self.prior());
            let full = self.of_unknowns(&solved.step);
            if is_small(&full, &solved, &self.columns.free) {
                return Some((sums, solved));
            }
            let from = self.at.clone();
            let seen = Seen { frames, whitened: &whitened, factors: &factors };
            let Some(there) = self.downhill((&from, &full), cost, table, &seen) else {
                self.at = from;
                self.set_residuals(table, frames);
                break;
            };
            (sums, cost) = there;
        }
        let solved = self.equations(&sums).solve_with(&factors, &self.prior());
        Some((sums, solved))
    }

    /// The rows of both directions, whitened.
    pub(super) fn whitened(&self, table: &Table) -> Vec<Whitened> {
        parallel::map(self.threads, 2, |direction| {
            table.whitened(direction, &self.weights.of, self.noise[direction])
        })
    }

    /// Takes the largest part of a step that reduces the cost. `None` if no part does.
    fn downhill(
        &mut self,
        (from, full): (&Parameters, &DVector<f64>),
        cost: f64,
        table: &mut Table,
        seen: &Seen<'_>,
    ) -> Option<([Sums; 2], f64)> {
        let residual = self.columns.estimated();
        let mut part = 1.0;
        for _ in 0..HALVINGS {
            self.at = from.retract(&(full * part));
            self.set_residuals(table, seen.frames);
            let sums = [0, 1].map(|direction| table.sums(&seen.whitened[direction], direction, residual));
            let there = self.equations(&sums).square_of_blocks(seen.factors, &self.prior());
            if there < cost {
                return Some((sums, there));
            }
            part *= 0.5;
        }
        None
    }

    pub(super) fn set_residuals(&self, table: &mut Table, frames: &[Option<Frame>]) {
        table.set_residuals(self.columns.estimated(), &self.residuals(frames));
    }

    /// Residuals at the state, with the frames from an earlier one.
    fn residuals(&self, frames: &[Option<Frame>]) -> Vec<Option<Vector2<f64>>> {
        let there: Vec<_> =
            frames.iter().map(|frame| self.scan.residual(frame.as_ref()?, &self.at)).collect();
        let slid = |(frame, there): (&Option<Frame>, &Option<(Vector2<f64>, f64)>)| {
            Some(Vector1::new(there.as_ref()?.1 - frame.as_ref()?.along_m))
        };
        let slid: Vec<_> = frames.iter().zip(&there).map(slid).collect();
        let apart = Neighbours::of(&places(frames)).beyond(&slid);
        let residual = |((frame, there), apart): ((&Option<Frame>, Option<_>), Option<Vector1<f64>>)| {
            let (frame, (residual, _), apart) = (frame.as_ref()?, there?, apart?);
            let steep = self.columns.slopes(frame, &self.coefficients);
            let moved = frame.by_point * (frame.across[0] * -steep[0] + frame.across[1] * -steep[1]);
            Some(residual + moved * apart.x)
        };
        frames.iter().zip(there).zip(apart).map(residual).collect()
    }

    pub(super) fn equations(&self, sums: &[Sums; 2]) -> Equations {
        Equations::of([&sums[0], &sums[1]], self.sigmas, self.columns.estimated())
    }

    pub(super) fn prior(&self) -> Prior {
        prior(&self.at, &self.columns.free, &self.columns.blocks, self.shape_prior.as_ref())
    }

    /// A step of all columns as one of the tangent.
    pub(super) fn of_unknowns(&self, step: &DVector<f64>) -> DVector<f64> {
        let mut all = DVector::zeros(self.at.dimension());
        for (column, index) in self.columns.free.iter().enumerate() {
            all[*index] = step[column];
        }
        all
    }

    fn of_blocks(&self, step: &DVector<f64>) -> DVector<f64> {
        let mut coefficients = step.clone();
        coefficients.rows_mut(0, self.columns.free.len()).fill(0.0);
        coefficients
    }

    /// White noise: remaining residuals over the remaining degrees of freedom.
    fn follow_sigmas(&mut self, sums: &[Sums; 2], solved: &Solved) {
        let prior = self.prior();
        let count = solved.step.len();
        // Columns without a prior use up degrees of freedom, half of them in each direction.
        let known = solved.known_by(&prior, self.columns.free.len());
        let used = 0.5 * (count as f64 - known).max(0.0);
        for (sums, sigma) in sums.iter().zip(&mut self.sigmas) {
            let products = sums.products.view((0, 0), (count, count));
            let gradient = sums.products.view((0, count), (count, 1));
            let square = sums.products[(count, count)]
                + 2.0 * gradient.column(0).dot(&solved.step)
                + solved.step.dot(&(products * &solved.step));
            *sigma = (square / (sums.count as f64 - used).max(1.0)).sqrt().max(LEAST_SIGMA);
        }
    }
}

/// Ratio of a normal distribution's standard deviation to its median absolute deviation.
const NORMAL: f64 = 1.4826;
/// Largest root of an amplitude of correlated noise that is tried.
const MOST_LASTING: f64 = 10.0;
/// Least white noise as a share of the expected noise: for data without noise.
const LEAST_SIGMA: f64 = 1e-6;

fn is_small(step: &DVector<f64>, solved: &Solved, free: &[usize]) -> bool {
    let sigmas = solved.sigmas(free.len());
    free.iter().zip(sigmas).all(|(index, sigma)| step[*index].abs() < SMALL * sigma)
}

/// Prior of the free unknowns at a state, and of the blocks.
fn prior(at: &Parameters, free: &[usize], blocks: &[Block], shape_prior: Option<&ShapePrior>) -> Prior {
    let known = at.known(shape_prior);
    let dimension = at.dimension();
    let (of_all, by_all) = (known.information(dimension), known.gradient(dimension));
    let count = blocks.last().map_or(free.len(), |block| block.columns.end);
    let mut information = DMatrix::zeros(count, count);
    let mut gradient = DVector::zeros(count);
    for (column, index) in free.iter().enumerate() {
        gradient[column] = by_all[*index];
        for (row, other) in free.iter().enumerate() {
            information[(row, column)] = of_all[(*other, *index)];
        }
    }
    let mut log_determinant = 0.0;
    for block in blocks {
        for (k, column) in block.columns.clone().enumerate() {
            let variance = block.variance(k);
            information[(column, column)] = variance.recip();
            log_determinant += variance.ln();
        }
    }
    Prior { information, gradient, square: 2.0 * known.cost(), log_determinant }
}
