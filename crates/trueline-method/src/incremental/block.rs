//! Prepares samples of a stream with the decisions of a calibration.

use super::clocks::Clocks;
use super::even_clock::Moved;
use crate::assess::tilt_bias::{BIAS, TiltBias};
use crate::calibration::Calibration;
use crate::config::Config;
use crate::error::Error;
use crate::input::noise_levels::NoiseLevels;
use crate::input::observations::{Observations, observe, origin_ns};
use crate::input::shape_knowledge::ShapeKnowledge;
use crate::input::shape_prior::ShapePrior;
use crate::input::timestamps::{Dejittered, Sampling};
use crate::problem::line_problem::{Criterion, LineProblem};
use crate::problem::parameters::Parameters;
use crate::problem::placement::placement;
use crate::problem::usable::UsableObservations;
use nalgebra::SVector;
use trueline_dataset::Recording;
use trueline_geometry::Pose;

/// Exposures this close to the end of the robot's path are postponed, s.
const MARGIN_S: f64 = 10e-6;

/// Decisions of a calibration about the treatment of samples.
#[derive(Clone, Debug)]
pub(super) struct Decisions {
    clocks: Clocks,
    noise: Option<NoiseLevels>,
    factor: f64,
    drift_ppm: Option<f64>,
    /// The stamp at which a drift is zero, ns.
    pub(super) about_ns: i64,
    bias: Option<(TiltBias, SVector<f64, BIAS>)>,
}

/// Samples with features ready to be linearised.
pub(super) struct Block {
    observations: Observations,
    about_s: f64,
}

impl Decisions {
    /// From a calibration of these samples.
    pub(super) fn of(
        calibration: &Calibration,
        recording: &Recording,
        config: &Config,
    ) -> Result<Self, Error> {
        let findings = &calibration.findings;
        let stamps: Vec<i64> = recording.features.iter().map(|f| f.stamp_ns).collect();
        let middle_ns = stamps.first().copied().unwrap_or(0) / 2 + stamps.last().copied().unwrap_or(0) / 2;
        let drifted = findings.clock.drifted;
        let dejittered = Dejittered {
            robot: findings.streams.robot.dejittered,
            images: findings.streams.images.dejittered,
        };
        let about_ns = drifted.map_or(middle_ns, |d| origin_ns(recording) + (d.about_s * 1e9).round() as i64);
        let mut decisions = Self {
            clocks: Clocks::of(recording, dejittered, about_ns),
            noise: None,
            factor: findings.fit.noise_factor,
            drift_ppm: drifted.map(|drift| drift.ppm),
            about_ns,
            bias: None,
        };
        let block = decisions.block(recording, i64::MIN, config, calibration.best_fit())?;
        let sampling = Sampling::of(recording, origin_ns(recording));
        decisions.noise = Some(NoiseLevels {
            robot_sigma_m: config.robot_sigma_m.unwrap_or(block.observations.robot.noise_m),
            stamp_sigma_s: sampling.stamp_sigma_s(config, dejittered),
            factor: decisions.factor,
        });
        if let Some(bias) = &findings.checks.feature_bias {
            let px = SVector::from_fn(|k, _| bias.px[k / 2][k % 2]);
            decisions.bias = Some((TiltBias::about(&block.poses(calibration.best_fit())), px));
        }
        Ok(decisions)
    }

    /// Whether the stamps drift.
    pub(super) fn has_drift(&self) -> bool {
        self.drift_ppm.is_some()
    }

    /// The drift that was removed, ppm.
    pub(super) fn drift_ppm(&self) -> f64 {
        self.drift_ppm.unwrap_or(0.0)
    }

    /// Whether the stamps have had regular clocks of one phase since the calibration began, or are used as recorded.
    pub(super) fn are_clocks_whole(&self) -> bool {
        self.clocks.are_whole
    }

    /// Standard deviation of a drift from the noise of the clocks' stamps, ppm.
    pub(super) fn rate_sigma_ppm(&self) -> f64 {
        1e6 * self.clocks.rate_variance().sqrt()
    }

    /// Updates the clocks with new stamps.
    pub(super) fn follow(&mut self, recording: &Recording) -> Moved {
        self.clocks.follow(recording)
    }

    /// The features of a recording with stamps after `after_ns`, treated as decided.
    pub(super) fn block(
        &self,
        recording: &Recording,
        after_ns: i64,
        config: &Config,
        at: &Parameters,
    ) -> Result<Block, Error> {
        let origin_ns = origin_ns(recording);
        let sampling = Sampling::of(recording, origin_ns);
        let recorded = observe(recording, &sampling, config)?;
        let mut observations = self.clocks.placed(recording, &sampling, config, &recorded)?;
        observations.list.retain(|o| recording.features[o.row as usize].stamp_ns > after_ns);
        let about_s = (self.about_ns - origin_ns) as f64 * 1e-9;
        for o in &mut observations.list {
            o.stamp_s -= self.drift_ppm() * 1e-6 * (o.stamp_s - about_s);
        }
        if let Some((tilt, px)) = &self.bias {
            let mut list = std::mem::take(&mut observations.list);
            for o in &mut list {
                let Some(placement) = placement(&observations, o, at) else { continue };
                o.point_in_camera -= observations.sheet.axes() * (tilt.slopes(o, at, &placement) * px);
            }
            observations.list = list;
        }
        Ok(Block { observations, about_s })
    }

    /// Passes the problem of a block at a state, and the stamp at which its drift is zero, to `use_it`.
    pub(super) fn with_problem(
        &self,
        block: &Block,
        config: &Config,
        at: &Parameters,
        use_it: impl FnOnce(&LineProblem<'_>, f64),
    ) {
        let Some(noise) = &self.noise else { return };
        let placed = UsableObservations::within(&block.observations, at.time_offset_s, MARGIN_S);
        let criterion = Criterion { residual: config.residual, loss: config.final_loss() };
        let list = placed.of(&block.observations);
        use_it(&LineProblem::new(&block.observations, list, criterion, noise, at), block.about_s);
    }
}

impl Block {
    /// Prior of the sensor's shape before these samples.
    pub(super) fn shape_prior(&self, recording: &Recording, config: &Config) -> Option<ShapePrior> {
        ShapeKnowledge::of(recording, &self.observations).prior(config)
    }

    fn poses(&self, at: &Parameters) -> Vec<Pose> {
        let placed = |o| placement(&self.observations, o, at);
        self.observations.list.iter().filter_map(placed).map(|p| p.base_from_tool).collect()
    }
}
