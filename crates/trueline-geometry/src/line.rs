//! Straight lines in space, in three forms.
//!
//! | form | code | numbers | regular |
//! |---|---|---|---|
//! | anchor and axes | [`Line`] | the solver's form: 2 rotations, 2 shifts | for every line |
//! | Plücker (n, v) | [`PlueckerLine`] | moment and direction \[Yang2025, Eq. 8\] | for every line, but 6 numbers |
//! | orthonormal (U, m) | [`OrthonormalLine`] | Log U and m \[Yang2025, Eqs. 8, 9\] | not through the origin |
//!
//! Moments are n = p × v throughout, as in the paper.

use crate::so3;
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, UnitVector3, Vector2, Vector3, Vector4};

/// A line through an anchor point, with a right-handed triad whose first axis is its direction.
///
/// The anchor stays near the data, so the four numbers of [`Line::retract`] are small and independent for any line. Differs from Eq. (18), which
/// perturbs (U, m). That form loses rank for a line through the base origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    anchor: Vector3<f64>,
    axes: UnitQuaternion<f64>,
}

impl Line {
    /// Number of degrees of freedom.
    pub const DIMENSION: usize = 4;

    /// The line through `anchor` (m) along `direction`.
    #[must_use]
    pub fn new(anchor: Vector3<f64>, direction: &UnitVector3<f64>) -> Self {
        let axes = UnitQuaternion::rotation_between(&Vector3::x_axis(), direction)
            // Opposite to x: any half turn about an axis orthogonal to x.
            .unwrap_or_else(|| so3::exp(&Vector3::new(0.0, 0.0, std::f64::consts::PI)));
        Self { anchor, axes }
    }

    /// The origin of the chart's rotations, m.
    #[must_use]
    pub fn anchor(&self) -> &Vector3<f64> {
        &self.anchor
    }

    /// Unit direction u₁.
    #[must_use]
    pub fn direction(&self) -> Vector3<f64> {
        self.axes * Vector3::x()
    }

    /// The triad \[u₁ u₂ u₃\] as columns; u₁ is the direction.
    #[must_use]
    pub fn axes(&self) -> Matrix3<f64> {
        self.axes.to_rotation_matrix().into_inner()
    }

    /// The same line with the anchor moved along it to the point nearest to `point`.
    #[must_use]
    pub fn anchored_near(&self, point: &Vector3<f64>) -> Self {
        let direction = self.direction();
        let along = direction.dot(&(point - self.anchor));
        Self { anchor: self.anchor + direction * along, axes: self.axes }
    }

    /// The same line with the opposite direction.
    #[must_use]
    pub fn reversed(&self) -> Self {
        let half_turn_about_u3 = so3::exp(&Vector3::new(0.0, 0.0, std::f64::consts::PI));
        Self { anchor: self.anchor, axes: self.axes * half_turn_about_u3 }
    }

    /// Moves the line by (θ₂, θ₃, δ₂, δ₃): rotations about u₂ and u₃ through the anchor (rad), shifts along u₂ and u₃ (m).
    #[must_use]
    pub fn retract(&self, step: &Vector4<f64>) -> Self {
        let axes = self.axes();
        let (u2, u3) = (axes.column(1), axes.column(2));
        Self {
            anchor: self.anchor + u2 * step[2] + u3 * step[3],
            axes: so3::exp(&(u2 * step[0] + u3 * step[1])) * self.axes,
        }
    }

    /// Offset of a point from the line along u₂ and u₃, m. Both numbers are independent.
    #[must_use]
    pub fn offset_of(&self, point: &Vector3<f64>) -> Vector2<f64> {
        let local = self.axes.inverse() * (point - self.anchor);
        Vector2::new(local.y, local.z)
    }

    /// Distance of a point from the line, m.
    #[must_use]
    pub fn distance(&self, point: &Vector3<f64>) -> f64 {
        self.offset_of(point).norm()
    }

    /// Plücker coordinates (n = p × v, v).
    #[must_use]
    pub fn to_pluecker(&self) -> PlueckerLine {
        let direction = self.direction();
        PlueckerLine { moment: self.anchor.cross(&direction), direction }
    }
}

/// Plücker coordinates of a line: moment n = p × v (m) for any point p on it, and unit direction v.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlueckerLine {
    /// Moment n = p × v, m.
    pub moment: Vector3<f64>,
    /// Unit direction v.
    pub direction: Vector3<f64>,
}

impl PlueckerLine {
    /// The point of the line nearest to the origin, v × n, m.
    #[must_use]
    pub fn nearest_point_to_origin(&self) -> Vector3<f64> {
        self.direction.cross(&self.moment)
    }

    /// The line with its anchor at the point nearest to the origin.
    #[must_use]
    pub fn to_line(&self) -> Line {
        Line::new(self.nearest_point_to_origin(), &UnitVector3::new_normalize(self.direction))
    }

    /// The paper's minimal form (U, m), Eq. (8).
    ///
    /// Returns `None` for a line through the origin, where n/|n| does not exist.
    #[must_use]
    pub fn to_orthonormal(&self) -> Option<OrthonormalLine> {
        let m = self.moment.norm();
        // Below this, n has no direction beyond the rounding of p × v.
        if m < 1e-12 {
            return None;
        }
        let (u1, u2) = (self.direction, self.moment / m);
        let axes = Matrix3::from_columns(&[u1, u2, u1.cross(&u2)]); // Eq. (8)
        let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes));
        Some(OrthonormalLine { rotation, distance: m })
    }
}

/// Orthonormal representation of a line: U = \[v, n/|n|, v × n/|n|\] and m = |n| \[Yang2025, Eq. 8\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OrthonormalLine {
    /// U.
    pub rotation: UnitQuaternion<f64>,
    /// m, the distance of the line from the base origin, m.
    pub distance: f64,
}

impl OrthonormalLine {
    /// φ's rotation part ω = Log U, rad.
    #[must_use]
    pub fn rotation_vector(&self) -> Vector3<f64> {
        so3::log(&self.rotation)
    }

    /// Plücker coordinates: v = U e₁, n = m U e₂ \[Yang2025, Eq. 9\].
    #[must_use]
    pub fn to_pluecker(&self) -> PlueckerLine {
        PlueckerLine {
            moment: self.rotation * Vector3::y() * self.distance,
            direction: self.rotation * Vector3::x(),
        }
    }
}
