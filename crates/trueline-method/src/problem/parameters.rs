//! The values of all unknowns, and how a tangent step moves them.

pub use crate::problem::unknowns::{LINES, ROTATION, TIME_OFFSET, TRANSLATION, line_index};

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
    /// The sensor's shape; `None` where it is exact. Only together with bows.
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

    /// Which unknowns these are the values of.
    #[must_use]
    pub fn unknowns(&self) -> Unknowns {
        let model = match (self.curvatures.is_empty(), &self.shape) {
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

    /// How clock and sensor differ from another value of theirs, as a tangent step: what [`Parameters::retract`] adds.
    #[must_use]
    pub fn minus(&self, from: &Guess) -> SVector<f64, LINES> {
        let (turn, shift) = se3::difference_decoupled(&self.tool_from_camera, &from.tool_from_camera);
        let mut step = SVector::<f64, LINES>::zeros();
        step[TIME_OFFSET] = self.time_offset_s - from.time_offset_s;
        step.fixed_rows_mut::<3>(ROTATION).copy_from(&turn);
        step.fixed_rows_mut::<3>(TRANSLATION).copy_from(&shift);
        step
    }

    /// Time offset and hand-eye transform alone.
    #[must_use]
    pub fn guess(&self) -> Guess {
        Guess { time_offset_s: self.time_offset_s, tool_from_camera: self.tool_from_camera }
    }

    /// Where a measured point of the camera frame really is, m: what sticks out of the sheet stays as it is.
    #[must_use]
    pub fn corrected(&self, sheet: &LaserSheet, point_in_camera: &Vector3<f64>) -> Vector3<f64> {
        self.shape.map_or(*point_in_camera, |shape| {
            let reported = sheet.coordinates(point_in_camera);
            point_in_camera + sheet.axes() * (shape.corrected(&reported).0 - reported)
        })
    }

    /// How far a point in base is from the seam along the line's two cross axes, m; its bow counts as the seam.
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
