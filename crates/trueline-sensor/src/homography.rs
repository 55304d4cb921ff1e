//! Board → picture without distortion, in closed form: the homography, and the pose that follows from it.

use nalgebra::{DMatrix, Matrix3, Vector2, Vector3};
use trueline_geometry::{Pose, se3};

/// The homography that takes points of the board's plane (m) to ideal pixels, by the direct linear transform with
/// both sides brought to size one \[Hartley1997\]. `None` for fewer than four points or points in a line.
#[must_use]
pub fn fit(board: &[Vector2<f64>], pixels: &[Vector2<f64>]) -> Option<Matrix3<f64>> {
    if board.len() < 4 || board.len() != pixels.len() {
        return None;
    }
    let (from, to) = (to_size_one(board)?, to_size_one(pixels)?);
    let mut normal = DMatrix::zeros(9, 9);
    for (p, q) in board.iter().zip(pixels) {
        let (p, q) = (from * p.push(1.0), to * q.push(1.0));
        for (k, sign, other) in [(0, 1.0, q.x), (3, 1.0, q.y)] {
            let mut row = nalgebra::DVector::zeros(9);
            for n in 0..3 {
                row[k + n] = sign * p[n];
                row[6 + n] = -other * p[n];
            }
            normal += &row * row.transpose();
        }
    }
    let eigen = normal.symmetric_eigen();
    let least = eigen.eigenvalues.imin();
    // Points in a line leave a second direction free.
    let mut values: Vec<f64> = eigen.eigenvalues.iter().copied().collect();
    values.sort_by(f64::total_cmp);
    if values[1] < 1e-10 * values[8] {
        return None;
    }
    let h = eigen.eigenvectors.column(least);
    let inner = Matrix3::new(h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], h[8]);
    Some(to.try_inverse()? * inner * from)
}

/// Moves points to their middle and scales them to a mean distance of √2.
fn to_size_one(points: &[Vector2<f64>]) -> Option<Matrix3<f64>> {
    let count = points.len() as f64;
    let middle = points.iter().sum::<Vector2<f64>>() / count;
    let size = points.iter().map(|p| (p - middle).norm()).sum::<f64>() / count;
    let scale = std::f64::consts::SQRT_2 / size;
    scale
        .is_finite()
        .then(|| Matrix3::new(scale, 0.0, -scale * middle.x, 0.0, scale, -scale * middle.y, 0.0, 0.0, 1.0))
}

/// `camera_from_board` from a homography and a pinhole without distortion. `None` if it shows the board from behind.
#[must_use]
pub fn pose(homography: &Matrix3<f64>, focal: &Vector2<f64>, centre: &Vector2<f64>) -> Option<Pose> {
    let pinhole = Matrix3::new(focal.x, 0.0, centre.x, 0.0, focal.y, centre.y, 0.0, 0.0, 1.0);
    let columns = pinhole.try_inverse()? * homography;
    let (a, b, c): (Vector3<f64>, Vector3<f64>, Vector3<f64>) =
        (columns.column(0).into(), columns.column(1).into(), columns.column(2).into());
    // The board is in front of the camera, which fixes the sign of the whole.
    let scale = 2.0 / (a.norm() + b.norm()) * c.z.signum();
    let (a, b) = (a * scale, b * scale);
    let svd = Matrix3::from_columns(&[a, b, a.cross(&b)]).svd(true, true);
    let rotation = svd.u? * svd.v_t?;
    let rotation = nalgebra::Rotation3::from_matrix_unchecked(rotation);
    (rotation.matrix().determinant() > 0.0)
        .then(|| se3::from_parts(nalgebra::UnitQuaternion::from_rotation_matrix(&rotation), c * scale))
}
