//! Robot errors within the scan, estimated from the residuals.
//!
//! Beside all other unknowns the score of the robot's modes is u = Zᵀ W r, with S = Zᵀ W Z − Zᵀ W J C₀ Jᵀ W Z. For errors of α times the modes'
//! level, u ~ N(0, S + α² S²). α is the maximum of this likelihood on a grid. Errors of position and of attitude are estimated separately. They are
//! reported only if they explain most of the residuals, because correlated noise or a curved seam also excites the modes.

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

/// Number of strongest modes used for each of the six errors.
const STRONGEST: usize = 8;
/// Least fraction of the residuals' squares that the modes must explain.
const EXPLAINS: f64 = 0.4;
/// Least ratio to the assumed errors at which a robot counts as worse.
pub(crate) const WORSE: f64 = 1.5;
/// Least log likelihood ratio: a factor of e⁵, once in a thousand scans.
const LOG_RATIO: f64 = 5.0;
/// Sizes that are tried, relative to those of the assumed robot.
const TRIED: [f64; 12] = [0.25, 0.5, 1.0, 1.5, 2.0, 3.0, 5.0, 8.0, 12.0, 20.0, 30.0, 50.0];
/// Directions with a remainder below this fraction of the strongest belong to the other unknowns: the robot's constant error is absorbed by the
/// hand-eye transform.
const LEAST: f64 = 1e-6;
/// Least ratio of the assumed errors' variance to that of the noise for a direction that estimates their size. In weaker directions other errors
/// would decide.
const VISIBLE: f64 = 0.1;

/// Robot errors from the residuals of a solution whose covariance has the root `root`. `None` unless they are clearly larger than assumed. A
/// component that is not clearly larger keeps its assumed value.
#[must_use]
pub(crate) fn shown(
    problem: &LineProblem<'_>,
    at: &Parameters,
    root: &DMatrix<f64>,
    taken: RobotSigmas,
) -> Option<RobotSigmas> {
    Scores::of(problem, at, root)?.shown(taken)
}

/// The strongest modes on a path, for errors of the assumed size.
fn modes(poses: &[Pose]) -> Option<RobotField> {
    let assumed = RobotSigmas::of_accuracy(ASSUMED_ROBOT_ACCURACY_M);
    Some(RobotField::new(assumed, poses)?.strongest(STRONGEST))
}

/// Eigenvalues of S and the score along each direction, in directions that the other unknowns do not absorb.
struct Beside(Vec<(f64, f64)>);

impl Beside {
    /// uᵀ S⁻¹ u.
    fn explained(&self) -> f64 {
        self.0.iter().map(|(value, score)| score * score / value).sum()
    }

    /// Log likelihood for a multiple of the assumed errors.
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

    /// Log likelihood ratio of the most likely multiple to `taken` times.
    fn gain(&self, taken: f64) -> f64 {
        self.log_likelihood(self.best()) - self.log_likelihood(taken)
    }

    /// Ratio of the errors to the assumed ones. `None` unless clearly above `taken`.
    fn times(&self, taken: f64, squares: f64) -> Option<f64> {
        let best = self.best();
        let is_worse = best > WORSE * taken && self.gain(taken) > LOG_RATIO;
        (is_worse && self.explained() > EXPLAINS * squares).then_some(best)
    }
}

/// Maximum number of observations evaluated. Beyond it every n-th is used, because robot errors change slowly along the path.
const MOST_OBSERVATIONS: usize = 3000;

/// Sums over the observations evaluated.
struct Scores {
    /// Zᵀ W r.
    score: DVector<f64>,
    /// Zᵀ W Z.
    own: DMatrix<f64>,
    /// L⁻¹ C½ᵀ (Jᵀ W r + P x): zero at the optimum of these observations, which differs from that of all. L Lᵀ is the information of these
    /// observations and the prior, P, on the other unknowns in the coordinates of C½. It is the identity if all observations are used.
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

    /// From the products of rows with modes, slopes in the root's coordinates, and residual.
    fn from_products(
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

    /// The errors that are clearly larger than assumed.
    fn shown(&self, taken: RobotSigmas) -> Option<RobotSigmas> {
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

    /// The scores of position (0) or attitude (1) beside the other unknowns.
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
