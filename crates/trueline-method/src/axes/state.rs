//! One value of all unknowns of a scan with axes.

use crate::input::axis_chain::{AxisChain, Link};
use nalgebra::{DVector, SVector, Vector3, Vector4};
use trueline_geometry::axis::{AXIS, AXIS_POINT, AXIS_SCALE, AXIS_TIME_OFFSET};
use trueline_geometry::{AxisKind, Line, Pose, se3};

/// Numbers of time offset, hand-eye transform and line.
pub(crate) const OWN: usize = 11;
/// Usual bound of an axis's time offset, s. For an axis that moves steadily it is the only information.
const USUAL_OFFSET_S: f64 = 0.1;

/// One value of all unknowns.
#[derive(Clone, Debug)]
pub(crate) struct State {
    /// Time offset of the readings, s.
    pub time_offset_s: f64,
    /// Hand-eye transform.
    pub tool_from_camera: Pose,
    /// The seam.
    pub line: Line,
    /// The axes.
    pub chain: AxisChain,
}

impl State {
    /// The estimated numbers of the axes: all except scales, points of linear axes, and unobservable time offsets.
    pub(crate) fn of_axes(&self) -> Vec<(usize, usize)> {
        let is_free = |link: &Link, number: usize| match number {
            AXIS_SCALE => false,
            AXIS_TIME_OFFSET => !link.holds_time_offset,
            AXIS_POINT..AXIS_SCALE => link.axis.kind == AxisKind::Rotary,
            _ => true,
        };
        let numbers = |(k, link): (usize, &Link)| -> Vec<(usize, usize)> {
            (0..AXIS).filter(|number| is_free(link, *number)).map(|number| (k, number)).collect()
        };
        self.chain.links.iter().enumerate().flat_map(numbers).collect()
    }

    /// Twice the prior cost of the axes' time offsets.
    pub(crate) fn unusual(&self) -> f64 {
        let square = |link: &Link| (link.axis.time_offset_s / USUAL_OFFSET_S).powi(2);
        self.chain.links.iter().filter(|link| !link.holds_time_offset).map(square).sum()
    }

    /// Gradient and weight of an axis number's prior. Only time offsets have one.
    pub(crate) fn known(&self, (link, number): (usize, usize)) -> [f64; 2] {
        let weight = USUAL_OFFSET_S.powi(-2);
        if number == AXIS_TIME_OFFSET {
            [weight * self.chain.links[link].axis.time_offset_s, weight]
        } else {
            [0.0; 2]
        }
    }

    pub(crate) fn moved(&self, free: &[(usize, usize)], step: &DVector<f64>) -> Self {
        let three = |k: usize| Vector3::new(step[k], step[k + 1], step[k + 2]);
        let mut chain = self.chain.clone();
        for (k, link) in chain.links.iter_mut().enumerate() {
            let mut own = SVector::<f64, AXIS>::zeros();
            for (place, (_, number)) in free.iter().enumerate().filter(|(_, (link, _))| *link == k) {
                own[*number] = step[OWN + place];
            }
            link.axis = link.axis.retract(&own);
        }
        Self {
            time_offset_s: self.time_offset_s + step[0],
            tool_from_camera: se3::retract_decoupled(&self.tool_from_camera, &three(1), &three(4)),
            line: self.line.retract(&Vector4::new(step[7], step[8], step[9], step[10])),
            chain,
        }
    }
}
