//! A board's corner in the picture, with Jacobians: board → camera → ideal → distorted → pixel.

use nalgebra::{Matrix2, Matrix2x3, SMatrix, SVector, Vector2, Vector3};
use trueline_geometry::{Pose, so3};
use trueline_model::{BrownConrady, Camera};

/// Number of a camera's parameters: fx, fy, cx, cy, k1, k2, p1, p2, k3.
pub const CAMERA_SIZE: usize = 9;

/// A camera's parameters as a vector, px and dimensionless.
pub type CameraVector = SVector<f64, CAMERA_SIZE>;

/// The parameters of a camera, in the order fx, fy, cx, cy, k1, k2, p1, p2, k3.
#[must_use]
pub fn to_vector(camera: &Camera) -> CameraVector {
    let k = camera.distortion.to_opencv();
    CameraVector::from_column_slice(&[
        camera.focal.x,
        camera.focal.y,
        camera.centre.x,
        camera.centre.y,
        k[0],
        k[1],
        k[2],
        k[3],
        k[4],
    ])
}

/// The camera of a vector of parameters and a size of pictures.
#[must_use]
pub fn from_vector(size: [u32; 2], vector: &CameraVector) -> Camera {
    Camera {
        size,
        focal: Vector2::new(vector[0], vector[1]),
        centre: Vector2::new(vector[2], vector[3]),
        distortion: BrownConrady::from_opencv([vector[4], vector[5], vector[6], vector[7], vector[8]]),
    }
}

/// A pixel and how it moves.
#[derive(Clone, Copy, Debug)]
pub struct Projected {
    /// Distorted pixel; it may lie outside the picture.
    pub pixel: Vector2<f64>,
    /// d pixel / d camera parameters.
    pub d_camera: SMatrix<f64, 2, CAMERA_SIZE>,
    /// d pixel / d (δ, δt) of `camera_from_board`, perturbed on the left, rad and m.
    pub d_pose: SMatrix<f64, 2, 6>,
}

/// The pixel of a point in the camera frame with d pixel / d camera and d pixel / d point. `None` behind the camera or
/// where the distortion folds back.
#[must_use]
pub fn project(
    camera: &Camera,
    point_in_camera: &Vector3<f64>,
) -> Option<(Vector2<f64>, SMatrix<f64, 2, CAMERA_SIZE>, Matrix2x3<f64>)> {
    let depth = point_in_camera.z;
    if depth <= 0.0 {
        return None;
    }
    let ideal = point_in_camera.xy() / depth;
    if ideal.norm_squared() >= camera.distortion.invertible_radius_squared() {
        return None;
    }
    let (distorted, d_distorted) = camera.distortion.distort(&ideal);
    let focal = Matrix2::from_diagonal(&camera.focal);
    let d_ideal_d_point = Matrix2x3::new(1.0, 0.0, -ideal.x, 0.0, 1.0, -ideal.y) / depth;
    let mut d_camera = SMatrix::<f64, 2, CAMERA_SIZE>::zeros();
    d_camera[(0, 0)] = distorted.x;
    d_camera[(1, 1)] = distorted.y;
    d_camera[(0, 2)] = 1.0;
    d_camera[(1, 3)] = 1.0;
    d_camera.fixed_columns_mut::<5>(4).copy_from(&(focal * d_distorted_d_coefficients(&ideal)));
    Some((focal * distorted + camera.centre, d_camera, focal * d_distorted * d_ideal_d_point))
}

/// The pixel of a board's point.
#[must_use]
pub fn project_from_board(
    camera: &Camera,
    camera_from_board: &Pose,
    point_in_board: &Vector3<f64>,
) -> Option<Projected> {
    let rotated = camera_from_board.rotation * point_in_board;
    let (pixel, d_camera, d_point) = project(camera, &(rotated + camera_from_board.translation.vector))?;
    let mut d_pose = SMatrix::<f64, 2, 6>::zeros();
    d_pose.fixed_columns_mut::<3>(0).copy_from(&(-d_point * so3::hat(&rotated)));
    d_pose.fixed_columns_mut::<3>(3).copy_from(&d_point);
    Some(Projected { pixel, d_camera, d_pose })
}

/// d distorted / d (k1, k2, p1, p2, k3): the distortion is linear in its coefficients.
fn d_distorted_d_coefficients(ideal: &Vector2<f64>) -> SMatrix<f64, 2, 5> {
    let (x, y) = (ideal.x, ideal.y);
    let r2 = x * x + y * y;
    let radial = [r2, r2 * r2, r2 * r2 * r2];
    SMatrix::from_columns(&[
        ideal * radial[0],
        ideal * radial[1],
        Vector2::new(2.0 * x * y, r2 + 2.0 * y * y),
        Vector2::new(r2 + 2.0 * x * x, 2.0 * x * y),
        ideal * radial[2],
    ])
}
