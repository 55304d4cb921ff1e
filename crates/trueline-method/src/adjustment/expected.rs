//! The errors that an adjustment expects: blocks that it estimates, and consider parameters.

use crate::adjustment::blocks::Block;
use crate::adjustment::blocks::{Amplitude, Kind};
use crate::adjustment::columns::{Columns, Considered};
use crate::adjustment::form::Hats;
use crate::adjustment::settings::Settings;
use crate::adjustment::sights::{Frame, State};
use crate::assess::robot_field::RobotField;
use crate::order_statistics::quantile;
use nalgebra::Vector3;

/// Spacing (m) of the hats of the long and of the short form of a seam, and the prior share of the waviness in each.
const FORMS: [(f64, f64); 2] = [(0.020, 0.85), (0.005, 0.5)];
/// Largest plausible form of a seam, m.
const LARGEST_FORMS_M: [f64; 2] = [2e-3, 1e-3];
/// Unit of the estimated lag, s.
pub(super) const UNIT_OF_LAG_S: f64 = 0.03;
/// Prior standard deviation of a lag about each tried value, s.
pub(crate) const LAG_SIGMA_S: f64 = 0.01;
/// Largest robot error, in multiples of its class.
const WORST_ROBOT: f64 = 3.0;
/// Largest robot error of an uncalibrated arm, where the data sheet states less, m.
const WORST_ACCURACY_M: f64 = 1.5e-3;
/// Fraction of a seam's points that may lie beyond each of its ends, as outliers.
const BEYOND: f64 = 0.002;

/// Errors that are known with a covariance which the scan does not improve.
pub(super) fn considered<const ROWS: usize, const LOCAL: usize>(
    settings: &Settings<'_>,
    frames: &[Option<Frame<ROWS, LOCAL>>],
    lines: usize,
) -> Vec<Considered> {
    let held = settings.held_sigmas.iter().map(|(component, sigma)| Considered::Held(*component, *sigma));
    let shape = settings.levels.held_shape.map(Considered::Shape);
    let sigma_m = settings.levels.edge_radius_m;
    let mean_view = (0..lines).map(|line| mean_view(frames, line)).collect();
    let edge = (sigma_m > 0.0).then_some(Considered::EdgeRadius { sigma_m, mean_view });
    held.chain(shape).chain(edge).chain([Considered::SquaredLag(UNIT_OF_LAG_S.powi(2))]).collect()
}

/// Adds the blocks of the expected errors, for targets with so many directions of a form.
pub(super) fn add_blocks<P: State, const ROWS: usize, const LOCAL: usize>(
    columns: &mut Columns<P>,
    frames: &[Option<Frame<ROWS, LOCAL>>],
    (targets, directions): (usize, usize),
    field: Option<RobotField>,
    settings: &Settings<'_>,
) {
    let mut add = |kind: Kind, amplitude: Amplitude| {
        let block = Block::new(kind, columns.estimated(), amplitude);
        columns.blocks.push(block);
    };
    if let Some(field) = field {
        let worst = WORST_ROBOT.max(WORST_ACCURACY_M / settings.levels.robot_accuracy_m);
        add(Kind::Robot(field), Amplitude { theta: 1.0, bounds: [1.0, worst.powi(2)] });
    }
    if let Some((at_s, sigma_s)) = settings.step {
        let stamps: Vec<f64> = frames.iter().flatten().map(|frame| frame.stamp_s).collect();
        let before = stamps.iter().filter(|stamp_s| **stamp_s < at_s).count();
        add(Kind::Step { at_s, is_later: 2 * before >= stamps.len(), sigma_s }, Amplitude::HELD);
    }
    if !settings.axis_sigmas.is_empty() {
        add(Kind::Axes { sigmas: settings.axis_sigmas.to_vec() }, Amplitude::HELD);
    }
    if settings.lag_s > 0.0 {
        add(Kind::Lag { taken_s: settings.lag_s, sigma_s: LAG_SIGMA_S }, Amplitude::HELD);
    }
    if settings.joint_lags_s > 0.0 {
        let bounds = [LEAST_JOINT_LAGS.powi(2), MOST_JOINT_LAGS.powi(2)];
        add(Kind::JointLags { sigma_s: settings.joint_lags_s }, Amplitude { theta: 1.0, bounds });
    }
    if let Some(clamped) = settings.part {
        let bounds = [LEAST_MOVES.powi(2), MOST_MOVES.powi(2)];
        add(Kind::Part(clamped.clone()), Amplitude { theta: 1.0, bounds });
    }
    if settings.levels.feature_bias_px > 0.0 {
        add(Kind::Detector { sigma_px: settings.levels.feature_bias_px }, Amplitude::HELD);
    }
    for target in (0..targets).filter(|_| settings.waviness_m > 0.0) {
        let of_target = || frames.iter().flatten().filter(|frame| frame.target == target);
        let along = || of_target().flat_map(|frame| frame.along_m);
        let (Some(from), Some(to)) = (quantile(along(), BEYOND), quantile(along(), 1.0 - BEYOND)) else {
            continue;
        };
        for ((apart_m, part), largest_m) in FORMS.into_iter().zip(LARGEST_FORMS_M) {
            let sigma_m = part * settings.waviness_m;
            let hats = Hats::over([from, to], apart_m, targets);
            let bounds = [LEAST_FORM.powi(2), (largest_m / sigma_m).powi(2)];
            add(Kind::Form { target, directions, hats, sigma_m }, Amplitude { theta: 1.0, bounds });
        }
    }
}

/// Least and largest lags of joints, in multiples of the expected ones.
const LEAST_JOINT_LAGS: f64 = 0.1;
const MOST_JOINT_LAGS: f64 = 5.0;

/// Least and largest moves of a part, in multiples of the expected ones.
const LEAST_MOVES: f64 = 0.1;
const MOST_MOVES: f64 = 10.0;

/// Least form as a fraction of the expected form, because zero has no logarithm.
const LEAST_FORM: f64 = 1e-3;

fn mean_view<const ROWS: usize, const LOCAL: usize>(
    frames: &[Option<Frame<ROWS, LOCAL>>],
    target: usize,
) -> Vector3<f64> {
    let mut sum = Vector3::zeros();
    let mut count = 0.0;
    for frame in frames.iter().flatten().filter(|frame| frame.target == target) {
        sum += frame.towards_sensor;
        count += 1.0;
    }
    sum / f64::max(count, 1.0)
}
