//! What is known of the sensor's shape before the scan, from what its file says of focal lengths and laser plane.
//!
//! Every property of the sensor that may be off moves the measured points by a field of displacements. What of it is a
//! rigid motion belongs to the hand-eye transform; the rest is a change of shape (see `trueline_model::sheet_shape`).
//! Both follow by least squares over the points of the scan.

use crate::config::{Config, ResidualKind, SensorMode};
use crate::input::observations::Observations;
use crate::problem::block_priors::ShapePrior;
use nalgebra::{DMatrix, Matrix3, SMatrix, Unit, Vector2, Vector3};
use trueline_dataset::sensor_setup::{KEYSTONE_REACH_M, SensorParameter, SensorUncertainty};
use trueline_dataset::{Measured, Recording, Sensor};
use trueline_geometry::Plane;
use trueline_model::{Camera, LaserSheet};

/// A covariance of h₁ … h₅.
pub type ShapeCovariance = SMatrix<f64, 5, 5>;

/// What is known of a sensor's shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShapeKnowledge {
    /// Covariance of h about 0.
    pub covariance: ShapeCovariance,
    /// Whether the sensor's file says so; else it is assumed.
    pub stated: bool,
}

/// Assumed where nothing is stated: half a percent of width, depth and shear, and of scale over 30 mm.
const ASSUMED_SIGMA: [f64; 5] = [5e-3, 5e-3, 5e-3, 0.15, 0.15];
/// So wide that it says nothing: the sensor's file does not matter.
const FREE_SIGMA: [f64; 5] = [0.3, 0.3, 0.3, 10.0, 10.0];
/// A shape is never known better than this: it keeps the covariance invertible.
const LEAST_SIGMA: [f64; 5] = [1e-6, 1e-6, 1e-6, 1e-4, 1e-4];
/// Points of the scan over which the displacements are compared.
const SAMPLE: usize = 60;

impl ShapeKnowledge {
    /// Of a recording's sensor; what is not stated beside something that is, is exact.
    #[must_use]
    pub fn of(recording: &Recording, observations: &Observations) -> Self {
        let stated = recording.setup.uncertainty.as_ref();
        let covariance = stated.and_then(|uncertainty| match &recording.sensor {
            Sensor::CameraLaser { camera, laser_plane_in_camera } => {
                let sensor = CameraSensor { camera: *camera, plane: *laser_plane_in_camera };
                sensor.shape_covariance(recording, observations, uncertainty)
            }
            Sensor::Profiler | Sensor::Points { .. } => Some(of_profiler(uncertainty)),
        });
        Self {
            covariance: covariance.unwrap_or_else(|| diagonal(ASSUMED_SIGMA)) + diagonal(LEAST_SIGMA),
            stated: covariance.is_some(),
        }
    }

    /// The prior of a fit; `None` where the sensor is held.
    #[must_use]
    pub fn prior(&self, config: &Config) -> Option<ShapePrior> {
        let covariance = match config.sensor {
            SensorMode::Prior => self.covariance,
            SensorMode::Free => diagonal(FREE_SIGMA),
            SensorMode::Fixed => return None,
        };
        let information = covariance.cholesky()?.inverse();
        (config.residual == ResidualKind::Sheet).then_some(ShapePrior { information })
    }
}

fn diagonal(sigma: [f64; 5]) -> ShapeCovariance {
    ShapeCovariance::from_diagonal(&sigma.map(|s| s * s).into())
}

fn of_profiler(uncertainty: &SensorUncertainty) -> ShapeCovariance {
    let [scale, shear, keystone] =
        [uncertainty.scale, uncertainty.shear_rad, uncertainty.keystone].map(|stated| stated.unwrap_or(0.0));
    let keystone = keystone / KEYSTONE_REACH_M;
    diagonal([scale, scale, shear, keystone, keystone])
}

/// A camera and its laser plane as they are calibrated.
struct CameraSensor {
    camera: Camera,
    plane: Plane,
}

impl CameraSensor {
    /// `None` if no point of the scan can be moved, or nothing is stated.
    fn shape_covariance(
        &self,
        recording: &Recording,
        observations: &Observations,
        uncertainty: &SensorUncertainty,
    ) -> Option<ShapeCovariance> {
        let (order, covariance) = self.stated(uncertainty)?;
        let every = recording.features.len().div_ceil(SAMPLE).max(1);
        let pixels: Vec<Vector2<f64>> = recording
            .features
            .iter()
            .step_by(every)
            .filter_map(|feature| match feature.measured {
                Measured::Pixel(pixel) => Some(Vector2::from(pixel)),
                _ => None,
            })
            .filter(|pixel| self.point(pixel).is_some())
            .collect();
        let fields = self.fields(&order, &pixels)?;
        let points: Vec<Vector3<f64>> = pixels.iter().filter_map(|pixel| self.point(pixel)).collect();
        let basis = rigid_and_shape(&observations.sheet, &observations.shape_origin_m, &points);
        let by_parameter = basis.svd(true, true).solve(&fields, 1e-12).ok()?;
        let shape = by_parameter.rows(6, 5);
        let mapped = shape * covariance * shape.transpose();
        Some(mapped.fixed_view::<5, 5>(0, 0).into_owned())
    }

    /// Parameters and their joint covariance.
    fn stated(&self, uncertainty: &SensorUncertainty) -> Option<(Vec<SensorParameter>, DMatrix<f64>)> {
        if let Some(joint) = &uncertainty.covariance {
            return Some((joint.order.clone(), joint.matrix.clone()));
        }
        let focal = uncertainty.focal.unwrap_or(0.0);
        let centre = uncertainty.principal_point_px.unwrap_or(0.0);
        let tilt = uncertainty.plane_normal_rad.unwrap_or(0.0);
        let order = vec![
            SensorParameter::Fx,
            SensorParameter::Fy,
            SensorParameter::Cx,
            SensorParameter::Cy,
            SensorParameter::NormalE1,
            SensorParameter::NormalE2,
            SensorParameter::Offset,
        ];
        let sigma = [
            focal * self.camera.focal.x,
            focal * self.camera.focal.y,
            centre,
            centre,
            tilt,
            tilt,
            uncertainty.plane_offset_m.unwrap_or(0.0),
        ];
        let variances = nalgebra::DVector::from_iterator(sigma.len(), sigma.iter().map(|s| s * s));
        Some((order, DMatrix::from_diagonal(&variances)))
    }

    fn point(&self, pixel: &Vector2<f64>) -> Option<Vector3<f64>> {
        let (ray, _) = self.camera.ray(pixel).ok()?;
        Some(LaserSheet::from_plane(self.plane).intersect(&ray)?.0)
    }

    /// The sensor with one parameter off by so much.
    fn moved(&self, parameter: SensorParameter, by: f64) -> Option<Self> {
        let (mut camera, mut plane) = (self.camera, self.plane);
        let axes = *LaserSheet::from_plane(plane).axes();
        let tilted = |axis: usize| {
            let normal = plane.normal().into_inner() + axes.column(axis) * by;
            Plane::new(Unit::new_normalize(normal).into_inner(), plane.offset())
        };
        match parameter {
            SensorParameter::Fx => camera.focal.x += by,
            SensorParameter::Fy => camera.focal.y += by,
            SensorParameter::Cx => camera.centre.x += by,
            SensorParameter::Cy => camera.centre.y += by,
            SensorParameter::K1 => camera.distortion.k1 += by,
            SensorParameter::K2 => camera.distortion.k2 += by,
            SensorParameter::P1 => camera.distortion.p1 += by,
            SensorParameter::P2 => camera.distortion.p2 += by,
            SensorParameter::K3 => camera.distortion.k3 += by,
            SensorParameter::NormalE1 => plane = tilted(0)?,
            SensorParameter::NormalE2 => plane = tilted(1)?,
            SensorParameter::Offset => plane = Plane::new(plane.normal().into_inner(), plane.offset() + by)?,
        }
        Some(Self { camera, plane })
    }

    /// How each parameter moves each point, by central differences: 3N × parameters.
    fn fields(&self, order: &[SensorParameter], pixels: &[Vector2<f64>]) -> Option<DMatrix<f64>> {
        let mut fields = DMatrix::zeros(3 * pixels.len(), order.len());
        for (column, &parameter) in order.iter().enumerate() {
            // Pixels by thousandths; angles, metres and coefficients by millionths: rounding stays below 1e-9.
            let step = match parameter {
                SensorParameter::Fx | SensorParameter::Fy | SensorParameter::Cx | SensorParameter::Cy => 1e-3,
                _ => 1e-6,
            };
            let (more, less) = (self.moved(parameter, step)?, self.moved(parameter, -step)?);
            for (row, pixel) in pixels.iter().enumerate() {
                let slope = (more.point(pixel)? - less.point(pixel)?) / (2.0 * step);
                fields.view_mut((3 * row, column), (3, 1)).copy_from(&slope);
            }
        }
        Some(fields)
    }
}

/// How a rigid motion (rotation, translation) and the shape move points of the sheet: 3N × 11.
fn rigid_and_shape(sheet: &LaserSheet, origin_m: &[f64; 2], points: &[Vector3<f64>]) -> DMatrix<f64> {
    let mut basis = DMatrix::zeros(3 * points.len(), 11);
    for (k, point) in points.iter().enumerate() {
        let [a, b]: [f64; 2] = (sheet.coordinates(point) - Vector2::from(*origin_m)).into();
        let in_sheet = SMatrix::<f64, 2, 5>::new(a, 0.0, b, -a * a, -a * b, 0.0, b, 0.0, -a * b, -b * b);
        let mut rows = basis.rows_mut(3 * k, 3);
        rows.columns_mut(0, 3).copy_from(&-trueline_geometry::so3::hat(point));
        rows.columns_mut(3, 3).copy_from(&Matrix3::identity());
        rows.columns_mut(6, 5).copy_from(&(sheet.axes() * in_sheet));
    }
    basis
}
