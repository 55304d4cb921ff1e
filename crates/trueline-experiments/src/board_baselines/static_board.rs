//! The static checkerboard: the robot stops before a board, takes a picture, and goes on; hand-eye by closed forms and by
//! maximum likelihood. A stand-in for the calibration that the paper compares itself with, which cannot be identified in
//! public text.

use super::hand_eye::{ClosedForm, pairs};
use crate::settings::Settings;
use nalgebra::{DVector, Matrix6, SMatrix, UnitQuaternion, Vector2, Vector3, Vector6};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha12Rng;
use rand_distr::{Distribution, StandardNormal};
use trueline_geometry::{Pose, se3, so3};
use trueline_lsq::check::numerical_jacobian;
use trueline_lsq::{LeastSquares, NormalEquations, SolveOptions, solve};
use trueline_model::{Camera, LaserSheet};
use trueline_sensor::bundle::{BoardState, Bundle, BundleState, Picture};
use trueline_sensor::projection::project_from_board;
use trueline_sensor::{Board, FoundCorner, homography};
use trueline_sim::SensorModel;

/// The paper's kind of board: small enough to fill the view at 131 mm.
const BOARD: Board = Board { columns: 10, rows: 7, square_m: 0.006 };

/// Noise of a corner along each axis, px.
const CORNER_SIGMA_PX: f64 = 0.1;

/// Noise of the robot's poses, m and rad: that of a good robot at rest.
const ROBOT_SIGMA: (f64, f64) = (0.03e-3, 0.001 * std::f64::consts::PI / 180.0);

/// Time to move, settle and take a picture, s.
const STOP_S: f64 = 6.0;

/// Stops and the tilt of the views, rad.
const PLANS: [(usize, f64); 3] = [(8, 0.349), (15, 0.436), (30, 0.524)];

/// Speed of the weld scan in which a time offset that was not calibrated costs its part, m/s.
pub const MOVING_M_S: f64 = 0.05;

/// Half the field over which points are measured, across and in depth, m.
const FIELD_M: f64 = 0.030;

/// One way to calibrate with a board at standstill.
#[derive(Clone, Debug, PartialEq)]
pub struct StaticRow {
    /// The method.
    pub method: &'static str,
    /// Stops of the robot.
    pub stops: usize,
    /// How long it takes, s.
    pub lasts_s: f64,
    /// Error of points that the sensor measures at standstill, in the tool frame, root mean square, m.
    pub standing_m: f64,
    /// The same while moving at [`MOVING_M_S`], with the time offset that no static board shows, m.
    pub moving_m: f64,
}

/// Every plan by every method, each the root mean square over all repeats. `None` where a fit fails, or the sensor of the
/// experiments has no camera.
#[must_use]
pub fn run(settings: &Settings) -> Option<Vec<StaticRow>> {
    let scenario = settings.scenario();
    let SensorModel::CameraLaser { camera, laser_plane_in_camera } = scenario.cell.sensor else {
        return None;
    };
    let sheet = LaserSheet::from_plane(laser_plane_in_camera);
    let truth = scenario.cell.tool_from_camera;
    let offset_m = scenario.timing.time_offset_s * MOVING_M_S;
    let mut rows = Vec::new();
    for (stops, tilt_rad) in PLANS {
        let mut squares = [0.0; 4];
        for repeat in 0..settings.repeats {
            let mut random = ChaCha12Rng::seed_from_u64(settings.seed + 5000 + 100 * repeat + stops as u64);
            let scan = Stops::taken(&camera, &truth, (stops, tilt_rad), &mut random)?;
            for (k, estimate) in scan.estimates()?.into_iter().enumerate() {
                squares[k] += seam_error_m(&sheet, &truth, &estimate).powi(2);
            }
        }
        let names = ClosedForm::ALL.map(ClosedForm::name);
        for (k, method) in names.into_iter().chain(["joint maximum likelihood"]).enumerate() {
            let standing_m = (squares[k] / settings.repeats as f64).sqrt();
            rows.push(StaticRow {
                method,
                stops,
                lasts_s: stops as f64 * STOP_S,
                standing_m,
                moving_m: standing_m.hypot(offset_m),
            });
        }
    }
    Some(rows)
}

/// What was recorded at the stops.
struct Stops {
    base_from_tool: Vec<Pose>,
    /// As estimated from the corners.
    camera_from_board: Vec<Pose>,
    /// Information of each of these, for perturbations on the left.
    information: Vec<Matrix6<f64>>,
}

impl Stops {
    fn taken(
        camera: &Camera,
        tool_from_camera: &Pose,
        (stops, tilt_rad): (usize, f64),
        random: &mut ChaCha12Rng,
    ) -> Option<Self> {
        let base_from_board = se3::from_parts(UnitQuaternion::identity(), Vector3::new(1.2, 0.1, 0.4));
        let (mut base_from_tool, mut pictures, mut starts) = (Vec::new(), Vec::new(), Vec::new());
        for _ in 0..stops {
            let axis = Vector3::new(normal(random), normal(random), normal(random)).normalize();
            let rotation = so3::exp(&(axis * random.random_range(0.3..1.0) * tilt_rad));
            let depth_m = 0.131 + random.random_range(0.0..0.04);
            let aside = Vector3::new(normal(random), normal(random), 0.0) * 2e-3;
            let camera_from_board =
                se3::from_parts(rotation, aside + Vector3::z() * depth_m - rotation * BOARD.middle());
            let true_tool = base_from_board * camera_from_board.inverse() * tool_from_camera.inverse();
            base_from_tool.push(disturbed(&true_tool, random));
            let picture = corners(camera, &camera_from_board, random);
            starts.push(BoardState::flat(start(camera, &picture)?));
            pictures.push(picture);
        }
        let bundle = Bundle {
            board: BOARD,
            pictures,
            corner_sigma_px: CORNER_SIGMA_PX,
            stripe_sigma_px: 1.0,
            flatness_m: 0.0,
            camera_prior: None,
        };
        let state =
            bundle.fitted(BundleState { camera: *camera, laser_plane_in_camera: None, boards: starts });
        let of_pose = |own: &SMatrix<f64, 8, 8>| own.fixed_view::<6, 6>(0, 0).into_owned();
        Some(Self {
            base_from_tool,
            camera_from_board: state.boards.iter().map(|b| b.camera_from_board).collect(),
            information: bundle.picture_equations(&state).iter().map(|e| of_pose(&e.own)).collect(),
        })
    }

    /// By the closed forms, and jointly.
    fn estimates(&self) -> Option<[Pose; 4]> {
        let pairs = pairs(&self.base_from_tool, &self.camera_from_board);
        let [tsai, park, daniilidis] = ClosedForm::ALL.map(|form| form.solve(&pairs));
        let begin = park?;
        let base_from_board = self.base_from_tool[0] * begin * self.camera_from_board[0];
        let joint = solve(self, (begin, base_from_board), &[], &SolveOptions::default()).ok()?.state.0;
        Some([tsai?, begin, daniilidis?, joint])
    }

    /// Whitened difference between where a stop's board is seen and where hand-eye and board put it. Robot and picture
    /// both err: their covariances add up.
    fn residual(&self, k: usize, (tool_from_camera, base_from_board): &(Pose, Pose)) -> Vector6<f64> {
        let predicted = tool_from_camera.inverse() * self.base_from_tool[k].inverse() * base_from_board;
        let (turn, shift) = se3::difference_decoupled(&self.camera_from_board[k], &predicted);
        let difference = Vector6::new(turn.x, turn.y, turn.z, shift.x, shift.y, shift.z);
        self.whitening(k, tool_from_camera) * difference
    }

    fn whitening(&self, k: usize, tool_from_camera: &Pose) -> Matrix6<f64> {
        // The tool shifted by δt and turned by δ about its own origin moves the board as the camera sees it.
        let turn = tool_from_camera.inverse().rotation.to_rotation_matrix().into_inner();
        let board_in_camera = self.camera_from_board[k].translation.vector;
        let lever = board_in_camera - tool_from_camera.inverse().translation.vector;
        let mut d_robot = Matrix6::zeros();
        d_robot.fixed_view_mut::<3, 3>(0, 0).copy_from(&turn);
        d_robot.fixed_view_mut::<3, 3>(3, 0).copy_from(&(-so3::hat(&lever) * turn));
        d_robot.fixed_view_mut::<3, 3>(3, 3).copy_from(&turn);
        let (shift_m, turn_rad) = ROBOT_SIGMA;
        let sigma = Vector6::new(turn_rad, turn_rad, turn_rad, shift_m, shift_m, shift_m);
        let robot = d_robot * Matrix6::from_diagonal(&sigma.component_mul(&sigma)) * d_robot.transpose();
        let seen = self.information[k].try_inverse().unwrap_or_else(Matrix6::zeros);
        (robot + seen)
            .try_inverse()
            .and_then(nalgebra::Cholesky::new)
            .map_or_else(Matrix6::zeros, |factor| factor.l().transpose())
    }
}

impl LeastSquares for Stops {
    type State = (Pose, Pose);

    fn dimension(&self) -> usize {
        12
    }

    fn retract(&self, (hand_eye, board): &Self::State, step: &DVector<f64>) -> Self::State {
        let part = |pose: &Pose, at: usize| {
            se3::retract_decoupled(
                pose,
                &step.fixed_rows::<3>(at).into(),
                &step.fixed_rows::<3>(at + 3).into(),
            )
        };
        (part(hand_eye, 0), part(board, 6))
    }

    fn cost(&self, state: &Self::State) -> f64 {
        (0..self.base_from_tool.len()).map(|k| 0.5 * self.residual(k, state).norm_squared()).sum()
    }

    fn linearize(&self, state: &Self::State, equations: &mut NormalEquations) {
        for k in 0..self.base_from_tool.len() {
            let residual = DVector::from_column_slice(self.residual(k, state).as_slice());
            // Poses of a metre and a radian: differences over 10⁻⁴ are exact to 10⁻¹¹.
            let jacobian = numerical_jacobian(12, 1e-4, |step| {
                DVector::from_column_slice(self.residual(k, &self.retract(state, step)).as_slice())
            });
            equations.hessian += jacobian.transpose() * &jacobian;
            equations.gradient += jacobian.transpose() * &residual;
            equations.cost += 0.5 * residual.norm_squared();
        }
    }
}

fn normal(random: &mut ChaCha12Rng) -> f64 {
    StandardNormal.sample(random)
}

fn disturbed(pose: &Pose, random: &mut ChaCha12Rng) -> Pose {
    let (shift_m, turn_rad) = ROBOT_SIGMA;
    let mut noise = |sigma: f64| Vector3::new(normal(random), normal(random), normal(random)) * sigma;
    let (shift, turn) = (noise(shift_m), noise(turn_rad));
    // The robot errs in its own tool frame.
    pose * se3::from_parts(so3::exp(&turn), shift)
}

fn corners(camera: &Camera, pose: &Pose, random: &mut ChaCha12Rng) -> Picture {
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
    Picture { corners, stripe: Vec::new() }
}

fn start(camera: &Camera, picture: &Picture) -> Option<Pose> {
    let board: Vec<Vector2<f64>> =
        picture.corners.iter().map(|c| BOARD.corner(c.column, c.row).xy()).collect();
    let ideal: Option<Vec<Vector2<f64>>> =
        picture.corners.iter().map(|c| camera.ray(&c.pixel).ok().map(|(ray, _)| ray.xy())).collect();
    homography::pose(&homography::fit(&board, &ideal?)?, &Vector2::repeat(1.0), &Vector2::zeros())
}

/// Root mean square error in the tool frame of points over the field, m.
fn seam_error_m(sheet: &LaserSheet, truth: &Pose, estimate: &Pose) -> f64 {
    let middle = sheet.intersect(&Vector3::z()).map_or(*sheet.origin(), |(point, _)| point);
    let steps = [-1.0, -0.5, 0.0, 0.5, 1.0];
    let mut squares = 0.0;
    for across in steps {
        for depth in steps {
            let point = middle + sheet.axes() * Vector2::new(across, depth) * FIELD_M;
            let (seen, is) =
                (estimate * nalgebra::Point3::from(point), truth * nalgebra::Point3::from(point));
            squares += (seen - is).norm_squared();
        }
    }
    (squares / (steps.len() * steps.len()) as f64).sqrt()
}
