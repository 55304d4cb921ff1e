//! The values of all unknowns, and how a tangent step moves them.

pub use crate::problem::unknowns::{LINES, ROTATION, TIME_OFFSET, TRANSLATION, line_index};

use crate::input::shape_prior::ShapePrior;
use crate::problem::known::Known;
use crate::problem::unknowns::{Model, Unknowns};
use nalgebra::{DVector, SVector, Vector2, Vector3, Vector4};
use trueline_dataset::Guess;
use trueline_geometry::{Line, Pose, se3};
use trueline_model::{Curvature, LaserSheet, SheetShape};

/// One value of all unknowns; see [`Unknowns`] for their order in the tangent.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameters {
    /// Time offset t_d, s.
    pub time_offset_s: f64,
    /// Hand-eye transform.
    pub tool_from_camera: Pose,
    /// The lines in base.
    pub lines: Vec<Line>,
    /// The bow of each line; empty where lines are straight.
    pub curvatures: Vec<Curvature>,
    /// The sensor's shape; `None` where it is exact. Only together with bows, or without lines.
    pub shape: Option<SheetShape>,
}

impl Parameters {
    /// Straight lines and an exact sensor.
    #[must_use]
    pub fn straight(guess: &Guess, lines: Vec<Line>) -> Self {
        Self {
            time_offset_s: guess.time_offset_s,
            tool_from_camera: guess.tool_from_camera,
            lines,
            curvatures: Vec::new(),
            shape: None,
        }
    }

    /// The layout of these unknowns.
    #[must_use]
    pub fn unknowns(&self) -> Unknowns {
        let model = match (self.curvatures.is_empty(), &self.shape) {
            (true, Some(_)) if self.lines.is_empty() => Model::Shaped,
            (true, _) => Model::Straight,
            (false, None) => Model::Bowed,
            (false, Some(_)) => Model::Shaped,
        };
        Unknowns { lines: self.lines.len(), model }
    }

    /// Number of unknowns.
    #[must_use]
    pub fn dimension(&self) -> usize {
        self.unknowns().dimension()
    }

    /// Moves all unknowns by a tangent step \[Yang2025, Eq. 18\].
    #[must_use]
    pub fn retract(&self, step: &DVector<f64>) -> Self {
        let unknowns = self.unknowns();
        let three = |first: usize| Vector3::new(step[first], step[first + 1], step[first + 2]);
        let lines = self.lines.iter().enumerate().map(|(k, line)| {
            let first = line_index(k);
            line.retract(&Vector4::from_fn(|row, _| step[first + row]))
        });
        let curvatures = self.curvatures.iter().enumerate().map(|(k, curvature)| {
            let first = unknowns.bow(k).start;
            curvature.retract(&Vector2::new(step[first], step[first + 1]))
        });
        let first = unknowns.shape().start;
        let shape = self.shape.map(|shape| shape.retract(&SVector::from_fn(|row, _| step[first + row])));
        Self {
            time_offset_s: self.time_offset_s + step[TIME_OFFSET],
            tool_from_camera: se3::retract_decoupled(
                &self.tool_from_camera,
                &three(ROTATION),
                &three(TRANSLATION),
            ),
            lines: lines.collect(),
            curvatures: curvatures.collect(),
            shape,
        }
    }

    /// Clock and sensor relative to another value, as a tangent step: the inverse of [`Parameters::retract`].
    #[must_use]
    pub fn minus(&self, from: &Guess) -> SVector<f64, LINES> {
        let (turn, shift) = se3::difference_decoupled(&self.tool_from_camera, &from.tool_from_camera);
        let mut step = SVector::<f64, LINES>::zeros();
        step[TIME_OFFSET] = self.time_offset_s - from.time_offset_s;
        step.fixed_rows_mut::<3>(ROTATION).copy_from(&turn);
        step.fixed_rows_mut::<3>(TRANSLATION).copy_from(&shift);
        step
    }

    /// The prior of bows and shape, at these values.
    #[must_use]
    pub(crate) fn known(&self, shape_prior: Option<&ShapePrior>) -> Known {
        let unknowns = self.unknowns();
        let bows = self.curvatures.iter().enumerate().fold(Known::default(), |known, (line, curvature)| {
            known.each(unknowns.bow(line), &curvature.bow_m, curvature.prior_sigma_m())
        });
        bows.shape(unknowns.shape(), self.shape.as_ref(), shape_prior)
    }

    /// Time offset and hand-eye transform alone.
    #[must_use]
    pub fn guess(&self) -> Guess {
        Guess { time_offset_s: self.time_offset_s, tool_from_camera: self.tool_from_camera }
    }

    /// The true place of a measured point in the camera frame, m. Its distance from the sheet is unchanged.
    #[must_use]
    pub fn corrected(&self, sheet: &LaserSheet, point_in_camera: &Vector3<f64>) -> Vector3<f64> {
        self.shape.map_or(*point_in_camera, |shape| {
            let reported = sheet.coordinates(point_in_camera);
            point_in_camera + sheet.axes() * (shape.corrected(&reported).0 - reported)
        })
    }

    /// Offset of a point in base from the seam with its bow, along the line's two cross axes, m.
    #[must_use]
    pub(crate) fn offset_from_seam(&self, line: usize, point_in_base: &Vector3<f64>) -> Vector2<f64> {
        let seam = &self.lines[line];
        let straight = seam.offset_of(point_in_base);
        let along = seam.direction().dot(&(point_in_base - seam.anchor()));
        self.curvatures.get(line).map_or(straight, |bow| straight - bow.offset_at(along))
    }
}

/// Names of the tangent's components of straight lines, with SI units.
#[must_use]
pub fn names(lines: usize) -> Vec<String> {
    Unknowns { lines, model: Model::Straight }.names()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;
    use nalgebra::UnitVector3;
    use trueline_geometry::{Plane, so3};

    fn parameters() -> Parameters {
        let direction = UnitVector3::new_normalize(Vector3::new(1.0, 0.4, -0.3));
        Parameters {
            time_offset_s: 0.02,
            tool_from_camera: se3::from_parts(
                so3::exp(&Vector3::new(0.3, -0.2, 1.1)),
                Vector3::new(0.1, 0.2, 0.3),
            ),
            lines: vec![
                Line::new(Vector3::new(1.0, -0.2, 0.4), &direction),
                Line::new(Vector3::new(0.7, 0.1, 0.4), &Vector3::y_axis()),
            ],
            curvatures: [[3e-4, -2e-4], [-1e-4, 5e-4]]
                .map(|bow_m| Curvature { bow_m, half_length_m: 0.2, middle_m: 0.03 })
                .into(),
            shape: Some(SheetShape { h: [0.01, -0.02, 0.013, 0.3, -0.4], origin_m: [0.003, 0.045] }),
        }
    }

    #[test]
    fn a_step_moves_each_block_by_its_own_numbers() {
        let at = parameters();
        let step = DVector::from_fn(at.dimension(), |k, _| 1e-3 * (k + 1) as f64);
        let moved = at.retract(&step);
        // Sums and products of numbers near 1.
        let rounding = 1e-14;
        assert!((moved.minus(&at.guess()) - step.fixed_rows::<LINES>(0)).norm() < rounding);
        for (line, first) in [(0, 7), (1, 11)] {
            let of_line = step.fixed_rows::<4>(first).into_owned();
            assert_eq!(moved.lines[line], at.lines[line].retract(&of_line));
        }
        for (line, first) in [(0, 15), (1, 17)] {
            for k in 0..2 {
                let moved = moved.curvatures[line].bow_m[k] - at.curvatures[line].bow_m[k];
                assert!((moved - step[first + k]).abs() < rounding);
            }
        }
        for k in 0..5 {
            assert!((moved.shape.unwrap().h[k] - at.shape.unwrap().h[k] - step[19 + k]).abs() < rounding);
        }
        assert_eq!(moved.unknowns(), at.unknowns());
        let straight = Parameters::straight(&at.guess(), at.lines.clone());
        assert_eq!((straight.dimension(), straight.guess()), (15, at.guess()));
        assert_eq!(names(2), straight.unknowns().names());
    }

    #[test]
    fn the_offset_from_a_seam_is_that_from_its_bow() {
        let at = parameters();
        for line in 0..2 {
            let seam = &at.lines[line];
            let bow = at.curvatures[line].offset_at(0.11);
            let off = Vector2::new(2e-3, -5e-4);
            let place = Vector3::new(0.11, bow.x + off.x, bow.y + off.y);
            let point = seam.anchor() + seam.axes() * place;
            assert!((at.offset_from_seam(line, &point) - off).norm() < 1e-15);
            let straight = Parameters::straight(&at.guess(), at.lines.clone());
            assert!((straight.offset_from_seam(line, &point) - off - bow).norm() < 1e-15);
        }
    }

    #[test]
    fn a_point_is_corrected_within_the_sheet_and_keeps_what_sticks_out() {
        let at = parameters();
        let sheet = LaserSheet::from_plane(Plane::from_height(0.036, 2.12, 0.13).unwrap());
        let there = Vector2::new(0.012, 0.06);
        let out = sheet.plane().normal().into_inner() * 1e-4;
        let corrected = at.corrected(&sheet, &(sheet.point(&there) + out));
        let (expected, _) = at.shape.unwrap().corrected(&there);
        assert!((corrected - sheet.point(&expected) - out).norm() < 1e-16);
        assert!((expected - there).norm() > 1e-4);
        let exact = Parameters { shape: None, ..at };
        assert_eq!(exact.corrected(&sheet, &out), out);
    }
}
