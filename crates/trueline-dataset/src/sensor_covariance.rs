//! Joint covariances of a sensor's parameters: taken from a fit, put together, read back.

use crate::sensor_setup::{KEYSTONE_REACH_M, SensorCovariance, SensorParameter, SensorUncertainty};
use nalgebra::{DMatrix, Matrix3, SMatrix};

/// Parameters of a camera: those before the plane's.
const CAMERA: usize = 9;

/// Parameters of a shape.
const SHAPE: usize = 5;

impl SensorCovariance {
    /// Of the parameters in their usual order; those without variance were held, and are left out.
    #[must_use]
    pub fn of_free<const N: usize>(covariance: &SMatrix<f64, N, N>) -> Self {
        let free: Vec<usize> =
            (0..N.min(SensorParameter::ALL.len())).filter(|k| covariance[(*k, *k)] > 0.0).collect();
        Self {
            order: free.iter().map(|k| SensorParameter::ALL[*k]).collect(),
            matrix: DMatrix::from_fn(free.len(), free.len(), |i, j| covariance[(free[i], free[j])]),
        }
    }

    /// Of the shape h₁ … h₅ of a profiler's sheet.
    #[must_use]
    pub fn of_shape(covariance: &SMatrix<f64, SHAPE, SHAPE>) -> Self {
        Self {
            order: SensorParameter::SHAPE.to_vec(),
            matrix: DMatrix::from_fn(SHAPE, SHAPE, |i, j| covariance[(i, j)]),
        }
    }

    /// Covariance of the shape alone, zero for unlisted parameters; `None` if none is listed.
    #[must_use]
    pub fn shape(&self) -> Option<SMatrix<f64, SHAPE, SHAPE>> {
        let places = SensorParameter::SHAPE.map(|h| self.order.iter().position(|p| *p == h));
        let of = |i: usize, j: usize| Some(self.matrix[(places[i]?, places[j]?)]);
        let listed = places.iter().any(Option::is_some);
        listed.then(|| SMatrix::from_fn(|i, j| of(i, j).unwrap_or(0.0)))
    }

    /// Covariance of the camera's parameters alone, in their usual order; zero for unlisted ones.
    #[must_use]
    pub fn of_camera(&self) -> SMatrix<f64, CAMERA, CAMERA> {
        let mut covariance = SMatrix::zeros();
        let place =
            |p: SensorParameter| SensorParameter::ALL.iter().position(|q| *q == p).filter(|k| *k < CAMERA);
        for (i, a) in self.order.iter().enumerate() {
            for (j, b) in self.order.iter().enumerate() {
                if let (Some(row), Some(column)) = (place(*a), place(*b)) {
                    covariance[(row, column)] = self.matrix[(i, j)];
                }
            }
        }
        covariance
    }

    /// Replaces the plane by a laser plane (tilts toward e₁ and e₂ in rad, offset in m) that is independent of the camera.
    #[must_use]
    pub fn with_plane(&self, plane: &Matrix3<f64>) -> Self {
        let kept: Vec<usize> =
            (0..self.order.len()).filter(|k| self.order[*k] < SensorParameter::NormalE1).collect();
        let count = kept.len();
        let mut matrix = DMatrix::zeros(count + 3, count + 3);
        for (i, &a) in kept.iter().enumerate() {
            for (j, &b) in kept.iter().enumerate() {
                matrix[(i, j)] = self.matrix[(a, b)];
            }
        }
        matrix.view_mut((count, count), (3, 3)).copy_from(plane);
        let order =
            kept.iter().map(|k| self.order[*k]).chain(SensorParameter::ALL.into_iter().skip(CAMERA).take(3));
        Self { order: order.collect(), matrix }
    }
}

impl SensorUncertainty {
    /// Of a profiler with a calibrated shape: single numbers for people, and the covariance that counts.
    #[must_use]
    pub fn of_shape(covariance: &SMatrix<f64, SHAPE, SHAPE>) -> Self {
        let sigma = covariance.diagonal().map(|variance| variance.max(0.0).sqrt());
        Self {
            scale: Some(sigma[0].max(sigma[1])),
            shear_rad: Some(sigma[2]),
            keystone: Some(sigma[3].max(sigma[4]) * KEYSTONE_REACH_M),
            covariance: Some(SensorCovariance::of_shape(covariance)),
            ..Self::default()
        }
    }

    /// Of a camera and a plane from their joint covariance; its last three rows are the plane's. Focal length and principal
    /// point are as they were stated before.
    #[must_use]
    pub fn with_joint(self, covariance: SensorCovariance) -> Self {
        let last = covariance.matrix.nrows().saturating_sub(3);
        let sigma = |k: usize| {
            covariance.matrix.get((last + k, last + k)).map_or(0.0, |variance| variance.max(0.0).sqrt())
        };
        Self {
            plane_offset_m: Some(sigma(2)),
            plane_normal_rad: Some(sigma(0).max(sigma(1))),
            focal: self.focal,
            principal_point_px: self.principal_point_px,
            covariance: Some(covariance),
            ..Self::default()
        }
    }

    /// With a laser plane that is independent of the camera.
    #[must_use]
    pub fn with_plane(mut self, plane: &Matrix3<f64>) -> Self {
        let none = || SensorCovariance { order: Vec::new(), matrix: DMatrix::zeros(0, 0) };
        let covariance = self.covariance.take().unwrap_or_else(none).with_plane(plane);
        self.with_joint(covariance)
    }
}
