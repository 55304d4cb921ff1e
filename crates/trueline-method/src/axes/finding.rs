//! Results of a scan about an external axis.

use crate::adjustment::axis_step::AxisStep;
use nalgebra::{Matrix2, SMatrix, SVector, Vector3};
use trueline_dataset::{AxisRecord, Carries, Recording};
use trueline_geometry::axis::{AXIS, AXIS_POINT, AXIS_SCALE, AXIS_TIME_OFFSET};
use trueline_geometry::{Axis, AxisKind, Line};

/// Prior of an axis's numbers about its start if none is stated: direction (rad), place (m), time offset (s).
const ANYWHERE: [f64; 3] = [0.3, 1.0, 0.1];
/// Uncertainty of a quantity held fixed, SI: encoders count exactly, and an axis that stands moves nothing.
const HELD: f64 = 1e-9;
/// A quantity is not determined if its ± exceeds this part of its prior.
const SHOWN: f64 = 0.5;

/// Prior standard deviations of the numbers of all axes, SI.
#[must_use]
pub(crate) fn sigmas_before(recording: &Recording) -> Vec<f64> {
    let of_axes = recording.axes.iter().zip(recording.axes_that_move());
    of_axes.flat_map(|(record, moves)| sigmas_of(record, moves)).collect()
}

/// Prior standard deviations of the numbers of an axis, SI. One that does not move has none to estimate.
#[must_use]
pub fn sigmas_of(record: &AxisRecord, moves: bool) -> [f64; AXIS] {
    if !moves {
        return [HELD; AXIS];
    }
    let offset_s = if record.holds_time_offset { HELD } else { ANYWHERE[2] };
    let stated = record.guess.map_or([None; 2], |guess| guess.sigma);
    let direction = stated[0].unwrap_or(ANYWHERE[0]);
    let point = stated[1].unwrap_or(ANYWHERE[1]);
    [direction, direction, point, point, HELD, offset_s]
}

/// Factor on the first order's ± of direction and place of an axis with a hidden time offset. It runs evenly while the
/// sensor moves evenly along the seam, and its place then looks like a bow of that seam. In 40 simulated cells errors were
/// up to 11 times the first order, and an independent bound with a free bow is 6 times as large (0.26° and 1.1 mm against
/// 0.045° and 0.2 mm).
const WITH_A_BOW: f64 = 6.0;

/// A covariance with the ± of direction and place multiplied.
fn widened(covariance: &SMatrix<f64, AXIS, AXIS>, times: f64) -> SMatrix<f64, AXIS, AXIS> {
    let factor = |k: usize| if k < AXIS_SCALE { times } else { 1.0 };
    SMatrix::from_fn(|i, j| covariance[(i, j)] * factor(i) * factor(j))
}

/// A group of an axis's numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AxisPart {
    /// Its direction.
    Direction,
    /// Its place.
    Place,
    /// Its own time offset.
    TimeOffset,
}

impl AxisPart {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Direction, Self::Place, Self::TimeOffset];

    /// The name in the result.
    #[must_use]
    pub fn code(self) -> &'static str {
        match self {
            Self::Direction => "direction",
            Self::Place => "point",
            Self::TimeOffset => "time_offset",
        }
    }
}

/// Result about an axis.
#[derive(Clone, Debug, PartialEq)]
pub struct AxisFinding {
    /// Its name.
    pub name: String,
    /// The body that it moves.
    pub carries: Carries,
    /// Its place.
    pub axis: Axis,
    /// Whether it moved during readings.
    pub moves: bool,
    /// Covariance of its numbers, SI; `None` if they were not estimated.
    covariance: Option<SMatrix<f64, AXIS, AXIS>>,
    before: [f64; AXIS],
    seams_are_parallel: bool,
    /// Whether it stood at only two places. Then two different axes map one seam to the other.
    has_twin: bool,
    holds_time_offset: bool,
    /// Whether the robot stood at each reading, so that there is no delay.
    at_stops: bool,
    /// Change in the last adjustment, standard deviations.
    pub(crate) step_sigmas: f64,
}

impl AxisFinding {
    /// Whether its place along the seams is undetermined. For straight seams in one direction, a shift along them has no
    /// effect. Nor can the scan decide between two directions of the axis that are alike perpendicular to them.
    #[must_use]
    pub fn is_open_along_seams(&self) -> bool {
        self.seams_are_parallel && self.axis.kind == AxisKind::Linear && self.carries != Carries::Sensor
    }

    /// Whether it stood at two places at most during the readings: two axes turn the one seam into the other.
    #[must_use]
    pub fn has_twin(&self) -> bool {
        self.has_twin
    }

    /// The largest standard deviation of a part in any direction, rad, m or s; `None` if the scan does not determine it, or
    /// an axis does not have it.
    #[must_use]
    pub fn sigma(&self, part: AxisPart) -> Option<f64> {
        let covariance = self.covariance.as_ref().filter(|_| self.moves)?;
        let (first, size) = match part {
            AxisPart::Direction if self.is_open_along_seams() => return None,
            AxisPart::Direction | AxisPart::Place if self.has_twin => return None,
            AxisPart::TimeOffset if self.holds_time_offset => return None,
            AxisPart::Direction => (0, 2),
            AxisPart::Place if self.axis.kind == AxisKind::Linear => return None,
            AxisPart::Place => (AXIS_POINT, 2),
            AxisPart::TimeOffset => (AXIS_TIME_OFFSET, 1),
        };
        let largest = if size == 1 {
            covariance[(first, first)]
        } else {
            let own: Matrix2<f64> = covariance.fixed_view::<2, 2>(first, first).into();
            own.symmetric_eigenvalues().max()
        };
        let sigma = largest.sqrt();
        (sigma < SHOWN * self.before[first]).then_some(sigma)
    }

    /// Covariance of its numbers (see [`trueline_geometry::axis::AXIS`]), SI; `None` if they were not estimated.
    #[must_use]
    pub fn covariance(&self) -> Option<&SMatrix<f64, AXIS, AXIS>> {
        self.covariance.as_ref()
    }

    /// Whether an axis has a part.
    #[must_use]
    pub fn has(&self, part: AxisPart) -> bool {
        match part {
            AxisPart::Direction => true,
            AxisPart::Place => self.axis.kind == AxisKind::Rotary,
            AxisPart::TimeOffset => !self.at_stops,
        }
    }

    /// Standard deviation of the scale. 0 if it is exact.
    #[must_use]
    pub fn scale_sigma(&self) -> f64 {
        let sigma = self.covariance.map_or(0.0, |covariance| covariance[(AXIS_SCALE, AXIS_SCALE)].sqrt());
        if sigma <= HELD { 0.0 } else { sigma }
    }
}

/// Seams within this angle count as parallel, rad.
const PARALLEL_RAD: f64 = 0.1;

/// Whether all lines are parallel.
#[must_use]
pub(crate) fn are_parallel(lines: &[Line]) -> bool {
    let leans = |pair: &[Line]| pair[0].direction().cross(&pair[1].direction()).norm();
    lines.windows(2).all(|pair| leans(pair) < PARALLEL_RAD)
}

/// Results about all axes of a recording, by the step of an adjustment.
#[must_use]
pub fn of_all(recording: &Recording, lines: &[Line], found: Option<&AxisStep>) -> Vec<AxisFinding> {
    let (records, moves) = (&recording.axes, recording.axes_that_move());
    let finding = |(k, record): (usize, &AxisRecord)| {
        let known =
            record.known.unwrap_or_else(|| Axis::new(record.kind, Vector3::z_axis(), Vector3::zeros()));
        let before = sigmas_of(record, moves[k]);
        let first_order = found.map(|found| {
            let first = AXIS * k;
            SMatrix::<f64, AXIS, AXIS>::from_fn(|i, j| found.covariance[(first + i, first + j)])
        });
        // If it stands during the readings, it runs along with nothing.
        let stamps_ns = recording.features.iter().map(|feature| feature.stamp_ns);
        let is_hidden = record.holds_time_offset && !recording.at_stops && record.stands(stamps_ns).is_none();
        let covariance = first_order.map(|own| if is_hidden { widened(&own, WITH_A_BOW) } else { own });
        let step = found.map_or_else(SVector::zeros, |found| {
            SVector::<f64, AXIS>::from_fn(|i, _| found.step[AXIS * k + i])
        });
        let sigmas = |i: usize| first_order.map_or(f64::INFINITY, |own| own[(i, i)].sqrt());
        AxisFinding {
            name: record.name.clone(),
            carries: record.carries,
            axis: known.retract(&step),
            moves: moves[k],
            covariance,
            before,
            seams_are_parallel: are_parallel(lines),
            has_twin: record.kind == AxisKind::Rotary
                && record
                    .stands(recording.features.iter().map(|feature| feature.stamp_ns))
                    .is_some_and(|stands| stands < 3),
            holds_time_offset: record.holds_time_offset,
            at_stops: recording.at_stops,
            step_sigmas: (0..AXIS).map(|i| step[i].abs() / sigmas(i)).fold(0.0, f64::max),
        }
    };
    records.iter().enumerate().map(finding).collect()
}
