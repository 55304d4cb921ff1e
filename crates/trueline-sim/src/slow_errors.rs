//! Errors of a robot that change slowly over its workspace: waves of all directions.

use crate::noise::Noise;
use nalgebra::{Vector3, Vector6};
use std::f64::consts::TAU;
use trueline_dataset::RobotSample;
use trueline_geometry::{Pose, se3};

/// Lengths over which the errors change, m and rad.
const REACH: f64 = 0.6;
/// Waves of each error.
const WAVES: usize = 60;

/// A wave over the workspace: its phase per rad and m, and its phase at the middle.
type Wave = (Vector6<f64>, f64);

/// Errors as a function of the pose. Each is normal over many robots, and poses that are alike have errors that are alike.
#[derive(Clone, Debug)]
pub struct SlowErrors {
    middle: Pose,
    waves: [Vec<Wave>; 6],
    /// Standard deviations: of the turn, rad, and of the shift, m.
    sizes: [f64; 2],
}

impl SlowErrors {
    /// Errors of these sizes per axis, of the position (m) and the attitude (rad), about a pose.
    #[must_use]
    pub fn drawn(noise: &mut Noise, middle: Pose, position_m: f64, attitude_rad: f64) -> Self {
        let mut wave = || (Vector6::from_fn(|_, _| noise.normal(1.0 / REACH)), noise.uniform(0.0, TAU));
        let waves = std::array::from_fn(|_| (0..WAVES).map(|_| wave()).collect());
        Self { middle, waves, sizes: [attitude_rad, position_m] }
    }

    /// The pose that the robot reports where it is at this one.
    #[must_use]
    pub fn reported(&self, pose: &Pose) -> Pose {
        let (turn, shift) = se3::difference_decoupled(pose, &self.middle);
        let place = Vector6::new(turn.x, turn.y, turn.z, shift.x, shift.y, shift.z);
        let error = |j: usize| {
            let sum: f64 = self.waves[j].iter().map(|(wave, phase)| (wave.dot(&place) + phase).cos()).sum();
            sum * (2.0 / WAVES as f64).sqrt() * self.sizes[j / 3]
        };
        let three = |first: usize| Vector3::from_fn(|j, _| error(first + j));
        se3::retract_decoupled(pose, &three(0), &three(3))
    }

    /// Gives all samples of a recording these errors.
    pub fn add_to(&self, robot: &mut [RobotSample]) {
        for sample in robot {
            sample.base_from_tool = self.reported(&sample.base_from_tool);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Over many robots an error has its stated size, and at two poses 0.3 m apart the correlation of a Gaussian of that reach.
    #[test]
    fn errors_have_their_size_and_reach() {
        let (count, apart_m) = (2000, 0.3);
        let (mut squares, mut products) = (0.0, 0.0);
        for seed in 0..count {
            let errors = SlowErrors::drawn(&mut Noise::new(seed, 1), Pose::identity(), 1e-4, 1e-4);
            let at = |x_m: f64| {
                let pose = se3::from_parts(Pose::identity().rotation, Vector3::x() * x_m);
                errors.reported(&pose).translation.vector.y
            };
            squares += at(0.0).powi(2);
            products += at(0.0) * at(apart_m);
        }
        let size = (squares / count as f64).sqrt();
        // 1/√4000 is 1.6 %.
        assert!((size / 1e-4 - 1.0).abs() < 0.065, "{size}");
        let expected = (-0.5 * (apart_m / REACH).powi(2)).exp();
        assert!((products / squares - expected).abs() < 0.05, "{} {expected}", products / squares);
    }
}
