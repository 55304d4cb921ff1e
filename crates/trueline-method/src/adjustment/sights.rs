//! What the adjustment asks of the sights of a scan: whitened residuals with their derivatives, and the state on which they depend.
//!
//! A seam point has two residuals, the stripes of a frame have up to five. Each kind is one implementation of [`Sights`]. Blocks, noise, equations
//! and answer are the same for all.

use crate::assess::tilt_bias::BIAS;
use crate::input::shape_prior::ShapePrior;
use crate::problem::known::Known;
use crate::problem::layout::Layout;
use nalgebra::{Const, DMatrix, DVector, Dyn, OMatrix, SMatrix, SVector, Vector3};
use trueline_geometry::Pose;

/// Directions in which a target may have a form, at most: across a seam, or the heights of the surfaces of a joint.
pub(crate) const FORMS: usize = 3;

/// One value of all unknowns.
pub(crate) trait State: Clone {
    /// Order of the unknowns.
    type Layout: Layout + Clone;
    /// First index of the sensor's shape among the local unknowns of a frame.
    const LOCAL_SHAPE: usize;

    /// The order of its unknowns.
    fn layout(&self) -> Self::Layout;

    /// Number of unknowns.
    fn dimension(&self) -> usize;

    /// Moves all unknowns by a tangent step.
    fn retract(&self, step: &DVector<f64>) -> Self;

    /// The priors of its unknowns.
    fn known(&self, shape_prior: Option<&ShapePrior>) -> Known;

    /// Number of targets.
    fn targets(&self) -> usize;

    /// Unknowns that bend a target, with a prior.
    fn bends(&self) -> std::ops::Range<usize>;

    /// The sensor's shape among the unknowns.
    fn shape(&self) -> std::ops::Range<usize>;
}

/// The sights of a scan, in order of target and time.
pub(crate) trait Sights<const ROWS: usize, const LOCAL: usize> {
    /// Their unknowns.
    type State: State;

    /// Number of directions in which a target may have a form.
    fn directions(&self) -> usize;

    /// Evaluates every frame at a state. `None` for frames that cannot be placed.
    fn frames(&self, at: &Self::State) -> Vec<Option<Frame<ROWS, LOCAL>>>;

    /// The residual and the place along the target, m, at a state near that of the frames.
    fn residual(&self, frame: &Frame<ROWS, LOCAL>, at: &Self::State) -> Option<(SVector<f64, ROWS>, f64)>;

    /// How many neighbouring frames share a row.
    fn together(&self) -> usize {
        1
    }

    /// Poses of the robot at these frames.
    fn poses(&self, at: &Self::State) -> Vec<Pose>;

    /// Jacobians of a frame by the local unknowns at a state, along two paths of the same motion with independent noise. `None` where there are none.
    fn along_halves(
        &self,
        frame: &Frame<ROWS, LOCAL>,
        at: &Self::State,
    ) -> Option<[SMatrix<f64, ROWS, LOCAL>; 2]> {
        let _ = (frame, at);
        None
    }

    /// Directions of the tangent that the scan does not determine, one a column. `None` if that is not known.
    fn unseen(&self) -> Option<&DMatrix<f64>> {
        None
    }
}

/// The residuals of one frame with their Jacobians, whitened by the noise of features, robot samples and stamps. A residual of pure noise has unit
/// variance.
#[derive(Clone, Debug)]
pub(crate) struct Frame<const ROWS: usize, const LOCAL: usize> {
    /// Index in the list of its sights.
    pub index: usize,
    /// Its target: a line, or a joint.
    pub target: usize,
    /// When it was seen, s.
    pub stamp_s: f64,
    /// The whitened residuals, measured minus predicted.
    pub residual: SVector<f64, ROWS>,
    /// Whether each was measured. A missing one is zero.
    pub is_there: [bool; ROWS],
    /// Jacobian by the local unknowns.
    pub by_unknowns: SMatrix<f64, ROWS, LOCAL>,
    /// Jacobian by a shift of the robot, axes of base, 1/m.
    pub by_shift: SMatrix<f64, ROWS, 3>,
    /// Jacobian by a turn of the robot about the tool's origin, axes of base, 1/rad.
    pub by_turn: SMatrix<f64, ROWS, 3>,
    /// Jacobian by each number of the detector's bias, 1 / (px per 10°).
    pub by_bias: SMatrix<f64, ROWS, BIAS>,
    /// Jacobian by the numbers of the external axes. No columns without axes.
    pub by_axes: OMatrix<f64, Const<ROWS>, Dyn>,
    /// Jacobian by half the square of a lag of the robot behind its recorded poses, 1/s².
    pub by_lag: SVector<f64, ROWS>,
    /// Jacobian by the form in each direction, 1/m, with a column for each place of `along_m`.
    pub by_form: [SMatrix<f64, ROWS, ROWS>; FORMS],
    /// Places along the target at which its form counts, m.
    pub along_m: [f64; ROWS],
    /// Jacobian of the first place by the local unknowns, where the form moves with it.
    pub along_by_unknowns: SVector<f64, LOCAL>,
    /// The same relative to neighbouring frames, which see the same part of the target.
    pub apart_by_unknowns: SVector<f64, LOCAL>,
    /// The measured point from the tool's origin, axes of base, m.
    pub lever: Vector3<f64>,
    /// The robot's pose.
    pub base_from_tool: Pose,
    /// Velocity of the tool's origin, m/s, and angular velocity, rad/s, axes of base.
    pub twist: [Vector3<f64>; 2],
    /// Unit vector from the target to the sensor's origin, perpendicular to the seam, axes of base. Of plates the normal of the first.
    pub towards_sensor: Vector3<f64>,
    /// The axes across the seam in base.
    pub across: [Vector3<f64>; 2],
}

/// The target of each frame and its place along it, m.
pub(crate) fn places<const ROWS: usize, const LOCAL: usize>(
    frames: &[Option<Frame<ROWS, LOCAL>>],
) -> Vec<Option<(usize, f64)>> {
    let place = |frame: &Frame<ROWS, LOCAL>| (frame.target, frame.along_m[0]);
    frames.iter().map(|frame| frame.as_ref().map(place)).collect()
}
