//! The static checkerboard: the robot stops before a board, takes a picture, and continues; hand-eye by closed forms and
//! by maximum likelihood. A stand-in for the calibration that the paper compares itself with, which cannot be identified
//! in public text.

use crate::settings::Settings;
use nalgebra::{Vector2, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha12Rng;
use rand_distr::{Distribution, StandardNormal};
use trueline_geometry::{Pose, se3, so3};
use trueline_model::{Camera, LaserSheet};
use trueline_sensor::board_hand_eye::closed_form::{ClosedForm, pairs};
use trueline_sensor::board_hand_eye::{BoardSighting, Carried, ErrorModel, RobotPath, Unknowns, joint};
use trueline_sensor::projection::project_from_board;
use trueline_sensor::{Board, FoundCorner};
use trueline_sim::{Scenario, SensorModel};

/// The paper's kind of board: small enough to fill the view at 131 mm.
const BOARD: Board = Board { columns: 10, rows: 7, square_m: 0.006 };

/// A degree, rad.
const DEGREE: f64 = std::f64::consts::PI / 180.0;

/// Noise of a corner along each axis, px.
const CORNER_SIGMA_PX: f64 = 0.1;

/// Noise of the robot's poses: that of a good robot at rest.
const NOISE: ErrorModel =
    ErrorModel { position_m: 0.03e-3, rotation_rad: 0.001 * DEGREE, stamp_s: 0.0, carries: Carried::Camera };

/// Time to move, settle and take a picture, s.
const STOP_S: f64 = 6.0;

/// A plan of the calibration: stops, and the tilt of the views, rad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StopPlan {
    /// Stops of the robot.
    pub stops: usize,
    /// Tilt, rad.
    pub tilt_rad: f64,
}

/// 8 stops of 20°, 15 of 25° and 30 of 30°.
pub(crate) const PLANS: [StopPlan; 3] = [
    StopPlan { stops: 8, tilt_rad: 20.0 * DEGREE },
    StopPlan { stops: 15, tilt_rad: 25.0 * DEGREE },
    StopPlan { stops: 30, tilt_rad: 30.0 * DEGREE },
];

impl StopPlan {
    /// Duration of the calibration, s.
    #[must_use]
    pub fn lasts_s(&self) -> f64 {
        self.stops as f64 * STOP_S
    }

    /// `camera_from_board` at a stop: tilted to every side in turn, spun, near and far.
    fn view(&self, k: usize) -> Pose {
        let around = 2.399_963 * k as f64;
        let tilt = self.tilt_rad * if k.is_multiple_of(2) { 1.0 } else { 0.7 };
        let spin = self.tilt_rad * [1.0, -1.0, 0.5, -0.5][k % 4];
        let rotation = so3::exp(&(Vector3::new(around.cos(), around.sin(), 0.0) * tilt))
            * so3::exp(&(Vector3::z() * spin));
        let depth_m = 0.131 + 0.04 * (0.618_034 * k as f64).fract();
        se3::from_parts(rotation, Vector3::z() * depth_m - rotation * BOARD.middle())
    }
}

/// Speed at which a time offset that no static board shows costs its part, m/s.
pub const MOVING_M_S: f64 = 0.05;

/// Half the field over which points are measured, across and in depth, m.
const FIELD_M: f64 = 0.030;

/// Calibrations with a plan behind each figure, for each repeat of the other experiments: they cost next to nothing.
const PER_REPEAT: u64 = 4;

/// One way to calibrate with a board at standstill.
#[derive(Clone, Debug, PartialEq)]
pub struct StaticRow {
    /// The method.
    pub method: &'static str,
    /// Stops of the robot.
    pub stops: usize,
    /// Duration, s.
    pub lasts_s: f64,
    /// Error of points that the sensor measures at standstill, in the tool frame, root mean square, m.
    pub standing_m: f64,
    /// The same while moving across its laser plane at [`MOVING_M_S`], with the time offset left out.
    pub moving_m: f64,
}

/// Name of the last of the methods.
pub const JOINT: &str = "joint maximum likelihood";

/// Every plan by every method, each the root mean square over all repeats. `None` where a fit fails, or the sensor of the
/// experiments has no camera.
#[must_use]
pub fn run(settings: &Settings) -> Option<Vec<StaticRow>> {
    let scenario = settings.scenario();
    let SensorModel::CameraLaser { laser_plane_in_camera, .. } = scenario.cell.sensor else { return None };
    let field = Field::of(&LaserSheet::from_plane(laser_plane_in_camera), &scenario.cell.tool_from_camera);
    let late_m = scenario.timing.time_offset_s * MOVING_M_S;
    let repeats = PER_REPEAT * settings.repeats;
    let mut rows = Vec::new();
    for plan in PLANS {
        let mut squares = [[0.0; 2]; 4];
        for repeat in 0..repeats {
            let estimates = Stops::taken(&scenario, plan, settings.seed + repeat)?.estimates()?;
            for (sums, estimate) in squares.iter_mut().zip(&estimates) {
                sums[0] += field.mean_square(estimate, 0.0);
                sums[1] += field.mean_square(estimate, late_m);
            }
        }
        let names = ClosedForm::ALL.map(ClosedForm::name);
        for (method, sums) in names.into_iter().chain([JOINT]).zip(squares) {
            let [standing_m, moving_m] = sums.map(|sum| (sum / repeats as f64).sqrt());
            rows.push(StaticRow { method, stops: plan.stops, lasts_s: plan.lasts_s(), standing_m, moving_m });
        }
    }
    Some(rows)
}

/// One calibration by maximum likelihood over the stops of a plan. `None` as for [`run`].
#[must_use]
pub fn calibrated(scenario: &Scenario, plan: StopPlan, seed: u64) -> Option<Pose> {
    Some(Stops::taken(scenario, plan, seed)?.estimates()?[3])
}

/// The recording at the stops.
struct Stops {
    base_from_tool: Vec<Pose>,
    sightings: Vec<BoardSighting>,
}

impl Stops {
    fn taken(scenario: &Scenario, plan: StopPlan, seed: u64) -> Option<Self> {
        let SensorModel::CameraLaser { camera, .. } = &scenario.cell.sensor else { return None };
        let mut random = ChaCha12Rng::seed_from_u64(seed.wrapping_mul(1000) + plan.stops as u64);
        let base_from_board = se3::from_parts(so3::exp(&Vector3::zeros()), Vector3::new(1.2, 0.1, 0.4));
        let (mut base_from_tool, mut sightings) = (Vec::new(), Vec::new());
        for k in 0..plan.stops {
            let view = plan.view(k);
            let tool = base_from_board * view.inverse() * scenario.cell.tool_from_camera.inverse();
            base_from_tool.push(disturbed(&tool, &mut random));
            let corners = corners(camera, &view, &mut random);
            sightings.push(BoardSighting::of(camera, &BOARD, &corners, CORNER_SIGMA_PX)?);
        }
        Some(Self { base_from_tool, sightings })
    }

    /// By the closed forms, and by maximum likelihood.
    fn estimates(&self) -> Option<[Pose; 4]> {
        let seen: Vec<Pose> = self.sightings.iter().map(|s| s.camera_from_board).collect();
        let pairs = pairs(&self.base_from_tool, &seen);
        let [tsai, park, daniilidis] = ClosedForm::ALL.map(|form| form.solve(&pairs));
        let tool_from_camera = park?;
        let base_from_board = self.base_from_tool.first()? * tool_from_camera * seen.first()?;
        let start = Unknowns { time_offset_s: 0.0, tool_from_camera, base_from_target: base_from_board };
        let fit = joint::fit(&self.sightings, RobotPath::Stops(&self.base_from_tool), &NOISE, start).ok()?;
        Some([tsai?, park?, daniilidis?, fit.unknowns.tool_from_camera])
    }
}

fn normal(random: &mut ChaCha12Rng) -> f64 {
    StandardNormal.sample(random)
}

fn disturbed(pose: &Pose, random: &mut ChaCha12Rng) -> Pose {
    let mut noise = |sigma: f64| Vector3::new(normal(random), normal(random), normal(random)) * sigma;
    let (shift, turn) = (noise(NOISE.position_m), noise(NOISE.rotation_rad));
    // The robot errs in its own tool frame.
    pose * se3::from_parts(so3::exp(&turn), shift)
}

fn corners(camera: &Camera, pose: &Pose, random: &mut ChaCha12Rng) -> Vec<FoundCorner> {
    let mut corners = Vec::new();
    for row in 0..BOARD.rows {
        for column in 0..BOARD.columns {
            let Some(seen) = project_from_board(camera, pose, &BOARD.corner(column, row)) else { continue };
            let pixel = seen.pixel + Vector2::new(normal(random), normal(random)) * CORNER_SIGMA_PX;
            if camera.ray(&pixel).is_ok() {
                corners.push(FoundCorner { column, row, pixel });
            }
        }
    }
    corners
}

/// Points over the field of the laser plane, and their true places.
struct Field {
    in_camera: Vec<Vector3<f64>>,
    in_tool: Vec<Vector3<f64>>,
    /// The laser plane's normal in the tool frame: across the plane is how a seam is followed.
    ahead: Vector3<f64>,
}

impl Field {
    fn of(sheet: &LaserSheet, tool_from_camera: &Pose) -> Self {
        let middle = sheet.intersect(&Vector3::z()).map_or(*sheet.origin(), |(point, _)| point);
        let steps = [-1.0, -0.5, 0.0, 0.5, 1.0];
        let in_camera: Vec<Vector3<f64>> = steps
            .into_iter()
            .flat_map(|across| steps.map(|depth| Vector2::new(across, depth) * FIELD_M))
            .map(|place| middle + sheet.axes() * place)
            .collect();
        let in_tool = in_camera.iter().map(|p| placed(tool_from_camera, p)).collect();
        let normal = sheet.axes().column(0).cross(&sheet.axes().column(1));
        Self { in_camera, in_tool, ahead: tool_from_camera.rotation * normal }
    }

    /// Mean square error in the tool frame of points that are placed `late_m` behind their true place, m².
    fn mean_square(&self, estimate: &Pose, late_m: f64) -> f64 {
        let error = |(seen, truth): (&Vector3<f64>, &Vector3<f64>)| {
            (placed(estimate, seen) - truth + self.ahead * late_m).norm_squared()
        };
        self.in_camera.iter().zip(&self.in_tool).map(error).sum::<f64>() / self.in_camera.len() as f64
    }
}

fn placed(a_from_b: &Pose, point: &Vector3<f64>) -> Vector3<f64> {
    a_from_b.rotation * point + a_from_b.translation.vector
}
