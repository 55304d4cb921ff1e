//! What a motion promises: the covariance of the estimates, from the information of every frame.
//!
//! The Fisher information of a frame is JᵀΣ⁻¹J with the estimator's own sheet residual, at the point where the seam is
//! expected, and Σ of feature, robot and stamp. Robot noise counts as the estimator leaves it, after its local fit.

use crate::cell::Cell;
use crate::criterion::SensorCovariance;
use crate::motion::Motion;
use nalgebra::{DMatrix, Matrix2, Matrix2x3, Point3, SMatrix, Vector3};
use trueline_dataset::Sensor;
use trueline_geometry::{Line, Pose, smooth, so3};
use trueline_lsq::Information;
use trueline_method::assess::observability::RANK_THRESHOLD;
use trueline_method::input::noise_levels::{NoiseLevels, Whitener};
use trueline_method::problem::parameters::LINES;
use trueline_model::{LaserSheet, Placement, ResidualJacobian, sheet_residual};

/// Unknowns of a scan of one line.
pub const UNKNOWNS: usize = LINES + Line::DIMENSION;

/// Information about all unknowns.
pub type FrameInformation = SMatrix<f64, UNKNOWNS, UNKNOWNS>;

/// Standard deviations that a scan promises.
#[derive(Clone, Debug, PartialEq)]
pub struct Prediction {
    /// Covariance of time offset and hand-eye, in the order and units of [`trueline_method::problem::parameters`].
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

/// What a cell really is, as far as it is not known: hand-eye transform and line.
#[derive(Clone, Copy, Debug)]
pub struct Truth {
    /// Hand-eye transform.
    pub tool_from_camera: Pose,
    /// The line, anchored in the middle of the seam.
    pub line: Line,
}

impl Truth {
    /// As the guess has it; `None` if both ends of the seam are one point.
    #[must_use]
    pub fn guessed(cell: &Cell) -> Option<Self> {
        Some(Self { tool_from_camera: cell.tool_from_camera, line: cell.seam.line()? })
    }
}

/// One frame: where the seam is seen, and what that depends on.
#[derive(Clone, Debug)]
pub struct Sight {
    /// Where the sensor is and how it moves.
    pub placement: Placement,
    /// The point of the seam in the camera, m.
    pub point_in_camera: Vector3<f64>,
    /// Jacobian of the sheet residual there, the line anchored at the point itself.
    pub jacobian: ResidualJacobian,
    /// What carries displacements in base onto the sheet.
    onto_sheet: Matrix2x3<f64>,
    /// Distance of the point from the line's anchor, along it, m.
    along_m: f64,
}

impl Sight {
    /// What a frame sees that is exposed at a time, s; `None` if the seam runs along the sheet.
    #[must_use]
    pub fn of(cell: &Cell, motion: &Motion, truth: &Truth, time_s: f64) -> Option<Self> {
        let placement = motion.placement(time_s, &truth.tool_from_camera);
        let point_in_camera = met(&cell.sheet, &placement, &truth.line)?;
        let point_in_base = placement.point_in_base(&point_in_camera);
        // Turns of the line about its anchor leave the point alone if the anchor is there.
        let line = truth.line.anchored_near(&point_in_base);
        let (jacobian, onto_sheet) =
            sheet_residual::linearize(&placement, &cell.sheet, &point_in_camera, &line)?;
        let along_m = truth.line.direction().dot(&(point_in_base - truth.line.anchor()));
        Some(Self { placement, point_in_camera, jacobian, onto_sheet, along_m })
    }

    /// What the frame tells; `None` if the seam is not in view.
    #[must_use]
    pub fn information(&self, cell: &Cell, left: &NoiseLeft) -> Option<FrameInformation> {
        let feature = feature_covariance(cell, &self.point_in_camera)?;
        let Placement { base_from_tool, tool_from_camera, .. } = &self.placement;
        let in_tool = tool_from_camera.rotation * self.point_in_camera + tool_from_camera.translation.vector;
        let turned = self.onto_sheet * so3::hat(&(base_from_tool.rotation * in_tool)) * left.robot_rad;
        let packed = |m: Matrix2<f64>| [m[(0, 0)], m[(0, 1)], m[(1, 1)]];
        let own = packed(feature + turned * turned.transpose());
        let covariance = left.levels.covariance(own, &self.onto_sheet, &self.jacobian.d_time_offset);
        let whitened = Whitener::of(&covariance)?.matrix() * self.columns();
        Some(whitened.transpose() * whitened)
    }

    /// All columns, the line turned about its own anchor: a turn about u₂ moves the point by −along · u₃, one about u₃ by
    /// along · u₂.
    fn columns(&self) -> SMatrix<f64, 2, UNKNOWNS> {
        let j = &self.jacobian;
        let mut columns = SMatrix::<f64, 2, UNKNOWNS>::zeros();
        columns.fixed_columns_mut::<1>(0).copy_from(&j.d_time_offset);
        columns.fixed_columns_mut::<3>(1).copy_from(&j.d_rotation);
        columns.fixed_columns_mut::<3>(4).copy_from(&j.d_translation);
        columns.fixed_columns_mut::<4>(LINES).copy_from(&j.d_line);
        let (shift_2, shift_3) = (j.d_line.column(2), j.d_line.column(3));
        columns.set_column(LINES, &(shift_3 * -self.along_m));
        columns.set_column(LINES + 1, &(shift_2 * self.along_m));
        columns
    }
}

/// Where the line meets the sheet, in the camera, m.
fn met(sheet: &LaserSheet, placement: &Placement, line: &Line) -> Option<Vector3<f64>> {
    let camera_from_base = placement.base_from_camera().inverse();
    let start = (camera_from_base * Point3::from(*line.anchor())).coords;
    let direction = camera_from_base.rotation * line.direction();
    let toward = sheet.plane().normal().dot(&direction);
    let away = sheet.plane().offset() - sheet.plane().normal().dot(&start);
    (toward.abs() > sheet_residual::MIN_SINE).then(|| start + direction * (away / toward))
}

/// Noise as the estimator leaves it, after its local fit of the robot's path.
#[derive(Clone, Copy, Debug)]
pub struct NoiseLeft {
    levels: NoiseLevels,
    robot_rad: f64,
}

impl NoiseLeft {
    /// What is left of a cell's noise.
    #[must_use]
    pub fn of(cell: &Cell) -> Self {
        let left = smooth::noise_left(cell.robot_period_s);
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

fn axes(sheet: &LaserSheet) -> Matrix2x3<f64> {
    sheet.axes().transpose()
}

/// When the frames of a scan are exposed, every `stride`-th of them: the first half a period after the start.
pub fn exposures(cell: &Cell, duration_s: f64, stride: usize) -> impl Iterator<Item = f64> {
    let period_s = cell.frame_period_s;
    let count = (duration_s / period_s - 0.5).floor().max(0.0) as usize;
    (0..count).step_by(stride.max(1)).map(move |k| (k as f64 + 0.5) * period_s)
}

/// What sights promise together, each standing for so many frames; `None` if the seam is lost on the way.
#[must_use]
pub fn predict(cell: &Cell, sights: &[Sight], stride: usize) -> Option<Prediction> {
    let left = NoiseLeft::of(cell);
    let mut sum = FrameInformation::zeros();
    for sight in sights {
        sum += sight.information(cell, &left)?;
    }
    Prediction::of(&(sum * stride as f64))
}

/// Every `stride`-th frame of a motion; `None` if the seam runs along the sheet somewhere.
#[must_use]
pub fn sights(cell: &Cell, motion: &Motion, truth: &Truth, stride: usize) -> Option<Vec<Sight>> {
    exposures(cell, motion.design().duration_s, stride)
        .map(|time_s| Sight::of(cell, motion, truth, time_s))
        .collect()
}

/// The prediction as the scan goes on: time (s) and what is known until then, at so many times.
#[must_use]
pub fn over_time(cell: &Cell, motion: &Motion, times: usize) -> Vec<(f64, Prediction)> {
    let Some(truth) = Truth::guessed(cell) else { return Vec::new() };
    let left = NoiseLeft::of(cell);
    let all: Vec<f64> = exposures(cell, motion.design().duration_s, 1).collect();
    let every = all.len().div_ceil(times).max(1);
    let mut sum = FrameInformation::zeros();
    let mut known = Vec::new();
    for (k, time_s) in all.iter().enumerate() {
        let sight = Sight::of(cell, motion, &truth, *time_s);
        sum += sight.and_then(|s| s.information(cell, &left)).unwrap_or_else(FrameInformation::zeros);
        if (k + 1) % every == 0 || k + 1 == all.len() {
            known.extend(Prediction::of(&sum).map(|p| (*time_s, p)));
        }
    }
    known
}

/// Guesses that [`wrong_guesses`] tries.
const GUESSES: u64 = 40;

/// Standard deviations of the same motion where the guess is wrong, by anything within its error: of each component the
/// one that 95 % of such cells stay below. A cell in which the seam leaves the view counts as knowing nothing.
#[must_use]
pub fn wrong_guesses(cell: &Cell, motion: &Motion) -> [f64; LINES] {
    let stride = (exposures(cell, motion.design().duration_s, 1).count() / 200).max(1);
    let sigmas: Vec<[f64; LINES]> = (0..GUESSES)
        .map(|seed| {
            let (tool_from_camera, seam) =
                cell.guess_error.disturbed(&cell.tool_from_camera, &cell.seam, seed);
            let prediction = seam
                .line()
                .map(|line| Truth { tool_from_camera, line })
                .and_then(|truth| sights(cell, motion, &truth, stride))
                .and_then(|sights| predict(cell, &sights, stride))
                .filter(Prediction::shows_all);
            std::array::from_fn(|k| prediction.as_ref().map_or(f64::INFINITY, |p| p.sigma(k)))
        })
        .collect();
    std::array::from_fn(|k| {
        let mut of_one: Vec<f64> = sigmas.iter().map(|s| s[k]).collect();
        of_one.sort_by(f64::total_cmp);
        of_one[(0.95 * (GUESSES - 1) as f64).round() as usize]
    })
}
