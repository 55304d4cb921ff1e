//! External axes of a cell: rough place, limits, and how wrong the place may be.

use crate::guess_error::GuessError;
use nalgebra::{UnitVector3, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, UnitBall};
use trueline_dataset::{AxisLimits, AxisRecord, Carries, Problem};
use trueline_geometry::{Axis, AxisKind, so3};

/// An external axis that moves in a planned scan.
#[derive(Clone, Debug)]
pub struct CellAxis {
    /// Name, kind, load and guess, without values.
    pub record: AxisRecord,
    /// Its rough place.
    pub axis: Axis,
    /// Limits of its motion.
    pub limits: AxisLimits,
    /// Largest errors of direction (rad) and point (m): cells are wrong by anything within them.
    pub error: [f64; 2],
}

/// Largest error of a place with a stated standard deviation, in these.
const SIGMAS: f64 = 2.0;

impl CellAxis {
    /// An axis of a cell's file. Where no uncertainty is stated, its direction is as rough as the hand-eye's rotation, and its
    /// point as rough as the seam. Its point is the one nearest to its load, as in a calibration: the seam in base, or the camera in the tool.
    ///
    /// # Errors
    /// An axis without a rough place, and one that the controller's poses contain.
    pub(crate) fn of(
        (record, limits): (AxisRecord, AxisLimits),
        rough: &GuessError,
        [seam_m, camera_m]: [Vector3<f64>; 2],
    ) -> Result<Self, Problem> {
        let wrong = |key, expected, found: &str| Problem::Value { key, expected, found: found.to_owned() };
        if record.in_pose {
            let expected = "no axis within the controller's poses: a plan has the poses of the arm alone";
            return Err(wrong("axis.in_pose", expected, "true"));
        }
        let Some(guess) = record.guess else {
            let expected = "its rough direction, which the robot follows";
            return Err(wrong("axis.direction", expected, "none"));
        };
        let is_rotary = record.kind == AxisKind::Rotary;
        if is_rotary && guess.point_m.is_none() {
            let expected = "a point of the axis, roughly: the robot follows the part about it";
            return Err(wrong("axis.point_mm", expected, "none"));
        }
        let load_m = if record.carries == Carries::Sensor { camera_m } else { seam_m };
        let nearest = |point_m: Vector3<f64>| {
            point_m + guess.direction.as_ref() * guess.direction.dot(&(load_m - point_m))
        };
        let point_m = guess.point_m.map_or_else(Vector3::zeros, nearest);
        let axis = Axis::new(record.kind, guess.direction, point_m);
        let largest = |stated: Option<f64>, usual: f64| stated.map_or(usual, |sigma| SIGMAS * sigma);
        let [direction, point] = guess.sigma;
        let error = [largest(direction, rough.rotation_rad), largest(point, rough.line_m)];
        Ok(Self { record, axis, limits, error })
    }

    /// The axis, wrong at random by anything within its errors.
    fn disturbed(&self, random: &mut ChaCha8Rng) -> Axis {
        let mut part = || Vector3::from(UnitBall.sample(random));
        let turn = so3::exp(&(part() * self.error[0]));
        let direction = UnitVector3::new_normalize(turn * self.axis.direction.into_inner());
        Axis { direction, point_m: self.axis.point_m + part() * self.error[1], ..self.axis }
    }
}

/// The axes of a cell, wrong at random. The same seed gives the same, whatever else is wrong in that cell.
#[must_use]
pub fn disturbed(axes: &[CellAxis], seed: u64) -> Vec<Axis> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    random.set_stream(1);
    axes.iter().map(|axis| axis.disturbed(&mut random)).collect()
}
