//! Effect of systematic errors on the plates' estimate: the columns of [`Systematic`] in the tangent of the plates.

use crate::assess::levels::SystematicLevels;
use crate::assess::robot_field::RobotField;
use crate::assess::systematic::{BiasError, Systematic};
use crate::assess::tilt_bias::{BIAS, TiltBias};
use crate::problem::layout::Layout;
use crate::stripe::fit::StripeFit;
use crate::stripe::frame_residual::{EDGE_ROW, FrameGradients, FrameResidual, ROWS, linearize_frame};
use crate::stripe::frames::{Sight, StripeFrame};
use crate::stripe::state::StripeState;
use crate::stripe::unknowns::{LOCAL_ALL, LOCAL_SHAPE, StripeUnknowns};
use crate::stripe::weighed_frame::WeighedFrame;
use crate::thinning::stride;
use nalgebra::{DMatrix, SMatrix};
use trueline_lsq::Information;
use trueline_model::{Placement, SheetShape};

/// Errors that seam points and plates share. The columns of both estimates belong to the same errors, one by one.
pub struct SharedErrors<'a> {
    /// Their assumed levels.
    pub levels: SystematicLevels,
    /// The robot's; `None` for an ideal robot.
    pub field: Option<&'a RobotField>,
    /// The tilt convention of the detector's bias.
    pub tilt: TiltBias,
    /// Uncertainty of the removed bias.
    pub bias: BiasError,
}

/// Maximum number of frames evaluated. Beyond it every n-th frame is used.
pub(crate) const MOST_FRAMES: usize = 800;

/// Effect of each kind of error on the estimate.
#[must_use]
pub(crate) fn systematic(
    fit: &StripeFit<'_>,
    information: &Information,
    shared: &SharedErrors<'_>,
) -> Systematic {
    let SharedErrors { levels, field, tilt, bias: bias_error } = shared;
    let (problem, root) = (&fit.problem, information.covariance_root());
    let every = stride(problem.frames.len(), MOST_FRAMES);
    let at = with_shape(fit);
    let seen: Vec<(&WeighedFrame, Placement)> = problem
        .frames
        .iter()
        .step_by(every)
        .filter_map(|weighed| Some((weighed, weighed.placement(problem.observations, &at)?)))
        .collect();
    let zeros = |columns: usize| Moved::zeros(&problem.unknowns, columns);
    let mut robot = zeros(6 * field.map_or(0, RobotField::modes));
    let (mut shape, mut bias) = (zeros(5), zeros(BIAS));
    for (weighed, placement) in &seen {
        let linearized = linearize_frame(problem.observations, &weighed.frame, &at, placement);
        let Some((parts, gradients)) = linearized else { continue };
        let gradients = gradients * weighed.whitener.transpose();
        let joint = weighed.frame.joint;
        if levels.held_shape.is_some() {
            let columns = gradients.fixed_rows::<5>(LOCAL_SHAPE).transpose();
            shape.add(joint, &gradients, &DMatrix::from_column_slice(ROWS, 5, columns.as_slice()));
        }
        if levels.feature_bias_px > 0.0 {
            let in_sensor = tilt.in_sensor(&at.tool_from_camera, placement);
            let by_px = by_px(&weighed.frame, &parts);
            let mut columns = DMatrix::zeros(ROWS, BIAS);
            for axis in 0..3 {
                let moved = weighed.whitener * by_px * (in_sensor[axis]);
                columns.view_mut((0, 2 * axis), (ROWS, 2)).copy_from(&moved);
            }
            bias.add(joint, &gradients, &columns);
        }
        if let Some(field) = field {
            robot.add(joint, &gradients, &robot_columns(field, weighed, &parts, placement));
        }
    }
    let sum = |moved: &Moved| moved.over_all(&problem.unknowns) * every as f64;
    let moved = |sum: &DMatrix<f64>| -(root * (root.transpose() * sum));
    let held = levels.held_shape.and_then(|covariance| covariance.cholesky()).map(|c| c.l());
    let held = held.map_or_else(|| DMatrix::zeros(5, 0), |l| DMatrix::from_column_slice(5, 5, l.as_slice()));
    let by_bias = moved(&sum(&bias));
    Systematic {
        robot: moved(&sum(&robot)) - &by_bias * &bias_error.robot,
        sensor: moved(&(sum(&shape) * &held)) - &by_bias * &bias_error.sensor,
        sensor_shape: held,
        feature_bias: -by_bias * &bias_error.own,
        held: DMatrix::zeros(root.nrows(), 0),
        form: DMatrix::zeros(root.nrows(), 0),
    }
}

/// Whitened effect of the robot-error modes on the residuals of a frame: three columns of position and three of attitude each.
pub(crate) fn robot_columns(
    field: &RobotField,
    weighed: &WeighedFrame,
    parts: &FrameResidual,
    placement: &Placement,
) -> DMatrix<f64> {
    let position = weighed.whitener * parts.d_displacement * field.sigmas.position_m;
    let attitude = weighed.whitener * parts.d_turn * field.sigmas.attitude_rad;
    let mut columns = DMatrix::zeros(ROWS, 6 * field.modes());
    for (k, amplitude) in field.at(&placement.base_from_tool).iter().enumerate() {
        columns.view_mut((0, 6 * k), (ROWS, 3)).copy_from(&(position * *amplitude));
        columns.view_mut((0, 6 * k + 3), (ROWS, 3)).copy_from(&(attitude * *amplitude));
    }
    columns
}

/// The optimum with a shape, for derivatives by it.
pub(crate) fn with_shape(fit: &StripeFit<'_>) -> StripeState {
    let mut at = fit.state().clone();
    let origin = fit.problem.observations.shape_origin_m.into();
    at.shape = at.shape.or(Some(SheetShape::exact_about(&origin)));
    at
}

/// Derivative of each residual by a pixel along the image's rows and across them, m.
fn by_px(frame: &StripeFrame, parts: &FrameResidual) -> SMatrix<f64, ROWS, 2> {
    let mut moved = SMatrix::<f64, ROWS, 2>::zeros();
    let mut set = |row: usize, sheet_per_px: &SMatrix<f64, 2, 2>| {
        moved.set_row(row, &(parts.d_reported.row(row) * sheet_per_px));
    };
    match &frame.sight {
        Sight::Seam(seam) => (0..2).for_each(|row| set(row, &seam.sheet_per_px)),
        Sight::Stripes(stripes) => {
            for (plate, supports) in stripes.iter().enumerate() {
                supports.iter().flatten().enumerate().for_each(|(k, s)| set(2 * plate + k, &s.sheet_per_px));
            }
            if let Some(edge) = frame.edge.filter(|_| parts.has_edge) {
                set(EDGE_ROW, &edge.sheet_per_px);
            }
        }
    }
    moved
}

/// Σ Jᵀ W Z over frames, by joint, over local unknowns.
pub(crate) struct Moved {
    joints: Vec<DMatrix<f64>>,
}

impl Moved {
    pub(crate) fn zeros(unknowns: &StripeUnknowns, columns: usize) -> Self {
        Self { joints: vec![DMatrix::zeros(LOCAL_ALL, columns); unknowns.joints] }
    }

    /// Adds a frame: whitened gradients, and Z whitened.
    pub(crate) fn add(&mut self, joint: usize, gradients: &FrameGradients, columns: &DMatrix<f64>) {
        self.joints[joint].gemm(1.0, gradients, columns, 1.0);
    }

    /// Over all unknowns.
    pub(crate) fn over_all(&self, unknowns: &StripeUnknowns) -> DMatrix<f64> {
        let columns = self.joints.first().map_or(0, DMatrix::ncols);
        let mut all = DMatrix::zeros(unknowns.dimension(), columns);
        for (joint, sum) in self.joints.iter().enumerate() {
            unknowns.add_rows(joint, sum, &mut all);
        }
        all
    }
}
