//! How wrong hand-eye and line may be while the scan is planned.

use crate::seam::Seam;
use nalgebra::Vector3;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, UnitBall};
use trueline_geometry::{Pose, se3};

/// Largest errors of the guess: cells are wrong by anything within them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GuessError {
    /// Hand-eye translation, m.
    pub translation_m: f64,
    /// Hand-eye rotation, about any axis, rad.
    pub rotation_rad: f64,
    /// Distance of the line from its assumed place, m.
    pub line_m: f64,
}

impl Default for GuessError {
    fn default() -> Self {
        Self { translation_m: 0.010, rotation_rad: 5.0_f64.to_radians(), line_m: 0.020 }
    }
}

impl GuessError {
    /// A hand-eye transform and a seam that are wrong at random, anywhere within the errors allowed. Both ends of the seam
    /// move independently, so the error between them does not exceed theirs.
    #[must_use]
    pub fn disturbed(&self, tool_from_camera: &Pose, seam: &Seam, seed: u64) -> (Pose, Seam) {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut part = || Vector3::from(UnitBall.sample(&mut random));
        let (turn, shift) = (part() * self.rotation_rad, part() * self.translation_m);
        let mut off = |end: &Vector3<f64>| end + part() * self.line_m;
        let moved = Seam { from_m: off(&seam.from_m), to_m: off(&seam.to_m) };
        (se3::retract_decoupled(tool_from_camera, &turn, &shift), moved)
    }

    /// Whether nothing can be wrong.
    #[must_use]
    pub fn is_none(&self) -> bool {
        self.translation_m == 0.0 && self.rotation_rad == 0.0 && self.line_m == 0.0
    }
}
