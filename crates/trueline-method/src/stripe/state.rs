//! The values of all unknowns of the plates' problem, and what is known of them beforehand.

use crate::problem::block_priors::ShapePrior;
use crate::problem::parameters::{ROTATION, TIME_OFFSET, TRANSLATION};
use crate::stripe::target::Target;
use crate::stripe::unknowns::StripeUnknowns;
use nalgebra::{DMatrix, DVector, SVector, Vector3};
use trueline_geometry::{Pose, se3};
use trueline_model::{Plate, SheetShape};

/// Standard deviation of each surface term before the scan, m.
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
    /// Which unknowns these are the values of.
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

    /// The values of those unknowns of which something is known beforehand; zero for the others.
    #[must_use]
    pub(crate) fn about_prior(&self) -> DVector<f64> {
        let unknowns = self.unknowns();
        let mut values = DVector::zeros(unknowns.dimension());
        for (joint, target) in self.joints.iter().enumerate() {
            for (number, plate) in target.surfaces() {
                unknowns.surface(joint, number).zip(plate.surface_m).for_each(|(k, beta)| values[k] = beta);
            }
        }
        if let Some(shape) = self.shape {
            unknowns.shape().zip(shape.h).for_each(|(k, h)| values[k] = h);
        }
        values
    }

    /// The information of what is known beforehand, over all unknowns.
    #[must_use]
    pub(crate) fn prior_information(&self, shape_prior: Option<&ShapePrior>) -> DMatrix<f64> {
        let unknowns = self.unknowns();
        let mut all = DMatrix::zeros(unknowns.dimension(), unknowns.dimension());
        for k in unknowns.asked_for()..unknowns.shape().start {
            all[(k, k)] = SURFACE_SIGMA_M.powi(-2);
        }
        if let Some(prior) = shape_prior.filter(|_| self.shape.is_some()) {
            let first = unknowns.shape().start;
            all.view_mut((first, first), (5, 5)).copy_from(&prior.information);
        }
        all
    }
}
