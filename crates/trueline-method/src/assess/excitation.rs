//! Shares of motion and of robot noise in the information of a scan.
//!
//! A robot that is not tilted reports its attitude with noise. That noise is in the residuals and in the Jacobian alike. A fit mistakes it for tilt
//! and seems to determine everything. A robot that runs along the line moves nothing across it, but its position noise looks like a velocity, and
//! the time offset then seems observable. The path is therefore taken twice, by every other sample. Both halves have the same motion and independent
//! noise, so the common part of their Jacobians is motion.

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

/// Information of the Jacobian with itself, and between the two halves.
pub(crate) struct SplitSampleInformation {
    own: DMatrix<f64>,
    /// With the attitude of the halves only.
    common_attitude: DMatrix<f64>,
    /// With their velocities too.
    common: DMatrix<f64>,
}

/// Maximum number of observations evaluated.
const MOST_OBSERVATIONS: usize = 1000;
/// Motion share below which a direction is unobservable: the noise share biases its unknown towards zero.
const LEAST_MOTION: f64 = 0.9;
/// The same for the time offset. The noise in its column is not in the residual. It only makes the offset look better known, which can be corrected.
pub(crate) const LEAST_TIME_OFFSET_SHARE: f64 = 0.25;

impl SplitSampleInformation {
    /// At a problem's solution, with the robot's path by every other sample and by those between.
    #[must_use]
    pub(crate) fn of(problem: &LineProblem<'_>, at: &Parameters, halves: &[Trajectory; 2]) -> Self {
        let n = problem.dimension();
        let zeros = || DMatrix::zeros(n, n);
        let mut signal = Self { own: zeros(), common_attitude: zeros(), common: zeros() };
        let every = every(problem.list);
        // The prior is not noise. It is scaled to the sampled part of the scan.
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
            // Attitude noise alone, with unchanged velocities.
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
    /// A weave of one frequency moves the seam over the sheet as a rotation and a shape of the sheet do. The remaining information on the time
    /// offset is then noise, however fast the robot moves. The share is therefore computed for the combination of unknowns that belongs to the time
    /// offset's variance, the column v of the covariance: vᵀ J₁ᵀ J₂ v / vᵀ Jᵀ J v.
    #[must_use]
    pub(crate) fn time_offset_share(&self, information: &Information) -> f64 {
        let root = information.covariance_root();
        let combination = root * root.row(TIME_OFFSET).transpose();
        let in_combination = |matrix: &DMatrix<f64>| combination.dot(&(matrix * &combination));
        (in_combination(&self.common) / in_combination(&self.own).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0)
    }

    /// The information without directions that rest on attitude noise.
    ///
    /// In the coordinates of the covariance's root the shares are generalised eigenvalues of two symmetric matrices. They separate noise from motion
    /// even where both act on the same unknowns.
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

/// The times at which the halves of the robot's path are evaluated, s, in the order of the observations' stamps.
#[must_use]
pub(crate) fn times_looked_at_s(list: &[Observation], time_offset_s: f64) -> Vec<f64> {
    let every = every(list);
    list.iter().filter(|o| is_looked_at(o, every)).map(|o| o.stamp_s - time_offset_s).collect()
}

fn every(list: &[Observation]) -> usize {
    stride(list.len(), MOST_OBSERVATIONS)
}

/// Selects whole images, so that no line is skipped.
fn is_looked_at(o: &Observation, every: usize) -> bool {
    (o.frame as usize).is_multiple_of(every)
}
