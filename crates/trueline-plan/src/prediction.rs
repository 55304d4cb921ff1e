//! What a motion promises: the covariance of the estimates, from the information of every frame.
//!
//! The Fisher information of a frame is JᵀΣ⁻¹J with the estimator's own sheet residual, at the point where the seam is
//! expected, and Σ of feature, robot and stamp. Robot noise counts as the estimator leaves it, after its local fit. As in the
//! estimator the seam may bow; a frame counts as often as it is seen in cells where the guess is wrong.

use crate::cell::Cell;
use crate::criterion::SensorCovariance;
use crate::motion::Motion;
use crate::truth::Truth;
use crate::wrong_cells::WrongCells;
use nalgebra::{DMatrix, Matrix2, Matrix2x3, Point3, SMatrix, Vector2, Vector3};
use trueline_dataset::Sensor;
use trueline_geometry::{smooth, so3};
use trueline_lsq::Information;
use trueline_method::assess::observability::RANK_THRESHOLD;
use trueline_method::input::noise_levels::{NoiseLevels, Whitener};
use trueline_method::problem::parameters::LINES;
use trueline_method::problem::unknowns::{LOCAL_ALL, LOCAL_BOWED, LOCAL_STRAIGHT};
use trueline_model::sheet_residual::{self, SeamInSheet};
use trueline_model::{Camera, Curvature, LaserSheet, Placement, SheetShape};

/// What a scan of one line is asked for: time offset, hand-eye and line.
pub const UNKNOWNS: usize = LOCAL_STRAIGHT;

/// Information about all unknowns that an observation can depend on: also bow and shape.
pub type FrameInformation = SMatrix<f64, LOCAL_ALL, LOCAL_ALL>;

/// Standard deviations that a scan promises.
#[derive(Clone, Debug, PartialEq)]
pub struct Prediction {
    /// Covariance of time offset and hand-eye, in the order and units of [`trueline_method::problem::parameters`].
    pub covariance: SensorCovariance,
    /// Directions that the scan shows, of [`UNKNOWNS`].
    pub rank: usize,
}

impl Prediction {
    /// The prediction of a whole information, the sensor taken for exact; `None` if it is not finite.
    #[must_use]
    pub fn of(told: &Told) -> Option<Self> {
        let bowed = told.bowed();
        let hessian = DMatrix::from_column_slice(LOCAL_BOWED, LOCAL_BOWED, bowed.as_slice());
        let known = LOCAL_STRAIGHT..LOCAL_BOWED;
        let analysed = Information::beside(&hessian, &[], known.clone(), RANK_THRESHOLD)?;
        let covariance = analysed.covariance().fixed_view::<LINES, LINES>(0, 0).into_owned();
        // The bow is known beforehand, and so always counts as shown.
        Some(Self { covariance, rank: analysed.rank() - known.len() })
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

/// What frames tell together, and what is known of the bow beforehand.
#[derive(Clone, Copy, Debug)]
pub struct Told {
    information: FrameInformation,
    bow_sigma_m: f64,
}

impl Told {
    /// Information about all but the shape, with what is known of the bow.
    fn bowed(&self) -> SMatrix<f64, LOCAL_BOWED, LOCAL_BOWED> {
        let mut bowed = self.information.fixed_view::<LOCAL_BOWED, LOCAL_BOWED>(0, 0).into_owned();
        for k in LOCAL_STRAIGHT..LOCAL_BOWED {
            bowed[(k, k)] += self.bow_sigma_m.powi(-2);
        }
        bowed
    }

    /// The covariance in a hurry; `None` if something is not shown at all.
    #[must_use]
    pub fn covariance(&self) -> Option<SensorCovariance> {
        let bowed = self.bowed();
        let scale = bowed.diagonal().map(|d| 1.0 / d.max(f64::MIN_POSITIVE).sqrt());
        let scaled =
            SMatrix::<f64, LOCAL_BOWED, LOCAL_BOWED>::from_fn(|i, j| bowed[(i, j)] * scale[i] * scale[j]);
        let inverse = scaled.cholesky()?.inverse();
        Some(SensorCovariance::from_fn(|i, j| inverse[(i, j)] * scale[i] * scale[j]))
    }
}

/// One frame: where the seam is seen, and what that depends on.
#[derive(Clone, Debug)]
pub struct Sight {
    /// When it is exposed, s.
    pub time_s: f64,
    /// Where the sensor is and how it moves.
    pub placement: Placement,
    /// The point of the seam in the camera, m.
    pub point_in_camera: Vector3<f64>,
    /// Derivatives of the sheet residual by all unknowns.
    columns: SMatrix<f64, 2, LOCAL_ALL>,
    /// What carries displacements in base onto the sheet.
    onto_sheet: Matrix2x3<f64>,
}

/// The frames of a scan.
#[derive(Clone, Debug)]
pub struct Sights {
    /// Each.
    pub list: Vec<Sight>,
    /// Frames that each stands for.
    stride: usize,
    bow_sigma_m: f64,
}

impl Sights {
    /// Every `stride`-th frame of a motion; `None` if the seam runs along the sheet somewhere.
    #[must_use]
    pub fn of(cell: &Cell, motion: &Motion, truth: &Truth, stride: usize) -> Option<Self> {
        let step_s = stride.max(1) as f64 * cell.frame_period_s;
        let met: Vec<Met> = motion
            .placements(exposures(cell, motion, stride), step_s, &truth.tool_from_camera)
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
        let list = met.into_iter().map(|met| met.seen(&cell.sheet, &seam)).collect::<Option<_>>()?;
        Some(Self { list, stride, bow_sigma_m: curvature.prior_sigma_m() })
    }

    /// What they tell, each with its weight; a frame that no camera has tells nothing.
    #[must_use]
    pub fn told(&self, cell: &Cell, weights: impl Iterator<Item = f64>) -> Told {
        let left = NoiseLeft::of(cell);
        let mut information = FrameInformation::zeros();
        for (sight, weight) in self.list.iter().zip(weights).filter(|(_, weight)| *weight > 0.0) {
            if let Some(whitened) = sight.whitened(cell, &left) {
                information += whitened.transpose() * whitened * weight;
            }
        }
        Told { information: information * self.stride as f64, bow_sigma_m: self.bow_sigma_m }
    }

    /// Frames that each stands for.
    pub(crate) fn stride(&self) -> usize {
        self.stride
    }

    /// Standard deviation of the bow as it is known beforehand, m.
    pub(crate) fn bow_sigma_m(&self) -> f64 {
        self.bow_sigma_m
    }
}

/// Below this the estimator believes in no bow either; half of it, m.
const LEAST_HALF_LENGTH_M: f64 = 5e-3;

/// Where a line meets the sheet.
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

    fn seen(self, sheet: &LaserSheet, seam: &SeamInSheet<'_>) -> Option<Sight> {
        let found = seam.linearize(&self.placement, sheet, &self.point_in_camera)?;
        let mut columns = SMatrix::<f64, 2, LOCAL_ALL>::zeros();
        columns.fixed_columns_mut::<1>(0).copy_from(&found.straight.d_time_offset);
        columns.fixed_columns_mut::<3>(1).copy_from(&found.straight.d_rotation);
        columns.fixed_columns_mut::<3>(4).copy_from(&found.straight.d_translation);
        columns.fixed_columns_mut::<4>(LINES).copy_from(&found.straight.d_line);
        columns.fixed_columns_mut::<2>(LOCAL_STRAIGHT).copy_from(&found.d_curvature);
        columns.fixed_columns_mut::<5>(LOCAL_BOWED).copy_from(&found.d_shape);
        let Self { time_s, placement, point_in_camera, .. } = self;
        Some(Sight { time_s, placement, point_in_camera, columns, onto_sheet: found.onto_sheet })
    }
}

impl Sight {
    /// The whitened derivatives; `None` if no camera sees the point.
    fn whitened(&self, cell: &Cell, left: &NoiseLeft) -> Option<SMatrix<f64, 2, LOCAL_ALL>> {
        Some(self.whitener(cell, left)?.0 * self.columns)
    }

    /// What whitens its residual, and how far a pixel is in the sheet, m; `None` if no camera sees the point.
    pub(crate) fn whitener(&self, cell: &Cell, left: &NoiseLeft) -> Option<(Matrix2<f64>, Matrix2<f64>)> {
        let sheet_per_px = sheet_per_px(cell, &self.point_in_camera)?;
        let feature = sheet_per_px * sheet_per_px.transpose() * feature_px(cell).powi(2);
        let Placement { base_from_tool, tool_from_camera, .. } = &self.placement;
        let in_tool = tool_from_camera.rotation * self.point_in_camera + tool_from_camera.translation.vector;
        let turned = self.onto_sheet * so3::hat(&(base_from_tool.rotation * in_tool)) * left.robot_rad;
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

    /// What carries displacements in base onto the sheet.
    pub(crate) fn onto_sheet(&self) -> &Matrix2x3<f64> {
        &self.onto_sheet
    }
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

/// Noise of a feature that a pixel is compared with where features are lengths, px: as the estimator has it.
const USUAL_SIGMA_PX: f64 = 0.3;

/// Noise of a feature, px.
fn feature_px(cell: &Cell) -> f64 {
    match &cell.sensor {
        Sensor::CameraLaser { .. } => cell.noise.feature_px,
        Sensor::Profiler | Sensor::Points { .. } => USUAL_SIGMA_PX,
    }
}

/// How far a pixel is in the sheet, m; `None` if no camera sees the point.
fn sheet_per_px(cell: &Cell, point_in_camera: &Vector3<f64>) -> Option<Matrix2<f64>> {
    match &cell.sensor {
        Sensor::CameraLaser { camera, .. } => {
            let sheet_from_pixel =
                (d_pixel_d_point(camera, point_in_camera) * cell.sheet.axes()).try_inverse()?;
            (point_in_camera.z > 0.0).then_some(sheet_from_pixel)
        }
        Sensor::Profiler | Sensor::Points { .. } => {
            Some(Matrix2::identity() * (cell.noise.feature_m / USUAL_SIGMA_PX))
        }
    }
}

/// How a point's pixel moves with it, px/m.
fn d_pixel_d_point(camera: &Camera, point: &Vector3<f64>) -> Matrix2x3<f64> {
    let ideal = point.xy() / point.z;
    let d_ideal = Matrix2x3::new(1.0, 0.0, -ideal.x, 0.0, 1.0, -ideal.y) / point.z;
    Matrix2::from_diagonal(&camera.focal) * camera.distortion.distort(&ideal).1 * d_ideal
}

/// When the frames of a scan are exposed, every `stride`-th of them: the first half a period after the start. While the sensor is spun
/// between two passes none counts.
pub fn exposures(cell: &Cell, motion: &Motion, stride: usize) -> impl Iterator<Item = f64> {
    let period_s = cell.frame_period_s;
    let count = (motion.design().duration_s / period_s - 0.5).floor().max(0.0) as usize;
    let [from_s, to_s] = motion.spun_s();
    let all = (0..count).map(move |k| (k as f64 + 0.5) * period_s);
    all.filter(move |time_s| !(from_s..to_s).contains(time_s)).step_by(stride.max(1))
}

/// The prediction as the scan goes on: time (s) and what is known until then, at so many times; `seen_by` is the share of cells
/// that see each frame.
#[must_use]
pub fn over_time(cell: &Cell, motion: &Motion, seen_by: &[f64], times: usize) -> Vec<(f64, Prediction)> {
    let sights = Truth::guessed(cell).and_then(|truth| Sights::of(cell, motion, &truth, 1));
    let Some(sights) = sights else { return Vec::new() };
    let every = sights.list.len().div_ceil(times).max(1);
    let ends = (1..=sights.list.len()).filter(|n| n % every == 0 || *n == sights.list.len());
    ends.filter_map(|n| {
        let until = seen_by.iter().enumerate().map(|(k, share)| if k < n { *share } else { 0.0 });
        Some((sights.list[n - 1].time_s, Prediction::of(&sights.told(cell, until))?))
    })
    .collect()
}

/// Standard deviations of the same motion where the guess is wrong, by anything within its error: of each component the
/// one that 95 % of such cells stay below.
#[must_use]
pub fn wrong_guesses(cell: &Cell, motion: &Motion) -> [f64; LINES] {
    let stride = (exposures(cell, motion, 1).count() / 200).max(1);
    let sigmas: Vec<[f64; LINES]> = WrongCells::for_wrong_guesses(cell)
        .iter()
        .map(|wrong| {
            let prediction = wrong
                .truth()
                .and_then(|truth| Sights::of(cell, motion, &truth, stride))
                .and_then(|sights| {
                    let seen = sights.list.iter().map(|s| wrong.sees(cell, &s.placement.base_from_tool));
                    Prediction::of(&sights.told(cell, seen.map(|seen| f64::from(u8::from(seen)))))
                })
                .filter(Prediction::shows_all);
            std::array::from_fn(|k| prediction.as_ref().map_or(f64::INFINITY, |p| p.sigma(k)))
        })
        .collect();
    std::array::from_fn(|k| {
        let mut of_one: Vec<f64> = sigmas.iter().map(|s| s[k]).collect();
        of_one.sort_by(f64::total_cmp);
        of_one[(0.95 * (of_one.len() - 1) as f64).round() as usize]
    })
}
