//! A calibrated camera with its laser plane, and the derivatives of its measured points by each parameter.

use crate::thinning::stride;
use nalgebra::{DMatrix, Matrix3, SMatrix, Unit, Vector2, Vector3};
use trueline_dataset::sensor_setup::{SensorParameter, SensorUncertainty};
use trueline_dataset::{Measured, Recording};
use trueline_geometry::Plane;
use trueline_model::{Camera, LaserSheet};

/// Points of the scan at which displacements are compared.
const COMPARED_POINTS: usize = 60;

/// A calibrated camera with its laser plane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CameraSensor {
    /// The camera.
    pub camera: Camera,
    /// The laser plane in its frame.
    pub plane: Plane,
}

impl CameraSensor {
    /// Some pixels of a recording whose rays meet the laser plane.
    #[must_use]
    pub(crate) fn sample(&self, recording: &Recording) -> Vec<Vector2<f64>> {
        let every = stride(recording.features.len(), COMPARED_POINTS);
        let pixel = |feature: &trueline_dataset::Feature| match feature.measured {
            Measured::Pixel(pixel) => Some(Vector2::from(pixel)),
            _ => None,
        };
        let pixels = recording.features.iter().step_by(every).filter_map(pixel);
        pixels.filter(|pixel| self.point(pixel).is_some()).collect()
    }

    /// Parameters and their joint covariance.
    #[must_use]
    pub(crate) fn stated(
        &self,
        uncertainty: &SensorUncertainty,
    ) -> Option<(Vec<SensorParameter>, DMatrix<f64>)> {
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

    /// Intersection of a pixel's ray with the laser plane, camera frame, m.
    #[must_use]
    pub(crate) fn point(&self, pixel: &Vector2<f64>) -> Option<Vector3<f64>> {
        let (ray, _) = self.camera.ray(pixel).ok()?;
        Some(LaserSheet::from_plane(self.plane).intersect(&ray)?.0)
    }

    /// The sensor with one parameter changed by this amount.
    #[must_use]
    pub(crate) fn moved(&self, parameter: SensorParameter, by: f64) -> Option<Self> {
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
            SensorParameter::H1
            | SensorParameter::H2
            | SensorParameter::H3
            | SensorParameter::H4
            | SensorParameter::H5 => return None,
        }
        Some(Self { camera, plane })
    }

    /// Displacement of each point by each parameter, by central differences: 3N × parameters.
    #[must_use]
    pub(crate) fn fields(&self, order: &[SensorParameter], pixels: &[Vector2<f64>]) -> Option<DMatrix<f64>> {
        let mut fields = DMatrix::zeros(3 * pixels.len(), order.len());
        for (column, &parameter) in order.iter().enumerate() {
            // Steps: thousandths of a pixel; millionths of angles, metres and coefficients. Rounding stays below 1e-9.
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

/// Displacement of points of the sheet by a rigid motion (rotation, translation) and by the shape: 3N × 11.
#[must_use]
pub(crate) fn rigid_and_shape(
    sheet: &LaserSheet,
    origin_m: &[f64; 2],
    points: &[Vector3<f64>],
) -> DMatrix<f64> {
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
