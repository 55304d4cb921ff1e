//! Joint angles from the pose of the flange: Newton's method, damped near singularities.
//!
//! One method serves every arm, with or without a spherical wrist. On a path each pose starts from the angles of the previous one and needs two
//! steps. All configurations are found from many random angles.

use crate::arm::six_axes::{AXES, Angles, Arm};
use crate::{Pose, se3};
use nalgebra::{Matrix6, Vector6};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;

/// Maximum number of steps.
const MOST_STEPS: usize = 60;
/// Tolerance of the flange's pose, m and rad.
const THERE: f64 = 1e-10;
/// Largest rotation of a joint in a step, rad.
const LONGEST_STEP: f64 = 0.5;
/// Squared damping of a step that would be longer.
const DAMPING_SQUARED: f64 = 1e-3;

/// The angles, near others, at which the flange has a pose in the arm's base; limits are not checked. `None` out of reach,
/// or where the way there is lost.
#[must_use]
pub fn angles_for(arm: &Arm, base_from_flange: &Pose, near: &Angles) -> Option<Angles> {
    let mut angles = *near;
    for _ in 0..MOST_STEPS {
        let state = arm.state(&angles);
        let (turn, shift) = se3::difference_decoupled(base_from_flange, &state.base_from_flange);
        let error = Vector6::new(shift.x, shift.y, shift.z, turn.x, turn.y, turn.z);
        if error.amax() < THERE {
            return Some(angles);
        }
        let step = step(&state.jacobian(), &error)?;
        for k in 0..AXES {
            angles[k] += step[k];
        }
    }
    None
}

/// Newton's step, or a damped one if that is too long.
fn step(jacobian: &Matrix6<f64>, error: &Vector6<f64>) -> Option<Vector6<f64>> {
    if let Some(step) = jacobian.lu().solve(error)
        && step.amax() <= LONGEST_STEP
    {
        return Some(step);
    }
    let damped = jacobian.transpose() * jacobian + Matrix6::identity() * DAMPING_SQUARED;
    let step = damped.cholesky()?.solve(&(jacobian.transpose() * error));
    let longest = step.amax();
    longest.is_finite().then(|| step * (LONGEST_STEP / longest).min(1.0))
}

/// Number of random starts of the search for configurations.
const STARTS: usize = 300;
/// Solutions are equal if no angle differs by more, rad.
const SAME_RAD: f64 = 1e-6;

/// All configurations within the joints' ranges that bring the flange to a pose in the arm's base, as found
/// from many random starts. A joint that may turn more than once takes the turn nearest to the middle of its
/// range.
#[must_use]
pub fn configurations(arm: &Arm, base_from_flange: &Pose) -> Vec<Angles> {
    let mut random = ChaCha8Rng::seed_from_u64(0);
    let mut found: Vec<Angles> = Vec::new();
    for _ in 0..STARTS {
        let start = std::array::from_fn(|k| {
            let [low, high] = nearest_turn(&arm.joints[k].range_rad);
            random.random_range(low..=high)
        });
        let Some(angles) = angles_for(arm, base_from_flange, &start).map(|angles| wound(arm, &angles)) else {
            continue;
        };
        let is_known = |known: &Angles| (0..AXES).all(|k| (wrapped(known[k] - angles[k])).abs() < SAME_RAD);
        if arm.used_of_range(&angles).iter().all(|used| *used <= 1.0) && !found.iter().any(is_known) {
            found.push(angles);
        }
    }
    found
}

/// The same angles, each in the turn nearest to the middle of its range.
fn wound(arm: &Arm, angles: &Angles) -> Angles {
    std::array::from_fn(|k| {
        let [low, high] = arm.joints[k].range_rad;
        let middle = 0.5 * (low + high);
        middle + wrapped(angles[k] - middle)
    })
}

/// An angle between −π and π.
fn wrapped(angle_rad: f64) -> f64 {
    angle_rad - TAU * (angle_rad / TAU).round()
}

/// At most one turn of a range.
fn nearest_turn([low, high]: &[f64; 2]) -> [f64; 2] {
    let (middle, half) = (0.5 * (low + high), (0.5 * (high - low)).min(0.5 * TAU));
    [middle - half, middle + half]
}
