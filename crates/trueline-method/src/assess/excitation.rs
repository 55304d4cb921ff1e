//! Shares of motion and of robot noise in the information of a scan.
//!
//! A robot that is not tilted reports an attitude with noise. That noise is in the residuals and in the Jacobian alike, so a fit
//! mistakes it for tilt and seems to determine everything. A robot that runs along the line moves nothing across it,
//! but noise of its positions makes a velocity, and with it a time offset that seems to be seen. So the path is taken
//! twice, by every other sample: the motion is the same in both, the noise is not, and what two Jacobians have in
//! common is motion.

use crate::input::observations::Observation;
use crate::problem::layout::Layout;
use crate::problem::line_problem::LineProblem;
use crate::problem::parameters::{Parameters, TIME_OFFSET};
use crate::problem::placement::placement_at;
use crate::thinning::stride;
use nalgebra::DMatrix;
use trueline_geometry::Trajectory;
use trueline_lsq::{Information, LeastSquares};
use trueline_model::Placement;

/// Information of the Jacobian with itself, and of the two halves' with each other.
pub(crate) struct SplitSampleInformation {
    own: DMatrix<f64>,
    /// With the attitude of the halves alone.
    common_attitude: DMatrix<f64>,
    /// With their velocities too.
    common: DMatrix<f64>,
}

/// Observations that are looked at.
const MOST_OBSERVATIONS: usize = 1000;
/// A direction with a smaller part of motion is not seen: noise draws its unknown towards zero by the other part.
const LEAST_MOTION: f64 = 0.9;
/// The same for the time offset, whose column's noise is not in the residual and so only makes it look better known,
/// which can be allowed for.
pub(crate) const LEAST_TIME_OFFSET_SHARE: f64 = 0.25;

impl SplitSampleInformation {
    /// Of a problem at its solution, with the robot's path by every other sample and by those between.
    #[must_use]
    pub(crate) fn of(problem: &LineProblem<'_>, at: &Parameters, halves: &[Trajectory; 2]) -> Self {
        let n = problem.dimension();
        let zeros = || DMatrix::zeros(n, n);
        let mut signal = Self { own: zeros(), common_attitude: zeros(), common: zeros() };
        let every = every(problem.list);
        // The prior is not noise; as much of it as there is of the scan.
        let known = at.known(problem.shape_prior.as_ref()).information(n) / every as f64;
        signal.own += &known;
        signal.common_attitude += &known;
        signal.common += &known;
        for (o, whitener) in problem.selected().filter(|(o, _)| is_looked_at(o, every)) {
            let Some(here) = problem.placement(o, at) else { continue };
            let by_half = |half| placement_at(half, o.stamp_s - at.time_offset_s, &at.tool_from_camera);
            let [Some(first), Some(second)] = halves.each_ref().map(by_half) else { continue };
            let jacobian =
                |placement: &Placement| Some(problem.whitened_where((o, whitener), at, placement)?.1);
            // Tremble of the attitude alone: velocities as they are.
            let turned = |half: &Placement| {
                let mut turned = here;
                turned.base_from_tool.rotation = half.base_from_tool.rotation;
                jacobian(&turned)
            };
            let (Some(own), Some(one), Some(other)) = (jacobian(&here), turned(&first), turned(&second))
            else {
                continue;
            };
            let (Some(first), Some(second)) = (jacobian(&first), jacobian(&second)) else { continue };
            let (unknowns, line) = (&problem.unknowns, o.line as usize);
            unknowns.add_square(line, &(own.transpose() * own), &mut signal.own);
            unknowns.add_square(line, &(one.transpose() * other), &mut signal.common_attitude);
            unknowns.add_square(line, &(first.transpose() * second), &mut signal.common);
        }
        signal
    }

    /// Share of motion in the information on the time offset, beside all other unknowns.
    ///
    /// A weave of one frequency moves the seam over the sheet as a turn and a shape of the sheet do: what is left for the time
    /// offset is then noise, however fast the robot moves. So it is asked for the combination of unknowns that the time
    /// offset's variance belongs to, the column v of the covariance: vᵀ J₁ᵀ J₂ v / vᵀ Jᵀ J v.
    #[must_use]
    pub(crate) fn time_offset_share(&self, information: &Information) -> f64 {
        let root = information.covariance_root();
        let combination = root * root.row(TIME_OFFSET).transpose();
        let in_combination = |matrix: &DMatrix<f64>| combination.dot(&(matrix * &combination));
        (in_combination(&self.common) / in_combination(&self.own).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0)
    }

    /// What is seen of an information without the directions that rest on noise of the attitude.
    ///
    /// In the coordinates of the covariance's root the shares are the eigenvalues of one symmetric matrix, relative to
    /// another: noise and motion come apart although they share unknowns.
    #[must_use]
    pub(crate) fn shown_by(&self, information: &Information) -> Information {
        let root = information.covariance_root();
        if root.ncols() == 0 {
            return information.clone();
        }
        let in_root = |matrix: &DMatrix<f64>| root.transpose() * (matrix + matrix.transpose()) * root * 0.5;
        let Some(factor) = in_root(&self.own).cholesky() else { return information.clone() };
        let inverse = factor.l().solve_lower_triangular(&DMatrix::identity(root.ncols(), root.ncols()));
        let Some(inverse) = inverse else { return information.clone() };
        let eigen = (&inverse * in_root(&self.common_attitude) * inverse.transpose()).symmetric_eigen();
        let moved: Vec<usize> = (0..root.ncols()).filter(|k| eigen.eigenvalues[*k] >= LEAST_MOTION).collect();
        if moved.len() == root.ncols() {
            return information.clone();
        }
        let chosen = inverse.transpose() * eigen.eigenvectors.select_columns(&moved);
        information.keeping(&chosen.qr().q())
    }
}

/// The times at which the halves of the robot's path are asked for, s, as rising as the observations' stamps.
#[must_use]
pub(crate) fn times_looked_at_s(list: &[Observation], time_offset_s: f64) -> Vec<f64> {
    let every = every(list);
    list.iter().filter(|o| is_looked_at(o, every)).map(|o| o.stamp_s - time_offset_s).collect()
}

fn every(list: &[Observation]) -> usize {
    stride(list.len(), MOST_OBSERVATIONS)
}

/// Whole images, so that no line is passed over.
fn is_looked_at(o: &Observation, every: usize) -> bool {
    (o.frame as usize).is_multiple_of(every)
}
