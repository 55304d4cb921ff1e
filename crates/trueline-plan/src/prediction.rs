//! What a motion promises: the covariance of the estimates, from the information of every frame.
//!
//! The Fisher information of a frame is JᵀΣ⁻¹J with the estimator's own sheet residual, at the point where the seam is
//! expected, and Σ of feature, robot and stamp. Robot noise counts as the estimator leaves it, after its local fit.

use crate::cell::Cell;
use crate::criterion::SensorCovariance;
use crate::motion::Motion;
use nalgebra::{DMatrix, Matrix2, SMatrix, Vector3};
use trueline::noise_levels::{NoiseLevels, Whitener};
use trueline::observability::RANK_THRESHOLD;
use trueline::parameters::LINES;
use trueline_dataset::Sensor;
use trueline_geometry::{Line, smooth, so3};
use trueline_lsq::Information;
use trueline_model::{LaserSheet, Placement, sheet_residual};

/// Unknowns of a scan of one line.
pub const UNKNOWNS: usize = LINES + Line::DIMENSION;

/// Information about all unknowns.
pub type FrameInformation = SMatrix<f64, UNKNOWNS, UNKNOWNS>;

/// Standard deviations that a scan promises.
#[derive(Clone, Debug, PartialEq)]
pub struct Prediction {
    /// Covariance of time offset and hand-eye, in the order and units of [`trueline::parameters`].
    pub covariance: SensorCovariance,
    /// Directions that the scan shows, of [`UNKNOWNS`].
    pub rank: usize,
}

impl Prediction {
    /// The prediction of a whole information; `None` if it is not finite.
    #[must_use]
    pub fn of(information: &FrameInformation) -> Option<Self> {
        let hessian = DMatrix::from_column_slice(UNKNOWNS, UNKNOWNS, information.as_slice());
        let analysed = Information::new(&hessian, &[], RANK_THRESHOLD)?;
        let covariance = analysed.covariance().fixed_view::<LINES, LINES>(0, 0).into_owned();
        Some(Self { covariance, rank: analysed.rank() })
    }

    /// Whether everything can be seen.
    #[must_use]
    pub fn shows_all(&self) -> bool {
        self.rank == UNKNOWNS
    }

    /// Standard deviation of a component.
    #[must_use]
    pub fn sigma(&self, component: usize) -> f64 {
        self.covariance[(component, component)].max(0.0).sqrt()
    }
}

/// What one frame needs beyond the motion.
pub struct Observer<'a> {
    cell: &'a Cell,
    line: Line,
    robot: NoiseLevels,
    robot_rad: f64,
}

impl<'a> Observer<'a> {
    /// An observer of the cell's seam; `None` if both ends of it are one point.
    #[must_use]
    pub fn new(cell: &'a Cell) -> Option<Self> {
        let left = smooth::noise_left(cell.robot_period_s);
        Some(Self {
            cell,
            line: cell.seam.line()?,
            robot: NoiseLevels {
                robot_sigma_m: cell.noise.robot_m * left,
                stamp_sigma_s: cell.noise.stamp_s,
                factor: 1.0,
            },
            robot_rad: cell.noise.robot_rad * left,
        })
    }

    /// Jacobian of the sheet residual where the seam is expected; `None` if the seam runs along the sheet.
    #[must_use]
    pub fn jacobian(
        &self,
        placement: &Placement,
        point_in_camera: &Vector3<f64>,
    ) -> Option<(trueline_model::ResidualJacobian, nalgebra::Matrix2x3<f64>)> {
        // Turns of the line about its anchor leave the point alone if the anchor is there.
        let line = self.line.anchored_near(&placement.point_in_base(point_in_camera));
        sheet_residual::linearize(placement, &self.cell.sheet, point_in_camera, &line)
    }

    /// Information of the frame exposed at a time, s; `None` if the seam is not seen there.
    #[must_use]
    pub fn information(&self, motion: &Motion, time_s: f64) -> Option<FrameInformation> {
        let point = motion.point_in_camera(time_s);
        let placement = motion.placement(time_s);
        let (jacobian, onto_sheet) =
            sheet_residual::linearize(&placement, &self.cell.sheet, &point, &self.line)?;
        let feature = feature_covariance(self.cell, &point)?;
        let lever = placement.base_from_tool.rotation
            * (placement.tool_from_camera.rotation * point + placement.tool_from_camera.translation.vector);
        let turned = onto_sheet * so3::hat(&lever) * self.robot_rad;
        let packed = |m: Matrix2<f64>| [m[(0, 0)], m[(0, 1)], m[(1, 1)]];
        let own = packed(feature + turned * turned.transpose());
        let covariance = self.robot.covariance(own, &onto_sheet, &jacobian.d_time_offset);
        let whitener = Whitener::of(&covariance)?.matrix();
        let mut columns = SMatrix::<f64, 2, UNKNOWNS>::zeros();
        columns.fixed_columns_mut::<1>(0).copy_from(&jacobian.d_time_offset);
        columns.fixed_columns_mut::<3>(1).copy_from(&jacobian.d_rotation);
        columns.fixed_columns_mut::<3>(4).copy_from(&jacobian.d_translation);
        columns.fixed_columns_mut::<4>(LINES).copy_from(&jacobian.d_line);
        let whitened = whitener * columns;
        Some(whitened.transpose() * whitened)
    }
}

/// Covariance of a feature in the sheet, m².
fn feature_covariance(cell: &Cell, point_in_camera: &Vector3<f64>) -> Option<Matrix2<f64>> {
    match &cell.sensor {
        Sensor::CameraLaser { camera, .. } => {
            let (_, d_ray_d_pixel) = camera.ray(&camera.project(point_in_camera)?).ok()?;
            let ray = point_in_camera / point_in_camera.z;
            let (_, d_point_d_ray) = cell.sheet.intersect(&ray)?;
            let d_sheet_d_pixel = axes(&cell.sheet) * d_point_d_ray * d_ray_d_pixel;
            Some(d_sheet_d_pixel * d_sheet_d_pixel.transpose() * cell.noise.feature_px.powi(2))
        }
        Sensor::Profiler | Sensor::Points { .. } => Some(Matrix2::identity() * cell.noise.feature_m.powi(2)),
    }
}

fn axes(sheet: &LaserSheet) -> nalgebra::Matrix2x3<f64> {
    sheet.axes().transpose()
}

/// When the frames of a scan are exposed, every `stride`-th of them: the first half a period after the start.
pub fn exposures(cell: &Cell, duration_s: f64, stride: usize) -> impl Iterator<Item = f64> {
    let period_s = cell.frame_period_s;
    let count = (duration_s / period_s - 0.5).floor().max(0.0) as usize;
    (0..count).step_by(stride.max(1)).map(move |k| (k as f64 + 0.5) * period_s)
}

/// What the whole motion promises, looking at every `stride`-th frame as if it stood for its neighbours; `None` if
/// the seam is lost on the way.
#[must_use]
pub fn predict(cell: &Cell, motion: &Motion, stride: usize) -> Option<Prediction> {
    let observer = Observer::new(cell)?;
    let mut sum = FrameInformation::zeros();
    for time_s in exposures(cell, motion.design().duration_s, stride) {
        sum += observer.information(motion, time_s)?;
    }
    Prediction::of(&(sum * stride as f64))
}

/// The prediction as the scan goes on: time (s) and what is known until then, at so many times.
#[must_use]
pub fn over_time(cell: &Cell, motion: &Motion, times: usize) -> Vec<(f64, Prediction)> {
    let Some(observer) = Observer::new(cell) else { return Vec::new() };
    let all: Vec<f64> = exposures(cell, motion.design().duration_s, 1).collect();
    let every = all.len().div_ceil(times).max(1);
    let mut sum = FrameInformation::zeros();
    let mut known = Vec::new();
    for (k, time_s) in all.iter().enumerate() {
        sum += observer.information(motion, *time_s).unwrap_or_else(FrameInformation::zeros);
        if (k + 1) % every == 0 || k + 1 == all.len() {
            known.extend(Prediction::of(&sum).map(|p| (*time_s, p)));
        }
    }
    known
}
