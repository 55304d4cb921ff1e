//! All samples so far: a calibration, and the sums of later samples.

use super::bias::Bias;
use super::block::{Block, Decisions};
use super::innovation::{self, Change};
use super::sums::{Sums, inverse};
use crate::calibration::Calibration;
use crate::config::Config;
use crate::error::Error;
use crate::problem::parameters::{LINES, Parameters};
use nalgebra::{DMatrix, DVector};
use trueline_dataset::Recording;

/// A window of samples that are tested together, ns.
const WINDOW_NS: i64 = 20_000_000_000;
/// Threshold of a drift, as in a calibration.
const DRIFT_SIGMAS: f64 = 5.0;

/// Estimate of a stream so far.
#[derive(Clone, Debug)]
pub struct Estimate {
    /// The unknowns.
    pub parameters: Parameters,
    /// The random part of each standard deviation, SI. `None` if unobservable.
    pub noise_sigma: Vec<Option<f64>>,
    /// The drift that was removed from the stamps, ppm, and the stamp at which the time offset holds, ns.
    pub drift: Option<(f64, i64)>,
    /// New samples that disagree with earlier ones.
    pub change: Option<Change>,
}

/// A calibration and the later samples.
pub(super) struct Past {
    at: Parameters,
    decisions: Decisions,
    free: Vec<usize>,
    /// Sums of samples that no clock moves any more.
    settled: Sums,
    /// Sums of the calibration's samples and of the prior, whose gradient is zero at its optimum, and of the later samples.
    sums: Sums,
    window: Sums,
    window_since_ns: i64,
    /// Ratio of the calibration's standard deviations from noise to those from its sums.
    scale: Vec<Option<f64>>,
    bias: Option<Bias>,
    change: Option<Change>,
}

impl Past {
    /// From a calibration of samples. `None` if time offset or hand-eye are not fully observable, or the seam is a curve.
    pub(super) fn of(
        calibration: &Calibration,
        recording: &Recording,
        config: &Config,
    ) -> Result<Option<Self>, Error> {
        let at = calibration.best_fit().clone();
        let shows_all = (0..LINES).all(|k| calibration.noise_sigma(k).is_some());
        if !shows_all || at.lines.is_empty() {
            return Ok(None);
        }
        let decisions = Decisions::of(calibration, recording, config)?;
        let dimension = at.dimension();
        let block = decisions.block(recording, i64::MIN, config, &at)?;
        let mut sums = Sums::zeros(dimension);
        decisions.with_problem(&block, config, &at, |problem, about_s| {
            sums.add_problem(problem, &at, about_s);
        });
        sums.gradient.fill(0.0);
        let known = at.known(block.shape_prior(recording, config).as_ref()).information(dimension);
        let mut of_unknowns = sums.hessian.view_mut((0, 0), (dimension, dimension));
        of_unknowns += &known;
        let estimated = &calibration.findings.unknowns.estimated;
        let free: Vec<usize> = (0..dimension).filter(|k| estimated[*k]).collect();
        let Some(covariance) = inverse(&sums.hessian, &free) else { return Ok(None) };
        let covariance = covariance.view((0, 0), (dimension, dimension)).into_owned();
        let noise = calibration.best_fit_noise_covariance();
        let over = |k: usize| {
            calibration.noise_sigma(k)?;
            Some((noise[(k, k)] / covariance[(k, k)]).sqrt())
        };
        let scale: Vec<_> = (0..dimension).map(|k| over(k).filter(|scale| scale.is_finite())).collect();
        let inflation = (0..LINES).filter_map(|k| scale[k]).map(|s| s * s).sum::<f64>() / LINES as f64;
        let mut bias = None;
        decisions.with_problem(&block, config, &at, |problem, _| {
            bias = Bias::of(calibration, problem, config, &covariance, inflation.max(1.0));
        });
        let window_since_ns = recording.features.last().map_or(0, |feature| feature.stamp_ns);
        let window = Sums::zeros(dimension);
        let (settled, sums) =
            if decisions.are_clocks_whole() { (window.clone(), sums) } else { (sums, window.clone()) };
        Ok(Some(Self {
            at,
            decisions,
            free,
            settled,
            sums,
            window,
            window_since_ns,
            scale,
            bias,
            change: None,
        }))
    }

    /// The time offset used to place samples, s.
    pub(super) fn time_offset_s(&self) -> f64 {
        self.at.time_offset_s
    }

    /// New samples that disagree.
    pub(super) fn change(&self) -> Option<Change> {
        self.change
    }

    /// Adds the features of a recording after one stamp, up to another one. Returns the number of linearised features.
    pub(super) fn add(
        &mut self,
        recording: &Recording,
        [after_ns, last_ns]: [i64; 2],
        config: &Config,
    ) -> Result<usize, Error> {
        self.follow_clocks(recording, last_ns);
        let block: Block = self.decisions.block(recording, after_ns, config, &self.at)?;
        let mut new = Sums::zeros(self.at.dimension());
        self.decisions.with_problem(&block, config, &self.at, |problem, about_s| {
            new.add_problem(problem, &self.at, about_s);
            if let Some(bias) = &mut self.bias {
                bias.add(problem, &self.at);
            }
        });
        self.window.add(&new);
        if last_ns - self.window_since_ns >= WINDOW_NS {
            self.close_window(last_ns);
        }
        Ok(new.count)
    }

    /// Moves all samples of the clocks' phase with their lines when new stamps update these.
    fn follow_clocks(&mut self, recording: &Recording, last_ns: i64) {
        let moved = self.decisions.follow(recording);
        if moved.is_new {
            self.close_window(last_ns);
            let sums = std::mem::replace(&mut self.sums, Sums::zeros(self.at.dimension()));
            self.settled.add(&sums);
        } else {
            self.sums.move_stamps(moved.shift_s, moved.rate);
            self.window.move_stamps(moved.shift_s, moved.rate);
        }
    }

    fn all_before_window(&self) -> Sums {
        let mut all = self.settled.clone();
        all.add(&self.sums);
        all
    }

    fn close_window(&mut self, last_ns: i64) {
        if let Some((step, covariance)) = self.solved(&self.all_before_window()) {
            let scale = self.scale.first().copied().flatten().unwrap_or(1.0);
            let change = innovation::change(&self.window, self.window_since_ns, &covariance, &step, scale);
            self.change = self.change.or(change);
        }
        self.sums.add(&self.window);
        self.window = Sums::zeros(self.at.dimension());
        self.window_since_ns = last_ns;
    }

    /// The step to the optimum of sums, and its covariance, with a drift if it is significant.
    fn solved(&self, sums: &Sums) -> Option<(DVector<f64>, DMatrix<f64>)> {
        let drift = self.at.dimension();
        let solve = |free: &[usize]| {
            let covariance = inverse(&sums.hessian, free)?;
            Some((-(&covariance * &sums.gradient), covariance))
        };
        let scale = self.scale.first().copied().flatten().unwrap_or(1.0);
        let of_stamps_ppm = self.decisions.rate_sigma_ppm();
        let is_plain = |(step, covariance): &(DVector<f64>, DMatrix<f64>)| {
            let sigma_ppm = (scale * covariance[(drift, drift)].sqrt()).hypot(of_stamps_ppm);
            let is_new = step[drift].abs() > DRIFT_SIGMAS * sigma_ppm;
            self.decisions.has_drift() || is_new
        };
        solve(&[self.free.as_slice(), &[drift]].concat()).filter(is_plain).or_else(|| solve(&self.free))
    }

    /// Estimate from all samples. `None` if their sums have no solution.
    pub(super) fn estimate(&mut self) -> Option<Estimate> {
        let mut sums = self.all_before_window();
        sums.add(&self.window);
        let (step, covariance) = self.solved(&sums)?;
        let dimension = self.at.dimension();
        let covariance = covariance.view((0, 0), (dimension, dimension)).into_owned();
        let mut moved = step.rows(0, dimension).into_owned();
        if let Some(bias) = &mut self.bias {
            moved += bias.followed(&moved, &covariance)?;
        }
        let sigma = |(k, scale): (usize, &Option<f64>)| Some((*scale)? * covariance[(k, k)].sqrt());
        let drift_ppm = self.decisions.drift_ppm() + step[dimension];
        Some(Estimate {
            parameters: self.at.retract(&moved),
            noise_sigma: self.scale.iter().enumerate().map(sigma).collect(),
            drift: (drift_ppm != 0.0).then_some((drift_ppm, self.decisions.about_ns)),
            change: self.change,
        })
    }
}
