//! Random disturbances, from one portable seeded stream.

use crate::capture::SheetAxes;
use crate::scenario::{Disturbance, SensorModel};
use nalgebra::{UnitQuaternion, Vector3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Poisson, StandardNormal};
use trueline_dataset::Measured;
use trueline_geometry::Pose;

/// A seeded source of disturbances.
pub struct Noise {
    random: ChaCha8Rng,
}

impl Noise {
    /// The stream of a seed, and of a purpose, so that one disturbance does not shift another.
    #[must_use]
    pub fn new(seed: u64, purpose: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        random.set_stream(purpose);
        Self { random }
    }

    /// The stream of one of several faults.
    pub(crate) fn for_fault(seed: u64, index: usize) -> Self {
        Self::new(seed, 100 + index as u64)
    }

    /// A normal number of a standard deviation.
    pub fn normal(&mut self, sigma: f64) -> f64 {
        let unit: f64 = StandardNormal.sample(&mut self.random);
        unit * sigma
    }

    /// Whether something of this probability happens.
    pub fn happens(&mut self, probability: f64) -> bool {
        self.random.random::<f64>() < probability
    }

    /// A uniform number between two.
    pub fn uniform(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.random.random::<f64>()
    }

    /// Number of events with this mean frequency (Poisson).
    pub fn count(&mut self, mean: f64) -> usize {
        // Poisson's distribution needs a mean above zero; zero gives zero.
        Poisson::new(mean).map_or(0, |poisson| poisson.sample(&mut self.random) as usize)
    }

    fn vector(&mut self, sigma: f64) -> Vector3<f64> {
        Vector3::from_fn(|_, _| self.normal(sigma))
    }

    /// A recorded pose: the true one with encoder noise.
    pub fn pose(&mut self, truth: &Pose, disturbance: &Disturbance) -> Pose {
        let shift = self.vector(disturbance.robot_position_noise_m);
        let turn = UnitQuaternion::new(self.vector(disturbance.robot_rotation_noise_rad));
        Pose::from_parts((truth.translation.vector + shift).into(), turn * truth.rotation)
    }

    /// A measured feature: the true one with noise in pixels, or in the sheet.
    pub fn feature(&mut self, truth: &Measured, sheet: &SheetAxes, disturbance: &Disturbance) -> Measured {
        let (px, m) = (disturbance.feature_noise_px, disturbance.feature_noise_m);
        match *truth {
            Measured::Pixel([u, v]) => Measured::Pixel([u + self.normal(px), v + self.normal(px)]),
            Measured::Profile([x, z]) => Measured::Profile([x + self.normal(m), z + self.normal(m)]),
            Measured::Point(point) => {
                let shift = Vector3::new(self.normal(m), 0.0, self.normal(m));
                Measured::Point((Vector3::from(point) + sheet.camera_from_sheet * shift).into())
            }
        }
    }

    /// A feature that has nothing to do with the seam, anywhere in the field of view.
    pub fn outlier(&mut self, sensor: &SensorModel, sheet: &SheetAxes) -> Measured {
        match sensor {
            SensorModel::CameraLaser { camera, .. } => Measured::Pixel([
                self.uniform(0.0, f64::from(camera.size[0]) - 1.0),
                self.uniform(0.0, f64::from(camera.size[1]) - 1.0),
            ]),
            SensorModel::Profiler { half_width_m, range_m } => Measured::Profile([
                self.uniform(-half_width_m, *half_width_m),
                self.uniform(range_m[0], range_m[1]),
            ]),
            SensorModel::Points { .. } => {
                Measured::Point(sheet.point(self.uniform(-0.03, 0.03), self.uniform(-0.03, 0.03)).into())
            }
        }
    }
}
