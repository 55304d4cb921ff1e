//! The fit, with its covariance by stops.

use super::problem::{PlateProblem, StopRows};
use super::spread::{Measured, freedom, spread_m};
use super::start;
use super::state::{HAND_EYE, LASER_PLANE, PlateState, SIZE};
use super::stop::{PlateStop, Support};
use crate::bundle::CameraPrior;
use crate::error::Error;
use crate::inverse_of_free::inverse_of_free;
use crate::laser_plane::{DOUBTFUL, KnownCamera};
use crate::sheet_tilt;
use nalgebra::{Matrix3, SMatrix, Vector3};
use trueline_geometry::statistics::median;
use trueline_geometry::{Plane, Pose};
use trueline_lsq::{LeastSquares, NormalEquations, SolveOptions, solve};
use trueline_model::Camera;

/// Fewest stops: six fix twelve unknowns, and more give their uncertainty.
pub const FEWEST_STOPS: usize = 8;

/// States that are tried as a start, from each part of the stops.
const STARTS: usize = 2;

/// A part of the stops is all but every fourth.
const FOLDS: usize = 4;

/// First assumed error of plate and robot, m.
const FIRST_SPREAD_M: f64 = 1e-4;

/// Rounds with Cauchy's weights.
const ROBUST_ROUNDS: usize = 6;

/// Stops better than this get no larger weights, m.
const LEAST_SCALE_M: f64 = 1e-6;

/// A stop is off by far more than the others where Cauchy's weights leave this of it: values above 15 typical ones.
const GROSS: f64 = 1.98;

/// Rounds of fitting, with weights from the round before.
const ROUNDS: usize = 6;

/// A stop that is off by more than this many standard deviations is left out: it is another plate, or another pose.
const OUTLIER: f64 = DOUBTFUL + 1.0;

/// At most this part of the stops is left out.
const MOST_LEFT_OUT: f64 = 0.2;

/// A laser plane from a plate, and all that was estimated with it.
#[derive(Clone, Debug)]
pub struct PlateFit {
    /// Camera, laser plane, hand-eye transform and plate.
    pub state: PlateState,
    /// Covariance in the order of the plate's state; zero for those held fixed.
    pub covariance: SMatrix<f64, SIZE, SIZE>,
    /// Spread of the stops beyond the noise of their pixels, along the plate's normal, m: of the stripe's distance from its
    /// prediction, and of its slope at a standard deviation from its middle.
    pub spread_m: [f64; 2],
    /// The stops, in their order.
    pub stops: Vec<StopResidual>,
    /// Middle of all points, camera frame, m.
    pub middle: Vector3<f64>,
    /// Root mean square distance of the stripes from the laser plane, m.
    pub rms_m: f64,
    /// How far the plate was tilted to either side in the view, standard deviation about two axes, the larger first, rad.
    pub tilts_rad: [f64; 2],
}

/// How one stop fits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StopResidual {
    /// Whether it counts.
    pub used: bool,
    /// Offset and slope of its stripe in standard deviations.
    pub z: [f64; 2],
}

impl PlateFit {
    /// Covariance of the laser plane's tilts (rad) and offset (m).
    #[must_use]
    pub fn plane_covariance(&self) -> Matrix3<f64> {
        self.covariance.fixed_view::<3, 3>(LASER_PLANE, LASER_PLANE).into()
    }

    /// Standard deviation of the plane's offset in the middle of the points, m.
    #[must_use]
    pub fn middle_sigma_m(&self) -> f64 {
        let tilts = self.middle.transpose() * sheet_tilt::axes(&self.plane());
        let d_distance = Vector3::new(tilts[0], tilts[1], -1.0);
        d_distance.dot(&(self.plane_covariance() * d_distance)).max(0.0).sqrt()
    }

    /// The laser plane in the camera frame.
    #[must_use]
    pub fn plane(&self) -> Plane {
        self.state.laser_plane_in_camera
    }

    /// Standard deviations of the hand-eye transform: rotation (rad) and translation (m).
    #[must_use]
    pub fn hand_eye_sigma(&self) -> [f64; 6] {
        std::array::from_fn(|k| self.covariance[(HAND_EYE + k, HAND_EYE + k)].max(0.0).sqrt())
    }

    /// Stops that count.
    #[must_use]
    pub fn used(&self) -> usize {
        self.stops.iter().filter(|stop| stop.used).count()
    }
}

/// Fits the laser plane, from a hand-eye transform that is right to about 10 degrees and 50 mm.
///
/// # Errors
/// Too few stops with a stripe, or stripes that no plate and no laser plane explain.
pub fn fit_plate(known: &KnownCamera, rough: &Pose, stops: &[PlateStop]) -> Result<PlateFit, Error> {
    let supports: Vec<Option<Support>> = stops.iter().map(|stop| Support::of(&known.camera, stop)).collect();
    let found = supports.iter().flatten().count();
    if found < FEWEST_STOPS {
        return Err(Error::TooFewStops { found, needed: FEWEST_STOPS });
    }
    let most = (MOST_LEFT_OUT * found as f64) as usize;
    let mut fit = Fit::begin(known, rough, supports.iter().flatten().copied().collect())?;
    fit.leave_out_gross(most.min(found - FEWEST_STOPS));
    fit.settle()?;
    fit.readmit(supports.iter().flatten());
    loop {
        fit.settle()?;
        let left_out = found - fit.problem.stops.len();
        let may_go = left_out < most && fit.problem.stops.len() > FEWEST_STOPS;
        let Some((worst, _)) = fit.worst().filter(|(_, z)| *z > OUTLIER && may_go) else { break };
        fit.remove(worst);
    }
    Ok(fit.conclude(&supports))
}

struct Fit {
    problem: PlateProblem,
    state: PlateState,
    fixed: Vec<usize>,
    covariance: SMatrix<f64, SIZE, SIZE>,
    spread_m: [f64; 2],
}

impl Fit {
    /// From the best of all starts: the one with all but a few stops nearest to its planes. Starts come from all stops
    /// and from all but every fourth, so that some of them exclude a wrong stop.
    fn begin(known: &KnownCamera, rough: &Pose, stops: Vec<Support>) -> Result<Self, Error> {
        let camera_prior = CameraPrior::new(&known.camera, &known.covariance).ok_or(Error::NotFixed)?;
        let sigmas_m = vec![[FIRST_SPREAD_M; 2]; stops.len()];
        let problem = PlateProblem { stops, sigmas_m, camera_prior, rough_tool_from_camera: *rough };
        let subsets = (0..=FOLDS).map(|fold| {
            let of_fold = |k: usize| fold == FOLDS || k % FOLDS != fold;
            (0..problem.stops.len()).filter(|k| of_fold(*k)).collect::<Vec<usize>>()
        });
        let enough = subsets.filter(|subset| subset.len() >= FEWEST_STOPS - 1);
        let begun = enough.flat_map(|subset| Self::of_subset(&problem, &known.camera, &subset));
        let settled = begun.filter_map(|mut fit| Some((fit.settle_robustly()?, fit)));
        settled.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, fit)| fit).ok_or(Error::NoPlate)
    }

    /// The whole problem at the states that fit a part of the stops.
    fn of_subset(problem: &PlateProblem, camera: &Camera, subset: &[usize]) -> Vec<Self> {
        let fixed = problem.camera_prior.held();
        let part = PlateProblem {
            stops: subset.iter().map(|k| problem.stops[*k]).collect(),
            sigmas_m: subset.iter().map(|k| problem.sigmas_m[*k]).collect(),
            ..problem.clone()
        };
        let starts = start::candidates(camera, &problem.rough_tool_from_camera, &part.stops);
        let possible = starts.into_iter().filter(|start| part.cost(start).is_finite()).take(STARTS);
        possible
            .filter_map(|start| solve(&part, start, &fixed, &SolveOptions::default()).ok())
            .map(|solution| Self {
                problem: problem.clone(),
                state: solution.state,
                fixed: fixed.clone(),
                covariance: SMatrix::zeros(),
                spread_m: [FIRST_SPREAD_M; 2],
            })
            .collect()
    }

    /// Fits with Cauchy's weights, so that a few wrong stops have no effect. The typical distance of a stop, m.
    fn settle_robustly(&mut self) -> Option<f64> {
        let mut scale_m = f64::INFINITY;
        for _ in 0..ROBUST_ROUNDS {
            scale_m = self.weigh_robustly()?;
            let solved = solve(&self.problem, self.state, &self.fixed, &SolveOptions::default()).ok()?;
            self.state = solved.state;
        }
        Some(scale_m)
    }

    fn weigh_robustly(&mut self) -> Option<f64> {
        let rows = self.problem.stops.iter().map(|stop| Some(StopRows::of(&self.state, stop)?.values_m));
        let rows: Vec<[f64; 2]> = rows.collect::<Option<_>>()?;
        let mut scales_m = [0.0; 2];
        for (kind, scale_m) in scales_m.iter_mut().enumerate() {
            // A normal distribution's standard deviation by its median.
            *scale_m = (1.4826 * median(rows.iter().map(|values| values[kind].abs()))?).max(LEAST_SCALE_M);
            for (sigmas, values) in self.problem.sigmas_m.iter_mut().zip(&rows) {
                sigmas[kind] = scale_m.hypot(0.5 * values[kind]);
            }
        }
        Some(scales_m[0].hypot(scales_m[1]))
    }

    /// Leaves out at most this many stops with far larger residuals than the others.
    fn leave_out_gross(&mut self, most: usize) {
        for _ in 0..most {
            let off = |(stop, sigmas): (&Support, &[f64; 2])| {
                let values = StopRows::of(&self.state, stop).map_or([f64::INFINITY; 2], |rows| rows.values_m);
                // Cauchy's weight of a value v is 1/(s² + v²/4): the rest of it is at most two.
                let part = |k: usize| (values[k] / sigmas[k]).abs();
                part(0).max(part(1))
            };
            let all = self.problem.stops.iter().zip(&self.problem.sigmas_m).map(off).enumerate();
            let Some((worst, _)) = all.max_by(|a, b| a.1.total_cmp(&b.1)).filter(|(_, part)| *part > GROSS)
            else {
                break;
            };
            self.remove(worst);
        }
    }

    /// Takes back the left-out stops that fit the result of the others.
    fn readmit<'a>(&mut self, all: impl Iterator<Item = &'a Support>) {
        for stop in all.filter(|stop| !self.counts(stop)).collect::<Vec<_>>() {
            let Some(rows) = StopRows::of(&self.state, stop) else { continue };
            let measured = self.measured(std::slice::from_ref(stop))[0];
            let z = |kind: usize| {
                let d = rows.d_unknowns[kind];
                let predicted = (d * self.covariance * d.transpose())[0];
                rows.values_m[kind] / (measured[kind].variance(self.spread_m[kind]) + predicted).sqrt()
            };
            if z(0).abs().max(z(1).abs()) < OUTLIER {
                self.problem.stops.push(*stop);
                self.problem.sigmas_m.push([FIRST_SPREAD_M; 2]);
            }
        }
    }

    /// Whether a stop is one of the problem's.
    fn counts(&self, stop: &Support) -> bool {
        self.problem.stops.iter().any(|kept| kept.pixels == stop.pixels)
    }

    fn remove(&mut self, stop: usize) {
        self.problem.stops.remove(stop);
        self.problem.sigmas_m.remove(stop);
    }

    /// Fits and weighs in turn, until the weights agree with the residuals.
    fn settle(&mut self) -> Result<(), Error> {
        for _ in 0..ROUNDS {
            let solved = solve(&self.problem, self.state, &self.fixed, &SolveOptions::default());
            self.state = solved.map_err(|_| Error::NoPlate)?.state;
            self.covariance = self.covariance()?;
            let measured = self.measured(&self.problem.stops);
            for kind in 0..2 {
                let of_kind: Vec<Measured> = measured.iter().map(|of| of[kind]).collect();
                self.spread_m[kind] = spread_m(&of_kind);
                for (sigmas, of) in self.problem.sigmas_m.iter_mut().zip(&of_kind) {
                    sigmas[kind] = of.variance(self.spread_m[kind]).sqrt();
                }
            }
        }
        Ok(())
    }

    fn covariance(&self) -> Result<SMatrix<f64, SIZE, SIZE>, Error> {
        let mut equations = NormalEquations::zeros(SIZE);
        self.problem.linearize(&self.state, &mut equations);
        let information = SMatrix::from_fn(|i, j| equations.hessian[(i, j)]);
        inverse_of_free(&information, &self.fixed).ok_or(Error::NoPlate)
    }

    /// Each stop's two numbers; stops that cannot be on the plate are infinitely far off.
    fn measured(&self, stops: &[Support]) -> Vec<[Measured; 2]> {
        let of_stop = |stop: &Support| {
            let Some(rows) = StopRows::of(&self.state, stop) else {
                return [Measured { value_m: f64::INFINITY, noise: 0.0, gain: 1.0, leverage: 0.0 }; 2];
            };
            let noise = (stop.sigma_px / rows.px_per_m).powi(2);
            std::array::from_fn(|kind| {
                let d = rows.d_unknowns[kind];
                let known = (d * self.covariance * d.transpose())[0];
                let variance = noise + (rows.d_surface * self.spread_m[kind]).powi(2);
                let leverage = (known / variance).clamp(0.0, 1.0);
                Measured { value_m: rows.values_m[kind], noise, gain: rows.d_surface, leverage }
            })
        };
        stops.iter().map(of_stop).collect()
    }

    /// The stop that is farthest off, and by how much.
    fn worst(&self) -> Option<(usize, f64)> {
        let z = |of: [Measured; 2]| of[0].z(self.spread_m[0]).abs().max(of[1].z(self.spread_m[1]).abs());
        let all = self.measured(&self.problem.stops).into_iter().map(z).enumerate();
        all.max_by(|a, b| a.1.total_cmp(&b.1))
    }

    fn conclude(mut self, supports: &[Option<Support>]) -> PlateFit {
        self.allow_for_few_stops();
        let points: Vec<Vector3<f64>> = (self.problem.stops.iter())
            .filter_map(|stop| Some(StopRows::of(&self.state, stop)?.points))
            .flatten()
            .collect();
        let plane = self.state.laser_plane_in_camera;
        let count = points.len().max(1) as f64;
        let of_stop = |support: &Option<Support>| {
            let Some(stop) = support else { return StopResidual { used: false, z: [f64::NAN; 2] } };
            let [offset, slope] = self.measured(std::slice::from_ref(stop))[0];
            let z = [offset.z(self.spread_m[0]), slope.z(self.spread_m[1])];
            StopResidual { used: self.counts(stop), z }
        };
        PlateFit {
            stops: supports.iter().map(of_stop).collect(),
            middle: points.iter().sum::<Vector3<f64>>() / count,
            rms_m: (points.iter().map(|p| plane.signed_distance(p).powi(2)).sum::<f64>() / count).sqrt(),
            tilts_rad: self.tilts_rad(),
            covariance: self.covariance,
            spread_m: self.spread_m,
            state: self.state,
        }
    }

    /// The spreads are estimated from few numbers. On average the inverse of such a variance is too large by ν/(ν − 2),
    /// and so would be the result's information.
    fn allow_for_few_stops(&mut self) {
        let measured = self.measured(&self.problem.stops);
        for kind in 0..2 {
            let of_kind: Vec<Measured> = measured.iter().map(|of| of[kind]).collect();
            let free = freedom(&of_kind);
            let factor = if free > 3.0 { free / (free - 2.0) } else { 3.0 };
            let wider_m = self.spread_m[kind] * factor.sqrt();
            for (sigmas, of) in self.problem.sigmas_m.iter_mut().zip(&of_kind) {
                sigmas[kind] = of.variance(wider_m).sqrt();
            }
        }
        if let Ok(covariance) = self.covariance() {
            self.covariance = covariance;
        }
    }

    /// Standard deviations of the plate's normal in the tool frame about two axes.
    fn tilts_rad(&self) -> [f64; 2] {
        let normal = self.state.plate_in_base.normal().into_inner();
        let normals: Vec<Vector3<f64>> =
            self.problem.stops.iter().map(|stop| stop.base_from_tool.rotation.inverse() * normal).collect();
        let count = normals.len().max(1) as f64;
        let mean = normals.iter().sum::<Vector3<f64>>() / count;
        let scatter =
            normals.iter().fold(Matrix3::zeros(), |sum, n| sum + (n - mean) * (n - mean).transpose());
        let mut squares: Vec<f64> = (scatter / count).symmetric_eigenvalues().iter().copied().collect();
        squares.sort_by(|a, b| b.total_cmp(a));
        [0, 1].map(|k| squares[k].max(0.0).sqrt())
    }
}
