//! Fraction of the seam's motion in the sheet that the robot's motion explains, for shifted image stamps.

use crate::order_statistics::median;
use crate::thinning::stride;
use nalgebra::{SMatrix, SVector, Vector3};
use trueline_dataset::{Feature, Measured, Recording};
use trueline_geometry::{Pose, so3};

/// Number of robot coordinates.
const COORDINATES: usize = 6;
/// Number of robot and seam coordinates.
const ALL: usize = COORDINATES + 2;
/// A coordinate that varies less than this (m, rad) has no information.
const MOVES: f64 = 1e-5;
/// Maximum seam points of a regression.
const POINTS: usize = 400;
/// Minimum places of a regression.
const LEAST_PLACES: usize = 30;

/// Place of the seam in the sheet or the image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Place {
    /// Its stamp since the first image, s.
    pub time_s: f64,
    /// Two coordinates, in any unit.
    pub at: [f64; 2],
}

/// The robot's path and the seam's places, prepared for regressions.
#[derive(Clone, Debug)]
pub(crate) struct ShiftRegression {
    times_s: Vec<f64>,
    coordinates: Vec<SVector<f64, COORDINATES>>,
    places: Vec<Place>,
    least_places: usize,
    least_overlap_s: f64,
}

/// Result of a shift.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Explained {
    /// Fraction of the variance of the seam's place that is explained.
    pub explained: f64,
    /// Log likelihood ratio to no relation at all.
    pub score: f64,
}

impl ShiftRegression {
    /// From a recording's poses. `None` if there is too little of either.
    #[must_use]
    pub(super) fn new(
        recording: &Recording,
        places: Vec<Place>,
        least_share: f64,
        least_overlap_s: f64,
    ) -> Option<Self> {
        let first = recording.robot.first()?;
        let middle = recording.lines_from_carrier(&recording.robot[recording.robot.len() / 2]);
        let since = |stamp_ns: i64| (stamp_ns - first.stamp_ns) as f64 * 1e-9;
        let times_s: Vec<f64> = recording.robot.iter().map(|sample| since(sample.stamp_ns)).collect();
        let coordinates = recording.robot.iter();
        let coordinates =
            coordinates.map(|sample| coordinates_of(&middle, &recording.lines_from_carrier(sample)));
        let least_places = LEAST_PLACES.max((places.len() as f64 * least_share).ceil() as usize);
        let long_enough = *times_s.last()? >= least_overlap_s && places.last()?.time_s >= least_overlap_s;
        (long_enough && places.len() >= least_places).then(|| Self {
            coordinates: coordinates.collect(),
            times_s,
            places,
            least_places,
            least_overlap_s,
        })
    }

    /// The shifts at which the streams overlap for long enough, s. At a shift s an image at `time_s` belongs to the pose at `time_s − s` since the
    /// first one.
    #[must_use]
    pub(super) fn range_s(&self) -> [f64; 2] {
        let images_s = self.places.last().map_or(0.0, |place| place.time_s);
        let robot_s = self.times_s.last().copied().unwrap_or(0.0);
        [self.least_overlap_s - robot_s, images_s - self.least_overlap_s]
    }

    /// Result at a shift. `None` if too few images remain.
    #[must_use]
    pub(super) fn at(&self, shift_s: f64) -> Option<Explained> {
        let mut sums = SVector::<f64, ALL>::zeros();
        let mut products = SMatrix::<f64, ALL, ALL>::zeros();
        let mut count = 0_usize;
        for place in &self.places {
            let Some(pose) = self.coordinates_at(place.time_s - shift_s) else { continue };
            let mut row = SVector::<f64, ALL>::zeros();
            row.fixed_rows_mut::<COORDINATES>(0).copy_from(&pose);
            row[COORDINATES] = place.at[0];
            row[COORDINATES + 1] = place.at[1];
            sums += row;
            products += row * row.transpose();
            count += 1;
        }
        if count < self.least_places {
            return None;
        }
        let n = count as f64;
        explained(&(products / n - sums * sums.transpose() / (n * n)), n)
    }

    fn coordinates_at(&self, time_s: f64) -> Option<SVector<f64, COORDINATES>> {
        let after = self.times_s.partition_point(|t| *t <= time_s);
        let (before, after) = (after.checked_sub(1)?, after);
        let span = self.times_s.get(after)? - self.times_s[before];
        let share = (time_s - self.times_s[before]) / span;
        Some(self.coordinates[before].lerp(&self.coordinates[after], share))
    }
}

/// Small-motion coordinates of a pose relative to another: shift and rotation in the other's frame.
fn coordinates_of(middle: &Pose, pose: &Pose) -> SVector<f64, COORDINATES> {
    let relative = middle.inverse() * pose;
    let turn: Vector3<f64> = so3::log(&relative.rotation);
    let shift = relative.translation.vector;
    SVector::<f64, COORDINATES>::from([shift.x, shift.y, shift.z, turn.x, turn.y, turn.z])
}

/// Regression of the last two variables on the others, from their covariance.
fn explained(covariance: &SMatrix<f64, ALL, ALL>, count: f64) -> Option<Explained> {
    let mut regressors = SMatrix::<f64, COORDINATES, COORDINATES>::identity();
    let mut cross = SMatrix::<f64, COORDINATES, 2>::zeros();
    let scale = |k: usize| covariance[(k, k)].max(0.0).sqrt();
    for i in (0..COORDINATES).filter(|i| scale(*i) > MOVES) {
        for j in (0..COORDINATES).filter(|j| scale(*j) > MOVES) {
            regressors[(i, j)] = covariance[(i, j)] / (scale(i) * scale(j));
        }
        // Two coordinates may be collinear. A ridge keeps the solution finite.
        regressors[(i, i)] = 1.0 + 1e-6;
        for k in 0..2 {
            let seam = scale(COORDINATES + k);
            cross[(i, k)] =
                if seam > 0.0 { covariance[(i, COORDINATES + k)] / (scale(i) * seam) } else { 0.0 };
        }
    }
    let solved = regressors.cholesky()?.solve(&cross);
    let mut score = 0.0;
    let (mut left, mut whole) = (0.0, 0.0);
    for k in 0..2 {
        let unexplained = (1.0 - cross.column(k).dot(&solved.column(k))).clamp(1e-9, 1.0);
        score -= count * unexplained.ln();
        let variance = covariance[(COORDINATES + k, COORDINATES + k)].max(0.0);
        left += unexplained * variance;
        whole += variance;
    }
    (whole > 0.0).then(|| Explained { explained: 1.0 - left / whole, score })
}

/// Places of the seam in the image, for the line with the most features, with outliers smoothed away.
pub(super) fn places(features: &[Feature]) -> Vec<Place> {
    let lines = features.iter().map(|feature| feature.line).max().map_or(0, |last| last as usize + 1);
    let mut counts = vec![0_usize; lines];
    features.iter().for_each(|feature| counts[feature.line as usize] += 1);
    let most = (0..lines).max_by_key(|line| counts[*line]).unwrap_or(0);
    let origin_ns = features.first().map_or(0, |feature| feature.stamp_ns);
    let raw: Vec<Place> = features
        .iter()
        .filter(|feature| feature.line as usize == most)
        .map(|feature| Place {
            time_s: (feature.stamp_ns - origin_ns) as f64 * 1e-9,
            at: match feature.measured {
                Measured::Pixel(at) | Measured::Profile(at) => at,
                // The stripe spans the sheet, so two of three coordinates are sufficient.
                Measured::Point([x, _, z]) => [x, z],
            },
        })
        .collect();
    let every = stride(raw.len(), POINTS);
    let middle = |k: usize, axis: usize| {
        let around = raw[k.saturating_sub(3)..(k + 4).min(raw.len())].iter();
        median(around.map(|place| place.at[axis])).unwrap_or(raw[k].at[axis])
    };
    (0..raw.len()).step_by(every).map(|k| Place { at: [middle(k, 0), middle(k, 1)], ..raw[k] }).collect()
}
