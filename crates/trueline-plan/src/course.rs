//! A curved seam: frames along it carry a plan over a straight seam of its length onto it.
//!
//! The frame at a place s has its y axis along the seam and its z axis as near to the approach as possible. The motion is planned
//! over the straight seam that touches the curve at its middle. F(s) F₀(s)⁻¹ maps each pose onto the curve; F₀(s) is the frame at
//! s of the straight seam. So the sensor views the curve as it views the straight seam, and the robot turns with the curve.

use crate::seam::Seam;
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, UnitVector3, Vector3};
use trueline_geometry::{Polyline, Pose, se3};

/// Distance of the samples of a seam, m …
const STEP_M: f64 = 4e-3;
/// … and the standard deviation of their smoothing, in samples: a robot does not follow a sharp corner.
const SMOOTH: f64 = 2.0;
/// Number of samples on either side that are used, and added beyond the ends: seven standard deviations. The remainder changes
/// from sample to sample, and a jump of 1e-6 rad within 4 ms would be a jerk of 20 rad/s³.
const REACH: usize = 14;
/// Shorter seams are not scanned, m.
const LEAST_M: f64 = 20e-3;
/// Largest cosine between seam and approach (30°).
const STEEP: f64 = 0.866;
/// Ends nearer than this coincide, m.
const ONE_M: f64 = 1e-6;

/// A curved seam.
#[derive(Clone, Debug, PartialEq)]
pub struct Course {
    /// The curve as drawn.
    drawn: Polyline,
    /// Samples, including those beyond the ends.
    padded: Vec<Vector3<f64>>,
    step_m: f64,
    length_m: f64,
    /// Whether the curve is closed.
    pub closed: bool,
    approach: UnitVector3<f64>,
    /// Point and tangent at its middle.
    middle: (Vector3<f64>, Vector3<f64>),
}

/// Cause that a scan over a curve cannot be planned.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum NoCourse {
    /// The seam is too short.
    #[error("the seam is {length_mm:.1} mm long: a scan needs at least 20 mm")]
    Short {
        /// Its length, mm.
        length_mm: f64,
    },
    /// The seam runs along the approach somewhere.
    #[error(
        "at {at_mm:.0} mm from its beginning the seam runs within 30° of the direction in which the sensor looks"
    )]
    Steep {
        /// Where, mm.
        at_mm: f64,
    },
}

impl NoCourse {
    /// Hint for the user.
    #[must_use]
    pub fn hint(&self) -> &'static str {
        match self {
            Self::Short { .. } => "the drawing must be in millimetres, in the robot's base frame",
            Self::Steep { .. } => {
                "set [attitude] so that the sensor looks at the whole seam from the side, or plan its parts alone"
            }
        }
    }
}

impl Course {
    /// Along straight segments between points in base, m, viewed along `approach`.
    ///
    /// # Errors
    /// [`NoCourse`] with the place.
    pub fn along(points: &[Vector3<f64>], approach: UnitVector3<f64>) -> Result<Self, NoCourse> {
        let mut arc_m = vec![0.0];
        for pair in points.windows(2) {
            arc_m.push(arc_m[arc_m.len() - 1] + (pair[1] - pair[0]).norm());
        }
        let length_m = arc_m[arc_m.len() - 1];
        if length_m.is_nan() || length_m < LEAST_M {
            return Err(NoCourse::Short { length_mm: 1e3 * length_m });
        }
        let closed = (points[points.len() - 1] - points[0]).norm() < ONE_M;
        let steps = (length_m / STEP_M).round();
        let step_m = length_m / steps;
        let at = |place_m: f64| {
            let after = arc_m.partition_point(|arc| *arc < place_m).clamp(1, arc_m.len() - 1);
            let part =
                (place_m - arc_m[after - 1]) / (arc_m[after] - arc_m[after - 1]).max(f64::MIN_POSITIVE);
            points[after - 1].lerp(&points[after], part)
        };
        let sample = |k: i64| {
            let place_m = k as f64 * step_m;
            if closed { at(place_m.rem_euclid(length_m)) } else { at(place_m) }
        };
        // Beyond an open end the last segment continues.
        let reach = REACH as i64 + 1;
        let padded = (-reach..=steps as i64 + reach).map(sample).collect();
        let drawn = Polyline::new(points.to_vec()).ok_or(NoCourse::Short { length_mm: 0.0 })?;
        let middle = (Vector3::zeros(), Vector3::zeros());
        let mut own = Self { drawn, padded, step_m, length_m, closed, approach, middle };
        own.middle = own.smoothed(0.5 * length_m);
        let steep = (0..=steps as usize).map(|k| k as f64 * step_m).find(|place_m| {
            let (_, tangent) = own.smoothed(*place_m);
            tangent.dot(&approach).abs() > STEEP
        });
        steep.map_or(Ok(own), |place_m| Err(NoCourse::Steep { at_mm: 1e3 * place_m }))
    }

    /// The curve as drawn, in base.
    #[must_use]
    pub fn drawn(&self) -> &Polyline {
        &self.drawn
    }

    /// The straight seam of the same length that touches it at its middle.
    #[must_use]
    pub fn straight(&self) -> Seam {
        let (middle, along) = self.middle;
        let half = along * (0.5 * self.length_m);
        Seam { from_m: middle - half, to_m: middle + half }
    }

    /// The transform of a pose over the straight seam onto this one, at a place, m from its middle.
    #[must_use]
    pub(crate) fn bend(&self, from_middle_m: f64) -> Pose {
        let (middle, along) = self.middle;
        let straight = self.frame(middle + along * from_middle_m, along);
        let (point, tangent) = self.smoothed(from_middle_m + 0.5 * self.length_m);
        self.frame(point, tangent) * straight.inverse()
    }

    /// Points along it in base, m.
    #[must_use]
    pub fn points(&self) -> Vec<Vector3<f64>> {
        let steps = (self.length_m / self.step_m).round() as usize;
        (0..=steps).map(|k| self.smoothed(k as f64 * self.step_m).0).collect()
    }

    fn frame(&self, point: Vector3<f64>, along: Vector3<f64>) -> Pose {
        let range = (self.approach.into_inner() - along * along.dot(&self.approach)).normalize();
        let axes = Matrix3::from_columns(&[along.cross(&range), along, range]);
        let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes));
        se3::from_parts(rotation, point)
    }

    /// Point and unit tangent at a place from the beginning, m: means of the samples about it, with Gaussian weights.
    fn smoothed(&self, place_m: f64) -> (Vector3<f64>, Vector3<f64>) {
        let place = (place_m.clamp(0.0, self.length_m) / self.step_m) + (REACH + 1) as f64;
        let first = place.floor() as usize - REACH;
        let (mut sum, mut point, mut slopes, mut slope) = (0.0, Vector3::zeros(), 0.0, Vector3::zeros());
        for (k, sample) in self.padded.iter().enumerate().skip(first).take(2 * REACH + 1) {
            let off = (k as f64 - place) / SMOOTH;
            let weight = (-0.5 * off * off).exp();
            sum += weight;
            point += sample * weight;
            slopes += off * weight;
            slope += sample * (off * weight);
        }
        let point = point / sum;
        (point, (slope - point * slopes).normalize())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pipe() -> Course {
        const RADIUS_M: f64 = 0.05;
        let at = |k: u32| {
            let turn = f64::from(k) / 720.0 * std::f64::consts::TAU;
            Vector3::new(RADIUS_M * turn.cos(), RADIUS_M * turn.sin(), 0.3)
        };
        let mut points: Vec<_> = (0..=720).map(at).collect();
        points[720] = points[0];
        let Ok(course) = Course::along(&points, -Vector3::z_axis()) else { unreachable!("a pipe") };
        course
    }

    /// A frame at rest over the straight seam goes once round the pipe, and turns with it.
    #[test]
    fn a_straight_seam_is_carried_round_a_pipe() {
        let course = pipe();
        let seam = course.straight();
        let (length_m, Some(along)) = (seam.length_m(), seam.direction()) else {
            unreachable!("it has a length")
        };
        assert!(course.closed && (length_m - 0.05 * std::f64::consts::TAU).abs() < 1e-4);
        let middle = 0.5 * (seam.from_m + seam.to_m);
        for k in 0..=20 {
            let off_m = (f64::from(k) / 20.0 - 0.5) * length_m;
            let bend = course.bend(off_m);
            let over = bend * nalgebra::Point3::from(middle + along.into_inner() * off_m);
            // The mean over 8 mm of a circle of 50 mm lies s²/2R = 0.64 mm inside of it.
            let radius_m = over.x.hypot(over.y);
            assert!((radius_m - (0.05 - 0.64e-3)).abs() < 0.05e-3, "{radius_m}");
            let turned = bend.rotation * Vector3::z();
            assert!((turned - Vector3::z()).norm() < 1e-9);
            let tangent = bend.rotation * along.into_inner();
            assert!(tangent.dot(&over.coords.xy().normalize().push(0.0)).abs() < 1e-3);
        }
        // It turns smoothly: at 45 mm/s and 4 ms a step its jerk is a hundredth of what robots are allowed, 10 rad/s³ and more.
        let step_s = 4e-3;
        let heading = |k: u32| {
            let turned = course.bend(0.01 + 0.045 * step_s * f64::from(k)).rotation * along.into_inner();
            turned.y.atan2(turned.x)
        };
        for k in 0..200 {
            let third = heading(k + 3) - 3.0 * heading(k + 2) + 3.0 * heading(k + 1) - heading(k);
            assert!((third / f64::powi(step_s, 3)).abs() < 0.1, "{k}: {third}");
        }
        // Between two steps of a tenth of a millimetre it turns by 2 mrad.
        let turn = |m: f64| course.bend(m).rotation.angle_to(&course.bend(m + 1e-4).rotation);
        assert!((turn(0.0123) - 1e-4 / 0.05).abs() < 1e-4);
    }

    #[test]
    fn a_seam_along_the_view_is_none() {
        let up = [Vector3::zeros(), Vector3::new(0.1, 0.0, 0.0), Vector3::new(0.1, 0.0, 0.2)];
        assert!(matches!(Course::along(&up, -Vector3::z_axis()), Err(NoCourse::Steep { .. })));
        let short = [Vector3::zeros(), Vector3::new(0.01, 0.0, 0.0)];
        assert!(matches!(Course::along(&short, -Vector3::z_axis()), Err(NoCourse::Short { .. })));
    }
}
