//! The values of all unknowns of the plates' problem, with their prior.

use crate::input::shape_prior::ShapePrior;
use crate::problem::known::Known;
use crate::problem::parameters::{ROTATION, TIME_OFFSET, TRANSLATION};
use crate::stripe::target::Target;
use crate::stripe::unknowns::StripeUnknowns;
use nalgebra::{DVector, SVector, Vector3};
use trueline_geometry::{Pose, se3};
use trueline_model::{Plate, SheetShape};

/// Prior standard deviation of each surface term, m.
pub const SURFACE_SIGMA_M: f64 = 0.2e-3;

/// One value of all unknowns; see [`StripeUnknowns`] for their order in the tangent.
#[derive(Clone, Debug, PartialEq)]
pub struct StripeState {
    /// Time offset, s.
    pub time_offset_s: f64,
    /// Hand-eye transform.
    pub tool_from_camera: Pose,
    /// The surfaces of each joint.
    pub joints: Vec<Target>,
    /// The sensor's shape; `None` where it is held.
    pub shape: Option<SheetShape>,
}

impl StripeState {
    /// The layout of these unknowns.
    #[must_use]
    pub fn unknowns(&self) -> StripeUnknowns {
        let edged = self.joints.iter().any(|target| target.edge.is_some());
        StripeUnknowns { joints: self.joints.len(), edged, shaped: self.shape.is_some() }
    }

    /// Moves all unknowns by a tangent step.
    #[must_use]
    pub fn retract(&self, step: &DVector<f64>) -> Self {
        let unknowns = self.unknowns();
        let three = |first: usize| Vector3::new(step[first], step[first + 1], step[first + 2]);
        let joints = self.joints.iter().enumerate().map(|(joint, target)| {
            target.moved(|number, plate| {
                let first = unknowns.surface(joint, number).start;
                let surface = SVector::from_fn(|k, _| step[first + k]);
                plate.retract(&three(unknowns.plane(joint, number).start), &surface)
            })
        });
        let first = unknowns.shape().start;
        let pose = &self.tool_from_camera;
        Self {
            time_offset_s: self.time_offset_s + step[TIME_OFFSET],
            tool_from_camera: se3::retract_decoupled(pose, &three(ROTATION), &three(TRANSLATION)),
            joints: joints.collect(),
            shape: self.shape.map(|shape| shape.retract(&SVector::from_fn(|k, _| step[first + k]))),
        }
    }

    /// The same with flat plates.
    #[must_use]
    pub(crate) fn flattened(&self) -> Self {
        let flat = |plate: &Plate| Plate { surface_m: [0.0; Plate::SURFACE], ..*plate };
        let joints = self.joints.iter().map(|target| target.moved(|_, plate| flat(plate)));
        Self { joints: joints.collect(), ..self.clone() }
    }

    /// The prior of forms and shape, at these values.
    #[must_use]
    pub(crate) fn known(&self, shape_prior: Option<&ShapePrior>) -> Known {
        let unknowns = self.unknowns();
        let mut known = Known::default();
        for (joint, target) in self.joints.iter().enumerate() {
            for number in 0..unknowns.surfaces() {
                // A missing edge is flat. Only this prior holds it.
                let form_m = target.surface(number).map_or([0.0; Plate::SURFACE], |plate| plate.surface_m);
                known = known.each(unknowns.surface(joint, number), &form_m, SURFACE_SIGMA_M);
            }
        }
        known.shape(unknowns.shape(), self.shape.as_ref(), shape_prior)
    }
}
