//! The frames of a scan: pose of the sensor, place of the seam, and their derivatives.

use crate::cell::Cell;
use crate::cell_axis::CellAxis;
use crate::motion::Motion;
use crate::truth::Truth;
use nalgebra::{Matrix2, Matrix2x3, Matrix2xX, Matrix3xX, Point3, SMatrix, Vector2, Vector3};
use trueline_dataset::axes::ranges;
use trueline_dataset::{AxisRecord, Sensor};
use trueline_geometry::smooth;
use trueline_method::Config;
use trueline_method::axes::finding;
use trueline_method::input::axis_chain::AxisChain;
use trueline_method::input::noise_levels::{NoiseLevels, Whitener};
use trueline_method::problem::parameters::LINES;
use trueline_method::problem::unknowns::{LOCAL_ALL, LOCAL_BOWED, LOCAL_STRAIGHT};
use trueline_model::sheet_residual::{self, SeamInSheet};
use trueline_model::{Camera, Curvature, LaserSheet, Placement, SheetShape};

/// One frame: the place of the seam, and its derivatives.
#[derive(Clone, Debug)]
pub struct PredictedFrame {
    /// When it is exposed, s.
    pub time_s: f64,
    /// Pose and motion of the sensor, in axes that turn with a curved seam.
    pub placement: Placement,
    /// Place along the seam from its middle, m.
    pub along_m: f64,
    /// The point of the seam in the camera, m.
    pub point_in_camera: Vector3<f64>,
    /// Derivatives of the sheet residual by all unknowns.
    columns: SMatrix<f64, 2, LOCAL_ALL>,
    /// Map of displacements in base onto the sheet.
    onto_sheet: Matrix2x3<f64>,
    /// The same for turns about the tool.
    by_turn: Matrix2x3<f64>,
    /// Derivatives of the measured point by the numbers of the external axes, axes of base; no columns without axes.
    by_axes: Matrix3xX<f64>,
}

/// The frames of a scan.
#[derive(Clone, Debug)]
pub struct PredictedFrames {
    /// Each.
    pub list: Vec<PredictedFrame>,
    /// Number of frames that each represents.
    stride: usize,
    bow_sigma_m: f64,
    /// The middle of the scanned part of the line, m from its anchor.
    middle_m: f64,
    /// The middle of the seen points, sheet coordinates, m.
    origin: Vector2<f64>,
    /// Prior standard deviations of the numbers of the external axes, SI.
    axis_sigmas: Vec<f64>,
}

impl PredictedFrames {
    /// Every `stride`-th frame of a motion; `None` if the seam runs along the sheet somewhere.
    #[must_use]
    pub fn of(cell: &Cell, motion: &Motion, truth: &Truth, stride: usize) -> Option<Self> {
        let step_s = stride.max(1) as f64 * cell.frame_period_s;
        let met: Vec<Met> = motion
            .placements(exposures(cell, motion, stride), step_s, truth)
            .map(|(time_s, placement)| Met::at(cell, truth, time_s, placement))
            .collect::<Option<_>>()?;
        let (low, high) = met.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), m| {
            (low.min(m.along_m), high.max(m.along_m))
        });
        let curvature = Curvature {
            bow_m: [0.0; 2],
            half_length_m: (0.5 * (high - low)).max(LEAST_HALF_LENGTH_M),
            middle_m: 0.5 * (low + high),
        };
        let places = met.iter().map(|m| cell.sheet.coordinates(&m.point_in_camera));
        let origin = places.sum::<Vector2<f64>>() / met.len().max(1) as f64;
        let shape = SheetShape::exact_about(&origin);
        let seam = SeamInSheet { line: &truth.line, curvature: &curvature, shape: Some(&shape) };
        let axes = motion.axes_at(truth);
        let list =
            met.into_iter().map(|met| met.seen(&cell.sheet, &seam, axes.as_ref())).collect::<Option<_>>()?;
        Some(Self {
            list,
            stride,
            bow_sigma_m: curvature.prior_sigma_m(),
            middle_m: curvature.middle_m,
            origin,
            axis_sigmas: axis_sigmas(cell, motion),
        })
    }

    /// One of this many of them, which represents the others.
    pub(crate) fn thinned(mut self, every: usize) -> Self {
        if every > 1 {
            self.list = self.list.into_iter().step_by(every).collect();
            self.stride *= every;
        }
        self
    }

    /// Prior standard deviations of the numbers of the external axes, SI.
    pub(crate) fn axis_sigmas(&self) -> &[f64] {
        &self.axis_sigmas
    }

    /// Number of frames that each represents.
    pub(crate) fn stride(&self) -> usize {
        self.stride
    }

    /// The middle of the scanned part of the line, m from its anchor.
    pub(crate) fn middle_m(&self) -> f64 {
        self.middle_m
    }

    /// The middle of the seen points, in the sheet, m: origin of the sensor's shape.
    pub(crate) fn origin(&self) -> &Vector2<f64> {
        &self.origin
    }

    /// Prior standard deviation of the bow, m.
    pub(crate) fn bow_sigma_m(&self) -> f64 {
        self.bow_sigma_m
    }
}

/// Prior standard deviations of the numbers of a cell's axes in a motion, SI.
fn axis_sigmas(cell: &Cell, motion: &Motion) -> Vec<f64> {
    let of = |(axis, record): (&CellAxis, &AxisRecord)| {
        let moves = record.moves_by(ranges(std::slice::from_ref(record), None)[0]);
        finding::sigmas_of(&axis.record, moves)
    };
    let records = motion.axis_records(cell, cell.frame_period_s, 0.0);
    cell.axes.iter().zip(&records).flat_map(of).collect()
}

/// Below this the estimator believes in no bow either; half of it, m.
const LEAST_HALF_LENGTH_M: f64 = 5e-3;

/// Crossing of a line with the sheet.
struct Met {
    time_s: f64,
    placement: Placement,
    point_in_camera: Vector3<f64>,
    /// Along the line from its anchor, m.
    along_m: f64,
}

impl Met {
    fn at(cell: &Cell, truth: &Truth, time_s: f64, placement: Placement) -> Option<Self> {
        let camera_from_base = placement.base_from_camera().inverse();
        let start = (camera_from_base * Point3::from(*truth.line.anchor())).coords;
        let direction = camera_from_base.rotation * truth.line.direction();
        let plane = cell.sheet.plane();
        let toward = plane.normal().dot(&direction);
        let along_m = (plane.offset() - plane.normal().dot(&start)) / toward;
        (toward.abs() > sheet_residual::MIN_SINE).then(|| Self {
            time_s,
            placement,
            point_in_camera: start + direction * along_m,
            along_m,
        })
    }

    fn seen(
        self,
        sheet: &LaserSheet,
        seam: &SeamInSheet<'_>,
        axes: Option<&AxisChain>,
    ) -> Option<PredictedFrame> {
        let found = seam.linearize(&self.placement, sheet, &self.point_in_camera)?;
        let mut columns = SMatrix::<f64, 2, LOCAL_ALL>::zeros();
        columns.fixed_columns_mut::<LINES>(0).copy_from(&found.straight.by_links(&self.placement));
        columns.fixed_columns_mut::<4>(LINES).copy_from(&found.straight.d_line);
        columns.fixed_columns_mut::<2>(LOCAL_STRAIGHT).copy_from(&found.d_curvature);
        columns.fixed_columns_mut::<5>(LOCAL_BOWED).copy_from(&found.d_shape);
        let Self { time_s, placement, point_in_camera, along_m } = self;
        let (onto_sheet, by_turn) = (found.straight.by_shift(), found.straight.by_turn());
        let point = placement.point_in_base(&point_in_camera);
        let by_axes = match axes {
            Some(axes) => axes.d_point(&placement.base_from_tool, &point, time_s)?,
            None => Matrix3xX::zeros(0),
        };
        Some(PredictedFrame {
            time_s,
            placement,
            along_m,
            point_in_camera,
            columns,
            onto_sheet,
            by_turn,
            by_axes,
        })
    }
}

impl PredictedFrame {
    /// Whitener of its residual, and the size of a pixel in the sheet, m; `None` if no camera sees the point.
    pub(crate) fn whitener(&self, cell: &Cell, left: &NoiseLeft) -> Option<(Matrix2<f64>, Matrix2<f64>)> {
        let sheet_per_px = sheet_per_px(cell, &self.point_in_camera)?;
        let feature = sheet_per_px * sheet_per_px.transpose() * feature_px(cell).powi(2);
        let turned = self.by_turn * left.robot_rad;
        let packed = |m: Matrix2<f64>| [m[(0, 0)], m[(0, 1)], m[(1, 1)]];
        let own = packed(feature + turned * turned.transpose());
        let d_time_offset: Vector2<f64> = self.columns.column(0).into();
        let covariance = left.levels.covariance(own, &self.onto_sheet, &d_time_offset);
        Some((Whitener::of(&covariance)?.matrix(), sheet_per_px))
    }

    /// Derivatives of the sheet residual by all unknowns.
    pub(crate) fn columns(&self) -> &SMatrix<f64, 2, LOCAL_ALL> {
        &self.columns
    }

    /// Derivatives of the sheet residual by the numbers of the external axes.
    pub(crate) fn by_axes(&self) -> Matrix2xX<f64> {
        self.onto_sheet * &self.by_axes
    }

    /// Map of displacements in base onto the sheet.
    pub(crate) fn onto_sheet(&self) -> &Matrix2x3<f64> {
        &self.onto_sheet
    }

    /// Derivative of the residual by a turn of the sensor about the tool, axes of base.
    pub(crate) fn by_turn(&self) -> &Matrix2x3<f64> {
        &self.by_turn
    }
}

/// Noise as the estimator leaves it, after its local fit of the robot's path.
#[derive(Clone, Copy, Debug)]
pub struct NoiseLeft {
    /// Of the robot's position and the stamp.
    pub(crate) levels: NoiseLevels,
    /// Of the robot's attitude about each axis, rad.
    pub(crate) robot_rad: f64,
}

impl NoiseLeft {
    /// Remaining noise of a cell.
    #[must_use]
    pub fn of(cell: &Cell) -> Self {
        let left = smooth::noise_left(cell.robot_period_s, smooth::HALF_WINDOW_S);
        Self {
            levels: NoiseLevels {
                robot_sigma_m: cell.noise.robot_m * left,
                stamp_sigma_s: cell.noise.stamp_s,
                factor: 1.0,
            },
            robot_rad: cell.noise.robot_rad * left,
        }
    }
}

/// The length that counts as a pixel for features in lengths, m: as in the estimator, at any noise of the cell.
fn length_per_px_m() -> f64 {
    Config::default().length_per_px_m()
}

/// Noise of a feature, px.
pub(crate) fn feature_px(cell: &Cell) -> f64 {
    match &cell.sensor {
        Sensor::CameraLaser { .. } => cell.noise.feature_px,
        Sensor::Profiler | Sensor::Points { .. } => cell.noise.feature_m / length_per_px_m(),
    }
}

/// Size of a pixel in the sheet, m; `None` if no camera sees the point.
pub(crate) fn sheet_per_px(cell: &Cell, point_in_camera: &Vector3<f64>) -> Option<Matrix2<f64>> {
    match &cell.sensor {
        Sensor::CameraLaser { camera, .. } => {
            let sheet_from_pixel =
                (d_pixel_d_point(camera, point_in_camera) * cell.sheet.axes()).try_inverse()?;
            (point_in_camera.z > 0.0).then_some(sheet_from_pixel)
        }
        Sensor::Profiler | Sensor::Points { .. } => Some(Matrix2::identity() * length_per_px_m()),
    }
}

/// Derivative of a point's pixel by the point, px/m.
fn d_pixel_d_point(camera: &Camera, point: &Vector3<f64>) -> Matrix2x3<f64> {
    let ideal = point.xy() / point.z;
    let d_ideal = Matrix2x3::new(1.0, 0.0, -ideal.x, 0.0, 1.0, -ideal.y) / point.z;
    Matrix2::from_diagonal(&camera.focal) * camera.distortion.distort(&ideal).1 * d_ideal
}

/// Exposure times of a scan's frames, every `stride`-th of them: the first half a period after the start. Frames while the sensor
/// is spun between two passes do not count.
pub fn exposures(cell: &Cell, motion: &Motion, stride: usize) -> impl Iterator<Item = f64> {
    let period_s = cell.frame_period_s;
    let count = (motion.design().duration_s / period_s - 0.5).floor().max(0.0) as usize;
    let [from_s, to_s] = motion.spun_s();
    let all = (0..count).map(move |k| (k as f64 + 0.5) * period_s);
    all.filter(move |time_s| !(from_s..to_s).contains(time_s)).step_by(stride.max(1))
}
