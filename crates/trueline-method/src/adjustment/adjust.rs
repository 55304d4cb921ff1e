//! Adjusts the unknowns and every systematic error under one covariance, in rounds.
//!
//! The blocks' columns are held during a round. They define the covariance of the blocks. A solve that moved them would maximise that covariance
//! instead of minimising the residuals.

use crate::adjustment::amplitudes;
use crate::adjustment::blocks::Block;
use crate::adjustment::clamped::first_residuals;
use crate::adjustment::coloured::{Coloured, Sums, Whitened};
use crate::adjustment::columns::{Columns, by_along};
use crate::adjustment::equations::{Equations, Factors, Prior, Solved};
use crate::adjustment::known_before::KnownBefore;
use crate::adjustment::neighbours::Neighbours;
use crate::adjustment::noise_search::{Given, Reach, about, likeliest};
use crate::adjustment::sights::{Frame, Sights, State, places};
use crate::adjustment::table::Table;
use crate::adjustment::weights::{Weights, off, weights};
use crate::input::shape_prior::ShapePrior;
use crate::order_statistics::median;
use crate::parallel;
use crate::problem::layout::Layout;
use nalgebra::{DMatrix, DVector, SVector, Vector1};

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
pub(crate) struct Adjustment<S: Sights<ROWS, LOCAL>, const ROWS: usize, const LOCAL: usize> {
    /// The scan.
    pub scan: S,
    /// Prior of the sensor's shape, if it is estimated.
    pub shape_prior: Option<ShapePrior>,
    /// Unknowns, blocks and consider parameters.
    pub columns: Columns<S::State>,
    /// The unknowns.
    pub at: S::State,
    /// Directions of the tangent that the scan does not determine, one a column. Each is held, and its length is the root of that information.
    pub unseen: DMatrix<f64>,
    /// The coefficients of the blocks; zero for the unknowns.
    pub coefficients: DVector<f64>,
    /// Standard deviation of the white noise of each residual, in units of the expected noise.
    pub sigmas: [f64; ROWS],
    /// Correlated noise.
    pub noise: [Coloured; ROWS],
    /// The noise of a similar model of the same scan. The search starts there. `None` for a search over all.
    pub known_noise: Option<[Coloured; ROWS]>,
    /// The weights of the frames.
    pub weights: Weights,
    /// Threads that share the work.
    pub threads: usize,
}

/// Quantities that are held during a round while the unknowns move.
struct Seen<'a, const ROWS: usize, const LOCAL: usize> {
    frames: &'a [Option<Frame<ROWS, LOCAL>>],
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

impl<S: Sights<ROWS, LOCAL>, const ROWS: usize, const LOCAL: usize> Adjustment<S, ROWS, LOCAL> {
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
        let frames = self.scan.frames(&self.at);
        let mut table = self.table(&frames);
        let (sums, solved) = self.steps(&mut table, &frames)?;
        let equations = self.equations(&sums);
        self.coefficients = self.of_blocks(&solved.step);
        Some(Adjusted { equations, solved })
    }

    /// The rows of frames, with the present weights.
    pub(super) fn table(&self, frames: &[Option<Frame<ROWS, LOCAL>>]) -> Table<ROWS> {
        Table::of(frames, (&self.columns, &self.coefficients), &self.weights.of, self.scan.together())
    }

    /// Initial noise and weights from the residuals.
    fn begin(&mut self) {
        let frames = self.scan.frames(&self.at);
        self.unseen = self.held_where_unseen(&frames);
        let as_they_are = first_residuals(&frames, self.columns.blocks.iter().find_map(Block::clamped));
        let mut spread = [1.0; ROWS];
        for direction in 0..ROWS {
            let there = frames.iter().zip(&as_they_are).filter_map(|(frame, residual)| {
                frame.as_ref().filter(|frame| frame.is_there[direction]).and(residual.as_ref())
            });
            let of_direction: Vec<f64> = there.map(|residual| residual[direction]).collect();
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
        self.weights = weights(&off(&frames, &as_they_are, spread), CUTS[0]);
    }

    /// Each unseen direction, held by as much information as its components have by themselves.
    fn held_where_unseen(&self, frames: &[Option<Frame<ROWS, LOCAL>>]) -> DMatrix<f64> {
        let Some(unseen) = self.scan.unseen() else { return DMatrix::zeros(self.at.dimension(), 0) };
        let mut unseen = unseen.clone();
        let mut own = DVector::zeros(self.at.dimension());
        for frame in frames.iter().flatten().filter(|_| unseen.ncols() > 0) {
            for (local, index) in self.at.layout().indices(frame.target) {
                own[index] += frame.by_unknowns.column(local).norm_squared();
            }
        }
        for mut direction in unseen.column_iter_mut() {
            let information = direction.map(|part| part * part).dot(&own);
            direction *= information.sqrt();
        }
        unseen
    }

    fn round(&mut self, round: usize, cut: f64) -> Option<()> {
        let frames = self.scan.frames(&self.at);
        let mut table = self.table(&frames);
        self.choose_noise(round, &table);
        let (sums, solved) = self.steps(&mut table, &frames)?;
        let equations = self.equations(&sums);
        let solved = if round >= FIRST_OF_AMPLITUDES {
            let Self { at, unseen, shape_prior, columns: Columns { free, blocks, .. }, .. } = self;
            let known = KnownBefore { at, free, shape_prior: shape_prior.as_ref(), unseen };
            amplitudes::follow(blocks, &equations, |blocks| known.prior(blocks))?
        } else {
            solved
        };
        let left = table.left(&frames, (&self.columns, &self.coefficients), &solved.step);
        self.coefficients = self.of_blocks(&solved.step);
        self.follow_sigmas(&sums, &solved);
        let spread = std::array::from_fn(|k| self.sigmas[k] * (1.0 + self.noise[k].lasting()).sqrt());
        self.weights = weights(&off(&frames, &left, spread), cut);
        Some(())
    }

    fn choose_noise(&mut self, round: usize, table: &Table<ROWS>) {
        let reach = match round {
            ROUND_OF_NOISE if self.known_noise.is_none() => Reach::ALL,
            ROUND_OF_NOISE | ROUND_BESIDE_AMPLITUDES => Reach::NEAR,
            _ => return,
        };
        let (prior, sigmas, threads) = (self.prior(), self.sigmas, self.threads);
        let given = Given { table, sigmas, prior: &prior, threads };
        self.noise = likeliest(&given, self.noise, reach);
    }

    /// Steps of the unknowns with held columns. Returns the equations at the end with their solution.
    fn steps(
        &mut self,
        table: &mut Table<ROWS>,
        frames: &[Option<Frame<ROWS, LOCAL>>],
    ) -> Option<([Sums; ROWS], Solved)> {
        let whitened = self.whitened(table);
        let mut sums = std::array::from_fn(|direction| whitened[direction].sums.clone());
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

    /// The rows of each residual, whitened.
    pub(super) fn whitened(&self, table: &Table<ROWS>) -> Vec<Whitened> {
        let noise = &self.noise;
        parallel::map(self.threads, ROWS, |direction| table.whitened(direction, noise[direction]))
    }

    /// Takes the largest part of a step that reduces the cost. `None` if no part does.
    fn downhill(
        &mut self,
        (from, full): (&S::State, &DVector<f64>),
        cost: f64,
        table: &mut Table<ROWS>,
        seen: &Seen<'_, ROWS, LOCAL>,
    ) -> Option<([Sums; ROWS], f64)> {
        let residual = self.columns.estimated();
        let mut part = 1.0;
        for _ in 0..HALVINGS {
            self.at = from.retract(&(full * part));
            self.set_residuals(table, seen.frames);
            let sums =
                std::array::from_fn(|direction| table.sums(&seen.whitened[direction], direction, residual));
            let there = self.equations(&sums).square_of_blocks(seen.factors, &self.prior());
            if there < cost {
                return Some((sums, there));
            }
            part *= 0.5;
        }
        None
    }

    pub(super) fn set_residuals(&self, table: &mut Table<ROWS>, frames: &[Option<Frame<ROWS, LOCAL>>]) {
        table.set_residuals(self.columns.estimated(), &self.residuals(frames));
    }

    /// Residuals at the state, with the frames from an earlier one.
    fn residuals(&self, frames: &[Option<Frame<ROWS, LOCAL>>]) -> Vec<Option<SVector<f64, ROWS>>> {
        let there: Vec<_> =
            frames.iter().map(|frame| self.scan.residual(frame.as_ref()?, &self.at)).collect();
        let slid = |(frame, there): (&Option<Frame<ROWS, LOCAL>>, &Option<(SVector<f64, ROWS>, f64)>)| {
            Some(Vector1::new(there.as_ref()?.1 - frame.as_ref()?.along_m[0]))
        };
        let slid: Vec<_> = frames.iter().zip(&there).map(slid).collect();
        let apart = Neighbours::of(&places(frames)).beyond(&slid);
        frames
            .iter()
            .zip(there)
            .zip(apart)
            .map(|((frame, there), apart)| {
                let (frame, (residual, _), apart) = (frame.as_ref()?, there?, apart?);
                let moved = by_along(frame, self.columns.slopes(frame, &self.coefficients));
                Some(residual + moved * apart.x)
            })
            .collect()
    }

    pub(super) fn equations(&self, sums: &[Sums; ROWS]) -> Equations {
        Equations::of(sums.each_ref(), self.sigmas, self.columns.estimated())
    }

    pub(super) fn prior(&self) -> Prior {
        let Self { at, unseen, shape_prior, columns: Columns { free, blocks, .. }, .. } = self;
        KnownBefore { at, free, shape_prior: shape_prior.as_ref(), unseen }.prior(blocks)
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
    fn follow_sigmas(&mut self, sums: &[Sums; ROWS], solved: &Solved) {
        let prior = self.prior();
        let count = solved.step.len();
        // Columns without a prior use up degrees of freedom, of each residual in proportion to its rows.
        let known = solved.known_by(&prior, self.columns.free.len());
        let rows: usize = sums.iter().map(|sums| sums.count).sum();
        let used_by_row = (count as f64 - known).max(0.0) / rows.max(1) as f64;
        for (sums, sigma) in sums.iter().zip(&mut self.sigmas) {
            let used = used_by_row * sums.count as f64;
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
