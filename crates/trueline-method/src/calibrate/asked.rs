//! The record of the requested model.

use crate::assess::levels::SystematicLevels;
use crate::config::{HeldSigma, Measurements};
use crate::hypotheses::clock_drift::DriftFree;
use crate::models::{Because, Block, Clock, ModelTried, Role, SeamModel, role};
use crate::problem::parameters::{ROTATION, TIME_OFFSET};
use crate::solve::settings::FitSettings;
use crate::solve::solver::Solver;

/// The requested model, fitted to noise alone.
pub(crate) fn asked(settings: &FitSettings<'_>, levels: &SystematicLevels, found: &DriftFree) -> ModelTried {
    let solver = Solver { observations: &found.observations, settings: *settings };
    let config = settings.config;
    let is_free = |component: usize| !settings.fixed.contains(&component);
    let role = |block: Block| match block {
        Block::TimeOffset => role(is_free(TIME_OFFSET), config.held_sigma.time_s.is_some()),
        Block::HandEye => {
            let HeldSigma { rotation_rad, translation_m, .. } = config.held_sigma;
            role(is_free(ROTATION), rotation_rad.is_some() || translation_m.is_some())
        }
        Block::Line => role(config.drawn_lines.is_empty(), true),
        Block::Bow => role(!found.fit.parameters().curvatures.is_empty(), false),
        Block::Sensor => role(settings.shape_prior.is_some(), levels.held_shape.is_some()),
        Block::Detector => role(levels.bias_is_estimated, levels.feature_bias_px > 0.0),
        Block::Robot => role(false, levels.robot_accuracy_m > 0.0),
        Block::EdgeRadius => role(false, levels.edge_radius_m > 0.0),
        Block::SeamForm | Block::PoseLag | Block::Axes => Role::Held,
    };
    ModelTried {
        because: Because::Asked,
        measurements: Measurements::Seam,
        roles: Block::ALL.map(role),
        target: SeamModel::Line,
        clock: clock(settings, found),
        robot_lag_s: 0.0,
        log_evidence: -0.5 * solver.twice_negative_log_likelihood(found.fit.parameters()),
        noise_factor: found.fit.noise.factor,
    }
}

fn clock(settings: &FitSettings<'_>, found: &DriftFree) -> Clock {
    match (found.stepped, found.drifted) {
        _ if settings.config.at_stops => Clock::None,
        (Some(_), _) => Clock::Steps,
        (None, Some(_)) => Clock::Drifts,
        (None, None) => Clock::Even,
    }
}
