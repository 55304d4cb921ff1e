//! Prior of the sensor's shape, from the uncertainties of focal lengths and laser plane in its file.
//!
//! Every error of a sensor parameter moves the measured points by a displacement field. The rigid part of the field belongs to the hand-eye
//! transform. The rest is a change of shape (see `trueline_model::sheet_shape`). Both follow by least squares over the points of the scan.

use crate::config::{Config, ResidualKind, SensorMode};
use crate::input::camera_sensor::{CameraSensor, rigid_and_shape};
use crate::input::observations::Observations;
use crate::input::shape_prior::ShapePrior;
use nalgebra::{SMatrix, Vector3};
use trueline_dataset::sensor_setup::{KEYSTONE_REACH_M, SensorCovariance, SensorUncertainty};
use trueline_dataset::{Recording, Sensor};

/// A covariance of h₁ … h₅.
pub type ShapeCovariance = SMatrix<f64, 5, 5>;

/// Prior of a sensor's shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShapeKnowledge {
    /// Prior covariance of h, whose mean is 0.
    pub covariance: ShapeCovariance,
    /// Whether the sensor's file states it; else it is assumed.
    pub stated: bool,
}

/// Assumed prior if nothing is stated: half a percent of width, depth and shear, and of scale over 30 mm.
const ASSUMED_SIGMA: [f64; 5] = [5e-3, 5e-3, 5e-3, 0.15, 0.15];
/// A prior wide enough to have no effect, which ignores the sensor's file.
const FREE_SIGMA: [f64; 5] = [0.3, 0.3, 0.3, 10.0, 10.0];
/// Lower bound of the standard deviations, which keeps the covariance invertible.
const LEAST_SIGMA: [f64; 5] = [1e-6, 1e-6, 1e-6, 1e-4, 1e-4];

/// Size of a shape below the resolution of a sensor's file: 0.03 µm at 30 mm.
pub(crate) fn least_covariance() -> SMatrix<f64, 5, 5> {
    diagonal(LEAST_SIGMA)
}

impl ShapeKnowledge {
    /// For a recording's sensor. If the file states some uncertainties, the others are zero.
    #[must_use]
    pub fn of(recording: &Recording, observations: &Observations) -> Self {
        let stated = recording.setup.uncertainty.as_ref();
        let covariance = stated.and_then(|uncertainty| match &recording.sensor {
            Sensor::CameraLaser { camera, laser_plane_in_camera } => {
                let sensor = CameraSensor { camera: *camera, plane: *laser_plane_in_camera };
                of_camera(&sensor, recording, observations, uncertainty)
            }
            Sensor::Profiler | Sensor::Points { .. } => Some(of_profiler(uncertainty)),
        });
        Self {
            covariance: covariance.unwrap_or_else(|| diagonal(ASSUMED_SIGMA)) + least_covariance(),
            stated: covariance.is_some(),
        }
    }

    /// Knowledge of a profiler, or of a sensor that reports points. If something is stated, everything that is not stated is exact.
    #[must_use]
    pub fn of_profiler(uncertainty: Option<&SensorUncertainty>) -> Self {
        Self {
            covariance: uncertainty.map_or_else(|| diagonal(ASSUMED_SIGMA), of_profiler) + least_covariance(),
            stated: uncertainty.is_some(),
        }
    }

    /// The prior of a fit. `None` if the sensor is held.
    #[must_use]
    pub fn prior(&self, config: &Config) -> Option<ShapePrior> {
        self.prior_in(config.sensor, config.residual)
    }

    /// The prior of a fit in a mode. `None` if the sensor is held, and for the paper's residual.
    #[must_use]
    pub(crate) fn prior_in(&self, mode: SensorMode, residual: ResidualKind) -> Option<ShapePrior> {
        let covariance = match mode {
            SensorMode::Prior => self.covariance,
            SensorMode::Free => diagonal(FREE_SIGMA),
            SensorMode::Fixed => return None,
        };
        let information = covariance.cholesky()?.inverse();
        (residual == ResidualKind::Sheet).then_some(ShapePrior { information })
    }
}

fn diagonal(sigma: [f64; 5]) -> ShapeCovariance {
    ShapeCovariance::from_diagonal(&sigma.map(|s| s * s).into())
}

fn of_profiler(uncertainty: &SensorUncertainty) -> ShapeCovariance {
    if let Some(joint) = uncertainty.covariance.as_ref().and_then(SensorCovariance::shape) {
        return joint;
    }
    let [scale, shear, keystone] =
        [uncertainty.scale, uncertainty.shear_rad, uncertainty.keystone].map(|stated| stated.unwrap_or(0.0));
    let keystone = keystone / KEYSTONE_REACH_M;
    diagonal([scale, scale, shear, keystone, keystone])
}

/// `None` if no point of the scan can be moved, or nothing is stated.
fn of_camera(
    sensor: &CameraSensor,
    recording: &Recording,
    observations: &Observations,
    uncertainty: &SensorUncertainty,
) -> Option<ShapeCovariance> {
    let (order, covariance) = sensor.stated(uncertainty)?;
    let pixels = sensor.sample(recording);
    let fields = sensor.fields(&order, &pixels)?;
    let points: Vec<Vector3<f64>> = pixels.iter().filter_map(|pixel| sensor.point(pixel)).collect();
    let basis = rigid_and_shape(&observations.sheet, &observations.shape_origin_m, &points);
    let by_parameter = basis.svd(true, true).solve(&fields, 1e-12).ok()?;
    let shape = by_parameter.rows(6, 5);
    let mapped = shape * covariance * shape.transpose();
    Some(mapped.fixed_view::<5, 5>(0, 0).into_owned())
}
