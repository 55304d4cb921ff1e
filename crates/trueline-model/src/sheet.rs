//! Stage 2: ray → point on the laser sheet.
//!
//! p_C = d r / (n·r). The sheet also has two axes, so a measured point is two numbers: x along the stripe (as near to
//! the camera's x axis as the sheet allows), and y, the range, perpendicular to it.

use nalgebra::{Matrix3, Matrix3x2, Vector2, Vector3};
use trueline_geometry::Plane;

/// The laser sheet in the camera frame, with an origin and two axes in it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LaserSheet {
    plane: Plane,
    origin: Vector3<f64>,
    axes: Matrix3x2<f64>,
}

impl LaserSheet {
    /// A sheet with axes that follow from the plane alone: x is the camera's x axis projected onto the sheet
    /// (its y axis if x is perpendicular to the sheet), y completes n = x × y. The origin is the plane's
    /// foot.
    #[must_use]
    pub fn from_plane(plane: Plane) -> Self {
        let normal = plane.normal().into_inner();
        let reference = if normal.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() };
        let x = (reference - normal * normal.dot(&reference)).normalize();
        let y = normal.cross(&x);
        Self { plane, origin: normal * plane.offset(), axes: Matrix3x2::from_columns(&[x, y]) }
    }

    /// The sheet of a profiler, which reports points in its own sheet. In its frame x is along the stripe and z is the range, and the sheet is y =
    /// 0.
    #[must_use]
    pub fn of_profiler() -> Self {
        // The plane y = 0; its normal is y, and (x, z) are the two measured coordinates.
        let plane = Plane::new(Vector3::y(), 0.0).unwrap_or_else(|| unreachable!("y is not zero"));
        Self { plane, origin: Vector3::zeros(), axes: Matrix3x2::from_columns(&[Vector3::x(), Vector3::z()]) }
    }

    /// A sheet with an origin and two orthogonal unit axes in it. `None` for axes that span no plane.
    #[must_use]
    pub fn from_axes(origin: Vector3<f64>, axes: Matrix3x2<f64>) -> Option<Self> {
        let normal = axes.column(0).cross(&axes.column(1));
        let plane = Plane::new(normal, normal.dot(&origin))?;
        Some(Self { plane, origin, axes })
    }

    /// The plane n·p = d in the camera frame.
    #[must_use]
    pub fn plane(&self) -> &Plane {
        &self.plane
    }

    /// The origin of the sheet's coordinates, in the camera frame, m.
    #[must_use]
    pub fn origin(&self) -> &Vector3<f64> {
        &self.origin
    }

    /// The two axes in the sheet as columns, in the camera frame.
    #[must_use]
    pub fn axes(&self) -> &Matrix3x2<f64> {
        &self.axes
    }

    /// The point where a ray meets the sheet (m), and d point / d ray (3×3).
    ///
    /// `None` if the ray runs along the sheet or meets it behind the camera.
    #[must_use]
    pub fn intersect(&self, ray: &Vector3<f64>) -> Option<(Vector3<f64>, Matrix3<f64>)> {
        let (normal, offset) = (self.plane.normal(), self.plane.offset());
        let toward = normal.dot(ray);
        // A ray within 1e-9 rad of the sheet meets it more than 10⁹ distances away.
        if toward <= 1e-9 * ray.norm() {
            return None;
        }
        let point = ray * (offset / toward);
        let d_point_d_ray = Matrix3::identity() * (offset / toward) - point * normal.transpose() / toward;
        Some((point, d_point_d_ray))
    }

    /// Coordinates in the sheet (m) of a point in the camera frame; its distance from the sheet is dropped.
    #[must_use]
    pub fn coordinates(&self, point_in_camera: &Vector3<f64>) -> Vector2<f64> {
        self.axes.transpose() * (point_in_camera - self.origin)
    }

    /// The point in the camera frame (m) at coordinates in the sheet.
    #[must_use]
    pub fn point(&self, coordinates: &Vector2<f64>) -> Vector3<f64> {
        self.origin + self.axes * coordinates
    }
}
