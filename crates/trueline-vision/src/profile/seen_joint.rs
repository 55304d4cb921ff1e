//! Findings in one profile: straight faces and the place of the seam on them, with its covariance.

use super::face::{Face, FaceSupport, square_to};
use super::face_end::FaceEnd;
use nalgebra::{Matrix2, Vector2};

/// The seam of a profile.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProfileSeam {
    /// The corner, the edge or the middle of the gap (x along the stripe, z range), mm.
    pub point_mm: Vector2<f64>,
    /// Its covariance, mm².
    pub covariance_mm2: Matrix2<f64>,
    /// Angle between faces that meet, rad; of others zero.
    pub angle_rad: f64,
    /// Width of the gap between two plates, mm; of other joints zero.
    pub gap_mm: f64,
    /// The faces, the left one first; a plate alone is the first.
    pub faces: [Option<FaceSupport>; 2],
}

/// Straight faces and the place of the seam on them; the statement of their noise may still change.
#[derive(Clone)]
pub(super) struct SeenJoint {
    /// The left one first; a plate alone is the first.
    pub faces: [Option<Face>; 2],
    /// Half of the visible part of each.
    pub half_lengths_mm: [f64; 2],
    /// The seam.
    pub seam: SeenSeam,
}

/// Place of the seam.
#[derive(Clone)]
pub(super) enum SeenSeam {
    /// Crossing of both faces.
    Crossing(Vector2<f64>),
    /// End of one of them.
    Edge {
        /// Number of the face.
        face: usize,
        /// Its end.
        end: FaceEnd,
    },
    /// In the middle between the ends of both.
    Gap([FaceEnd; 2]),
}

impl SeenJoint {
    /// The ends of faces that make the seam, each with the number of its face.
    pub(super) fn ends_mut(&mut self) -> impl Iterator<Item = &mut FaceEnd> {
        let (one, two) = match &mut self.seam {
            SeenSeam::Crossing(_) => (None, None),
            SeenSeam::Edge { end, .. } => (Some(end), None),
            SeenSeam::Gap([left, right]) => (Some(left), Some(right)),
        };
        one.into_iter().chain(two)
    }

    /// The end of a face that makes the seam, if it does.
    pub(super) fn end_of_face_mut(&mut self, number: usize) -> Option<&mut FaceEnd> {
        match &mut self.seam {
            SeenSeam::Edge { face, end } if *face == number => Some(end),
            SeenSeam::Gap(ends) => ends.get_mut(number),
            _ => None,
        }
    }

    /// The seam and the measurement of each face; `None` for faces that are parallel and should meet.
    pub(super) fn seam(&self) -> Option<ProfileSeam> {
        let (point_mm, covariance_mm2) = self.point()?;
        let supports = [0, 1].map(|k| {
            let half_length_mm = self.half_lengths_mm[k];
            self.faces[k].map(|face| face.support(&point_mm, half_length_mm))
        });
        let angle_rad = match self.seam {
            SeenSeam::Crossing(_) => self.normals()?.determinant().abs().min(1.0).asin(),
            _ => 0.0,
        };
        let gap_mm = self.gap_mm().map_or(0.0, |(width_mm, _)| width_mm);
        Some(ProfileSeam { point_mm, covariance_mm2, angle_rad, gap_mm, faces: supports })
    }

    /// Width of the gap and the distance of columns beside it, mm; `None` of other joints.
    pub(super) fn gap_mm(&self) -> Option<(f64, f64)> {
        let SeenSeam::Gap([left, right]) = &self.seam else { return None };
        Some(((right.at() - left.at()).norm(), left.pitch_mm().max(right.pitch_mm())))
    }

    fn point(&self) -> Option<(Vector2<f64>, Matrix2<f64>)> {
        match &self.seam {
            SeenSeam::Crossing(corner) => {
                let inverse = self.normals()?.try_inverse()?;
                let variance_mm2 = |k: usize| Some(self.faces[k]?.bowed_variance_at(corner));
                let variances = Vector2::new(variance_mm2(0)?, variance_mm2(1)?);
                Some((*corner, inverse * Matrix2::from_diagonal(&variances) * inverse.transpose()))
            }
            SeenSeam::Edge { end, .. } => Some(end_of(end)),
            SeenSeam::Gap(ends) => {
                let [left, right] = ends.each_ref().map(end_of);
                Some((0.5 * (left.0 + right.0), 0.25 * (left.1 + right.1)))
            }
        }
    }

    /// Rows: normals of both faces.
    fn normals(&self) -> Option<Matrix2<f64>> {
        let normal = |k: usize| Some(square_to(&self.faces[k]?.direction()).transpose());
        Some(Matrix2::from_rows(&[normal(0)?, normal(1)?]))
    }
}

/// The end of a face, and its covariance: along the face that of the end, square to it that of the tip's line.
fn end_of(end: &FaceEnd) -> (Vector2<f64>, Matrix2<f64>) {
    let (along, at) = (end.tip.direction(), end.at());
    let across = square_to(&along);
    let covariance = along * along.transpose() * end.sigma_mm().powi(2)
        + across * across.transpose() * end.tip.variance_at(&at);
    (at, covariance)
}
