//! Hand-eye calibration from a board at standstill, in closed form: AX = XB.
//!
//! A is the robot's motion between two stops in the tool frame, B the camera's motion between the same stops, X the wanted
//! `tool_from_camera`. Three classics, each with its own rotation:
//! \[Tsai1989\] (modified Rodrigues vectors), \[Park1994\] (logarithms), \[Daniilidis1999\] (dual quaternions, rotation
//! and translation at once).

use nalgebra::{
    DMatrix, DVector, Matrix3, Matrix3x4, Matrix4, Quaternion, SVD, UnitQuaternion, Vector3, Vector4,
};
use trueline_geometry::{Pose, se3, so3};

/// A motion of the tool, and that of the camera which it carries.
#[derive(Clone, Copy, Debug)]
pub struct MotionPair {
    /// `tool_before_from_tool_after`.
    pub tool: Pose,
    /// `camera_before_from_camera_after`.
    pub camera: Pose,
}

/// Every pair of stops: their robot poses `base_from_tool` and the camera's `camera_from_board`.
#[must_use]
pub fn pairs(base_from_tool: &[Pose], camera_from_board: &[Pose]) -> Vec<MotionPair> {
    let mut pairs = Vec::new();
    for i in 0..base_from_tool.len() {
        for j in i + 1..base_from_tool.len() {
            pairs.push(MotionPair {
                tool: base_from_tool[i].inverse() * base_from_tool[j],
                camera: camera_from_board[i] * camera_from_board[j].inverse(),
            });
        }
    }
    pairs
}

/// A closed form.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ClosedForm {
    /// Tsai and Lenz.
    Tsai,
    /// Park and Martin.
    Park,
    /// Daniilidis.
    Daniilidis,
}

impl ClosedForm {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Tsai, Self::Park, Self::Daniilidis];

    /// The authors' name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Tsai => "Tsai",
            Self::Park => "Park",
            Self::Daniilidis => "Daniilidis",
        }
    }

    /// `tool_from_camera`; `None` where the motions do not fix it, as when all turn about one axis.
    #[must_use]
    pub fn solve(self, pairs: &[MotionPair]) -> Option<Pose> {
        match self {
            Self::Tsai => with_translation(pairs, &tsai_rotation(pairs)?),
            Self::Park => with_translation(pairs, &park_rotation(pairs)?),
            Self::Daniilidis => daniilidis(pairs),
        }
    }
}

/// Rotation of \[Park1994\], with the translation and the scale k of the camera's lengths from (R_A − 1) t − k R_X t_B = −t_A by least squares
/// \[Andreff2001\]; `None` where the motions do not fix them, or where k is not positive.
pub(crate) fn with_scale(pairs: &[MotionPair]) -> Option<(Pose, f64)> {
    let rotation = park_rotation(pairs)?;
    let (mut normal, mut right) = (Matrix4::zeros(), Vector4::zeros());
    for pair in pairs {
        let turned = pair.tool.rotation.to_rotation_matrix().into_inner() - Matrix3::identity();
        let mut row = Matrix3x4::zeros();
        row.fixed_columns_mut::<3>(0).copy_from(&turned);
        row.column_mut(3).copy_from(&-(rotation * pair.camera.translation.vector));
        normal += row.transpose() * row;
        right -= row.transpose() * pair.tool.translation.vector;
    }
    // Angles and lengths differ by orders: scaled to a unit diagonal first.
    let size = normal.diagonal().map(|v: f64| 1.0 / v.sqrt());
    let unit = Matrix4::from_fn(|i, j| normal[(i, j)] * size[i] * size[j]);
    if unit.symmetric_eigenvalues().min() < 1e-9 {
        return None;
    }
    let found = unit.cholesky()?.solve(&right.component_mul(&size)).component_mul(&size);
    let shift: Vector3<f64> = found.fixed_rows::<3>(0).into();
    (found[3] > 0.0).then(|| (se3::from_parts(rotation, shift), found[3]))
}

/// (R_A − 1) t = R_X t_B − t_A, by least squares.
fn with_translation(pairs: &[MotionPair], rotation: &UnitQuaternion<f64>) -> Option<Pose> {
    let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for pair in pairs {
        let turned = pair.tool.rotation.to_rotation_matrix().into_inner() - Matrix3::identity();
        let value = rotation * pair.camera.translation.vector - pair.tool.translation.vector;
        normal += turned.transpose() * turned;
        right += turned.transpose() * value;
    }
    let values = normal.symmetric_eigenvalues();
    if values.min() < 1e-9 * values.max() {
        return None;
    }
    Some(se3::from_parts(*rotation, normal.cholesky()?.solve(&right)))
}

/// Modified Rodrigues vector 2 sin(θ/2) axis \[Tsai1989, Eq. 8\].
fn rodrigues(rotation: &UnitQuaternion<f64>) -> Vector3<f64> {
    let q = rotation.quaternion();
    q.imag() * (2.0 * if q.w < 0.0 { -1.0 } else { 1.0 })
}

/// (P_A + P_B)× P′ = P_B − P_A, and P = 2 P′/√(1 + |P′|²) \[Tsai1989, Eqs. 12 and 14\].
fn tsai_rotation(pairs: &[MotionPair]) -> Option<UnitQuaternion<f64>> {
    let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for pair in pairs {
        let (a, b) = (rodrigues(&pair.tool.rotation), rodrigues(&pair.camera.rotation));
        let cross = so3::hat(&(a + b));
        normal += cross.transpose() * cross;
        right += cross.transpose() * (b - a);
    }
    let half = normal.cholesky()?.solve(&right);
    // P′ = tan(θ/2) axis.
    let angle = 2.0 * half.norm().atan();
    let axis = if half.norm() > 0.0 { half.normalize() } else { Vector3::x() };
    Some(so3::exp(&(axis * angle)))
}

/// R = (MᵀM)^−½ Mᵀ with M = Σ β αᵀ of the logarithms α of A and β of B \[Park1994, Eq. 22\].
fn park_rotation(pairs: &[MotionPair]) -> Option<UnitQuaternion<f64>> {
    let sum: Matrix3<f64> = pairs
        .iter()
        .map(|pair| so3::log(&pair.camera.rotation) * so3::log(&pair.tool.rotation).transpose())
        .sum();
    let svd = sum.svd(true, true);
    let (u, v_t) = (svd.u?, svd.v_t?);
    let determinant = (v_t.transpose() * u.transpose()).determinant();
    let signs = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, determinant.signum()));
    let rotation = v_t.transpose() * signs * u.transpose();
    let rotation = nalgebra::Rotation3::from_matrix_unchecked(rotation);
    (svd.singular_values[1] > 1e-9 * svd.singular_values[0])
        .then(|| UnitQuaternion::from_rotation_matrix(&rotation))
}

/// Real and dual part of a pose's unit dual quaternion.
fn dual_quaternion(pose: &Pose) -> (Quaternion<f64>, Quaternion<f64>) {
    let q = *pose.rotation.quaternion();
    let q = if q.w < 0.0 { -q } else { q };
    let t = Quaternion::from_imag(pose.translation.vector);
    (q, t * q * 0.5)
}

/// The null vector of all motions' six rows over (q, q′), of the two right singular vectors the combination that is a unit
/// dual quaternion \[Daniilidis1999, Eqs. 31 to 35\].
fn daniilidis(pairs: &[MotionPair]) -> Option<Pose> {
    let mut rows = DMatrix::zeros(6 * pairs.len(), 8);
    for (k, pair) in pairs.iter().enumerate() {
        let ((a, a_dual), (b, b_dual)) = (dual_quaternion(&pair.tool), dual_quaternion(&pair.camera));
        let block = |first: Vector3<f64>, second: Vector3<f64>| {
            let mut block = nalgebra::SMatrix::<f64, 3, 4>::zeros();
            block.column_mut(0).copy_from(&(first - second));
            block.fixed_columns_mut::<3>(1).copy_from(&so3::hat(&(first + second)));
            block
        };
        let real = block(a.imag(), b.imag());
        let dual = block(a_dual.imag(), b_dual.imag());
        rows.fixed_view_mut::<3, 4>(6 * k, 0).copy_from(&real);
        rows.fixed_view_mut::<3, 4>(6 * k + 3, 0).copy_from(&dual);
        rows.fixed_view_mut::<3, 4>(6 * k + 3, 4).copy_from(&real);
    }
    let normal = rows.transpose() * &rows;
    let svd = SVD::new(normal, false, true);
    let v_t = svd.v_t?;
    if svd.singular_values[5] < 1e-12 * svd.singular_values[0] {
        return None;
    }
    let part = |row: usize, from: usize| -> Vector4<f64> {
        DVector::from_iterator(4, (0..4).map(|k| v_t[(row, from + k)])).fixed_rows::<4>(0).into()
    };
    let ((u1, v1), (u2, v2)) = ((part(6, 0), part(6, 4)), (part(7, 0), part(7, 4)));
    // λ₁(u₁, v₁) + λ₂(u₂, v₂) with real · dual = 0: a quadratic in s = λ₁/λ₂.
    let (a, b, c) = (u1.dot(&v1), u1.dot(&v2) + u2.dot(&v1), u2.dot(&v2));
    let root = (b * b - 4.0 * a * c).max(0.0).sqrt();
    let size = |s: f64| s * s * u1.dot(&u1) + 2.0 * s * u1.dot(&u2) + u2.dot(&u2);
    let s = [(-b + root) / (2.0 * a), (-b - root) / (2.0 * a)]
        .into_iter()
        .filter(|s| s.is_finite())
        .max_by(|x, y| size(*x).total_cmp(&size(*y)))?;
    let scale = 1.0 / size(s).sqrt();
    let (real, dual) = ((u1 * s + u2) * scale, (v1 * s + v2) * scale);
    let (q, q_dual) = (quaternion(&real), quaternion(&dual));
    let translation = (q_dual * q.conjugate()).imag() * 2.0;
    Some(se3::from_parts(UnitQuaternion::new_normalize(q), translation))
}

fn quaternion(parts: &Vector4<f64>) -> Quaternion<f64> {
    Quaternion::new(parts[0], parts[1], parts[2], parts[3])
}
