//! Robot errors within the scan, estimated from the residuals.
//!
//! Beside all other unknowns the score of the robot's modes is u = Zᵀ W r, and with S = Zᵀ W Z − Zᵀ W J C₀ Jᵀ W Z and errors that are α
//! times those the modes were made for, u ~ N(0, S + α² S²): α is where that is most likely, on a grid. Errors of position and of
//! attitude are tried, each for itself. They are reported only if they explain most of the residuals: noise that lasts, or a seam that
//! wanders, moves the modes as well.

use crate::assess::robot_field::{RobotField, RobotSigmas};
use crate::assess::systematic::robot_columns;
use crate::config::ASSUMED_ROBOT_ACCURACY_M;
use crate::problem::layout::Layout;
use crate::problem::line_problem::LineProblem;
use crate::problem::parameters::Parameters;
use crate::problem::row_products::RowProducts;
use crate::thinning::stride;
use nalgebra::{DMatrix, DVector, DVectorViewMut};
use trueline_geometry::Pose;
use trueline_lsq::NormalEquations;

/// Modes that are looked at, the strongest of each of the six errors.
const STRONGEST: usize = 8;
/// The modes must explain this part of the residuals' squares.
const EXPLAINS: f64 = 0.4;
/// A robot that is less than so much worse than it was taken to be is as good as that.
const WORSE: f64 = 1.5;
/// The likelihood must be e⁵ times as large: once in a thousand scans.
const LOG_RATIO: f64 = 5.0;
/// Errors that are tried, times those of the robot that is assumed.
const TRIED: [f64; 12] = [0.25, 0.5, 1.0, 1.5, 2.0, 3.0, 5.0, 8.0, 12.0, 20.0, 30.0, 50.0];
/// Directions of which the other unknowns leave less than this part of the strongest are theirs: the robot's constant part is the
/// hand-eye transform's.
const LEAST: f64 = 1e-6;
/// Least ratio of the assumed errors' variance to that of the noise, for a direction that estimates their size. Where they
/// hardly show, whatever else is wrong would decide that.
const VISIBLE: f64 = 0.1;

/// The errors that the residuals of a solution show, whose covariance's root is `root`; `None` where they are not plainly larger than
/// those that were taken. What is not plainly larger stays as it was taken.
#[must_use]
pub(crate) fn shown(
    problem: &LineProblem<'_>,
    at: &Parameters,
    root: &DMatrix<f64>,
    taken: RobotSigmas,
) -> Option<RobotSigmas> {
    Scores::of(problem, at, root)?.shown(taken)
}

/// The strongest modes on a path of errors of the size that is assumed.
pub(crate) fn modes(poses: &[Pose]) -> Option<RobotField> {
    let assumed = RobotSigmas::of_accuracy(ASSUMED_ROBOT_ACCURACY_M);
    Some(RobotField::new(assumed, poses)?.strongest(STRONGEST))
}

/// Eigenvalues of S and what the score is along each direction, where the other unknowns leave something of it.
struct Beside(Vec<(f64, f64)>);

impl Beside {
    /// uᵀ S⁻¹ u.
    fn explained(&self) -> f64 {
        self.0.iter().map(|(value, score)| score * score / value).sum()
    }

    /// For errors that are a multiple of the assumed ones.
    fn log_likelihood(&self, times: f64) -> f64 {
        let of = |(value, score): &(f64, f64)| {
            let variance = value + times * times * value * value;
            -0.5 * (variance.ln() + score * score / variance)
        };
        self.0.iter().filter(|(value, _)| *value > VISIBLE).map(of).sum::<f64>()
    }

    /// The most likely multiple.
    fn best(&self) -> f64 {
        let likeliest = |a: &f64, b: &f64| self.log_likelihood(*a).total_cmp(&self.log_likelihood(*b));
        TRIED.into_iter().max_by(likeliest).unwrap_or(1.0)
    }

    /// By how much the most likely multiple is likelier than `taken` times, as a logarithm.
    fn gain(&self, taken: f64) -> f64 {
        self.log_likelihood(self.best()) - self.log_likelihood(taken)
    }

    /// How many times larger than assumed the errors are; `None` where they are not plainly larger than `taken` times.
    fn times(&self, taken: f64, squares: f64) -> Option<f64> {
        let best = self.best();
        let is_worse = best > WORSE * taken && self.gain(taken) > LOG_RATIO;
        (is_worse && self.explained() > EXPLAINS * squares).then_some(best)
    }
}

/// Observations that are looked at; of more, one in several represents the rest, for a robot's errors change slowly along the path.
pub(crate) const MOST_OBSERVATIONS: usize = 3000;

/// Sums over the observations that are looked at.
pub(crate) struct Scores {
    /// Zᵀ W r.
    score: DVector<f64>,
    /// Zᵀ W Z.
    own: DMatrix<f64>,
    /// L⁻¹ C½ᵀ (Jᵀ W r + P x): zero at the optimum, which that of some of the observations is not. L Lᵀ is what these observations and
    /// the prior, P, tell of the other unknowns in the coordinates of C½: one where all are looked at.
    others: DVector<f64>,
    /// L⁻¹ C½ᵀ Jᵀ W Z.
    cross: DMatrix<f64>,
    /// rᵀ W r.
    squares: f64,
}

impl Scores {
    fn of(problem: &LineProblem<'_>, at: &Parameters, root: &DMatrix<f64>) -> Option<Self> {
        let every = stride(problem.list.len(), MOST_OBSERVATIONS);
        let placed: Vec<_> = problem
            .selected()
            .step_by(every)
            .filter_map(|pair| Some((pair, problem.placement(pair.0, at)?)))
            .collect();
        let poses: Vec<Pose> = placed.iter().map(|(_, placement)| placement.base_from_tool).collect();
        let field = modes(&poses)?;
        let (modes, unknowns) = (6 * field.modes(), root.ncols());
        let mut products = RowProducts::new(modes + unknowns + 1);
        let root_rows = root.transpose();
        for (pair, placement) in &placed {
            let (Some((residual, jacobian)), Some(columns)) = (
                problem.whitened_where(*pair, at, placement),
                robot_columns(&field, problem, *pair, at, placement),
            ) else {
                continue;
            };
            let root_weight = problem.loss.weight(residual.norm_squared()).sqrt();
            let line = pair.0.line as usize;
            for (k, residual) in residual.iter().enumerate() {
                let (of_modes, rest) = products.next_row().split_at_mut(modes);
                of_modes.copy_from_slice((columns.row(k) * root_weight).transpose().as_slice());
                let (slopes, last) = rest.split_at_mut(unknowns);
                slopes.fill(0.0);
                let mut slopes = DVectorViewMut::from_slice(slopes, unknowns);
                let by_local = jacobian.row(k).transpose();
                let weighed = (by_local.as_slice(), root_weight);
                problem.unknowns.add_in_root(line, weighed, &root_rows, &mut slopes);
                last[0] = residual * root_weight;
            }
        }
        Self::from_products(&products.sums(), modes, problem.known_beforehand(at), &root_rows)
    }

    /// From the products of rows of modes, slopes in the root's coordinates, and residual.
    pub(crate) fn from_products(
        products: &DMatrix<f64>,
        modes: usize,
        known: NormalEquations,
        root_rows: &DMatrix<f64>,
    ) -> Option<Self> {
        let unknowns = root_rows.nrows();
        let last = modes + unknowns;
        let by_others = |column: usize, columns: usize| products.view((modes, column), (unknowns, columns));
        let information = by_others(modes, unknowns) + root_rows * known.hessian * root_rows.transpose();
        let gradient = by_others(last, 1).column(0) + root_rows * known.gradient;
        let factor = information.cholesky()?.l();
        Some(Self {
            score: products.view((0, last), (modes, 1)).column(0).into_owned(),
            own: products.view((0, 0), (modes, modes)).into_owned(),
            others: factor.solve_lower_triangular(&gradient)?,
            cross: factor.solve_lower_triangular(&by_others(0, modes))?,
            squares: products[(last, last)],
        })
    }

    /// Remaining pull on the other unknowns, σ.
    #[cfg(test)]
    pub(crate) fn others(&self) -> &DVector<f64> {
        &self.others
    }

    /// The errors that are plainly larger than those that were taken.
    pub(crate) fn shown(&self, taken: RobotSigmas) -> Option<RobotSigmas> {
        let assumed = RobotSigmas::of_accuracy(ASSUMED_ROBOT_ACCURACY_M);
        let [position, attitude] = [0, 1].map(|kind| self.beside_others(kind));
        let taken_times = [taken.position_m / assumed.position_m, taken.attitude_rad / assumed.attitude_rad];
        if attitude.gain(taken_times[1]) > position.gain(taken_times[0]) {
            let times = attitude.times(taken_times[1], self.squares)?;
            Some(RobotSigmas { attitude_rad: times * assumed.attitude_rad, ..taken })
        } else {
            let times = position.times(taken_times[0], self.squares)?;
            Some(RobotSigmas { position_m: times * assumed.position_m, ..taken })
        }
    }

    /// What the other unknowns leave of the scores of position (0) or attitude (1).
    fn beside_others(&self, kind: usize) -> Beside {
        let chosen: Vec<usize> = (0..self.score.len()).filter(|k| k / 3 % 2 == kind).collect();
        let cross = self.cross.select_columns(&chosen);
        let raw = self.own.select_columns(&chosen).select_rows(&chosen);
        let least = LEAST * raw.diagonal().max();
        let own = raw - cross.transpose() * &cross;
        let eigen = ((&own + own.transpose()) * 0.5).symmetric_eigen();
        let beside = self.score.select_rows(&chosen) - cross.transpose() * &self.others;
        let score = eigen.eigenvectors.transpose() * beside;
        let pairs = eigen.eigenvalues.iter().copied().zip(score.iter().copied());
        Beside(pairs.filter(|(value, _)| *value > least).collect())
    }
}
