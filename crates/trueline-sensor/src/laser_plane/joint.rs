//! The laser plane together with the camera and the boards, from corners and stripes in the same pictures.
//!
//! How flat the boards are is estimated with it (`flatness`): each board's surface may be offset and twisted at its stripe,
//! by as much as the boards differ from the plane.

use crate::board::{Board, FoundCorner};
use crate::bundle::{BoardState, Bundle, BundleState, CameraPrior, Picture, SHARED_SIZE};
use crate::error::Error;
use crate::inverse_of_free::inverse_of_free;
use crate::laser_plane::FEWEST_BOARDS;
use crate::laser_plane::flatness::Flatness;
use crate::laser_plane::shared_plane;
use crate::laser_plane::striped_view::on_board;
pub use crate::laser_plane::striped_view::{StripedView, pose_of};
use crate::projection::{CAMERA_SIZE, project_from_board};
use crate::stripe_residual::{StripePixel, StripePoint};
use nalgebra::{SMatrix, Vector3};
use trueline_geometry::statistics::median;
use trueline_geometry::{Plane, fit};
use trueline_lsq::{LeastSquares, NormalEquations, SolveOptions, solve};
use trueline_model::Camera;

/// Rounds of fitting, with weights, noise and flatness from the round before.
const ROUNDS: usize = 6;

/// Noise and flatness at first: corners alone shall say where the boards are, and noise shall not be explained by a plane that is
/// nowhere near the stripes.
const FIRST_CORNER_PX: f64 = 0.2;
const FIRST_STRIPE_PX: f64 = 1.0;
const FIRST_FLATNESS_M: f64 = 1e-4;

/// A corner farther off than so many times the median is left out: five standard deviations of one axis (Rayleigh).
const MOVED_CORNER: f64 = 4.2;

/// A picture keeps so many corners at least, or all.
const FEWEST_CORNERS: usize = 12;

/// A stripe's pixel farther off than this is left out, in standard deviations.
const OUTLIER_SIGMAS: f64 = 5.0;

/// What is known of the camera beforehand.
#[derive(Clone, Debug)]
pub struct KnownCamera {
    /// The camera.
    pub camera: Camera,
    /// Covariance of its parameters; those without variance are held, and all of them if it is zero.
    pub covariance: SMatrix<f64, CAMERA_SIZE, CAMERA_SIZE>,
}

/// A laser plane and all that was estimated with it.
#[derive(Clone, Debug)]
pub struct JointFit {
    /// Camera, plane and boards.
    pub state: BundleState,
    /// Covariance of camera (nine) and plane (θ₁, θ₂, offset); zero for what is held.
    pub covariance: SMatrix<f64, SHARED_SIZE, SHARED_SIZE>,
    /// Noise of corners along each axis, px.
    pub corner_sigma_px: f64,
    /// Noise of the stripe's pixels across the stripe, px.
    pub stripe_sigma_px: f64,
    /// Pixels across the stripe for each metre off the laser plane, in the middle of all stripes.
    pub stripe_px_per_m: f64,
    /// How flat the boards are: spread of their offsets at the stripe, m.
    pub flatness_m: f64,
    /// The stripe's points on the boards, in the camera frame, m.
    pub points: Vec<Vec<Vector3<f64>>>,
    /// Root mean square distance of these from the plane, m.
    pub rms_m: f64,
    /// Boards whose stripe lies nowhere near the plane of the others, and do not count.
    pub left_out: usize,
}

impl JointFit {
    /// Standard deviation of the plane's offset in the middle of the stripes' points, m: what an error of the tilt does not
    /// touch.
    #[must_use]
    pub fn middle_sigma_m(&self) -> f64 {
        let Some(plane) = self.plane() else { return f64::INFINITY };
        let count = self.points.iter().map(Vec::len).sum::<usize>().max(1) as f64;
        let middle = self.points.iter().flatten().sum::<Vector3<f64>>() / count;
        let tilts = middle.transpose() * crate::sheet_tilt::axes(&plane);
        let d_distance = Vector3::new(tilts[0], tilts[1], -1.0);
        let covariance = self.covariance.fixed_view::<3, 3>(CAMERA_SIZE, CAMERA_SIZE);
        d_distance.dot(&(covariance * d_distance)).max(0.0).sqrt()
    }

    /// The plane in the camera frame.
    #[must_use]
    pub fn plane(&self) -> Option<Plane> {
        self.state.laser_plane_in_camera
    }
}

/// Fits the plane.
///
/// # Errors
/// Too few boards with a stripe, or stripes that fix no plane.
pub fn fit_joint(known: &KnownCamera, board: &Board, views: &[StripedView]) -> Result<JointFit, Error> {
    let views: Vec<&StripedView> = views.iter().filter(|v| v.stripe.len() >= 2).collect();
    if views.len() < FEWEST_BOARDS {
        return Err(Error::TooFewBoards { found: views.len(), needed: FEWEST_BOARDS });
    }
    let (near, plane) = shared_plane::of_most(&known.camera, board, &views)?;
    if near.len() < FEWEST_BOARDS {
        return Err(Error::TooFewBoards { found: near.len(), needed: FEWEST_BOARDS });
    }
    let mut joint = Joint::begin(known, board, &near, plane)?;
    for _ in 0..ROUNDS {
        joint.round()?;
    }
    let left_out = views.len() - joint.state.boards.len();
    Ok(JointFit { left_out, ..joint.conclude()? })
}

struct Joint {
    bundle: Bundle,
    state: BundleState,
    fixed: Vec<usize>,
}

impl Joint {
    fn begin(
        known: &KnownCamera,
        board: &Board,
        views: &[&StripedView],
        plane: Plane,
    ) -> Result<Self, Error> {
        let camera = known.camera;
        let prior = CameraPrior::new(&camera, &known.covariance).ok_or(Error::NotFixed)?;
        let fixed = prior.held();
        let poses: Option<Vec<BoardState>> =
            views.iter().map(|v| Some(BoardState::flat(pose_of(&camera, board, &v.view)?))).collect();
        let boards = poses.ok_or(Error::NoPose)?;
        let pictures = views.iter().map(|v| Picture {
            corners: v.view.corners.clone(),
            stripe: v.stripe.iter().map(|p| StripePixel { pixel: *p, px_per_m: 1.0, along_m: 0.0 }).collect(),
        });
        let bundle = Bundle {
            board: *board,
            pictures: pictures.collect(),
            corner_sigma_px: FIRST_CORNER_PX,
            stripe_sigma_px: FIRST_STRIPE_PX,
            flatness_m: FIRST_FLATNESS_M,
            camera_prior: Some(prior),
        };
        let state = BundleState { camera, laser_plane_in_camera: Some(plane), boards };
        Ok(Self { bundle, state, fixed })
    }

    /// Weights of the stripes, a fit, and noise and flatness from its residuals.
    fn round(&mut self) -> Result<(), Error> {
        self.weigh();
        let begin = self.bundle.fitted(self.state.clone());
        let solved = solve(&self.bundle, begin, &self.fixed, &SolveOptions::default());
        self.state = solved.map_err(|_| Error::NotFixed)?.state;
        self.leave_out();
        let (corners, stripe) = self.noise();
        self.bundle.corner_sigma_px = corners;
        self.bundle.stripe_sigma_px = stripe;
        let at =
            |joint: &Self| Flatness::at(&joint.bundle, &joint.state, &joint.fixed).ok_or(Error::NotFixed);
        let mut flatness = at(self)?;
        while self.state.boards.len() > FEWEST_BOARDS
            && let Some(k) = flatness.strange()
        {
            self.bundle.pictures.remove(k);
            self.state.boards.remove(k);
            flatness = at(self)?;
        }
        self.bundle.flatness_m = flatness.most_likely().ok_or(Error::NotFixed)?;
        Ok(())
    }

    fn weigh(&mut self) {
        let Some(plane) = self.state.laser_plane_in_camera else { return };
        for (picture, board) in self.bundle.pictures.iter_mut().zip(&self.state.boards) {
            let camera = &self.state.camera;
            let points: Vec<Option<StripePoint>> =
                picture.stripe.iter().map(|s| StripePoint::of(camera, &plane, board, s)).collect();
            let seen: Vec<Vector3<f64>> = points.iter().flatten().map(|p| p.point_in_camera).collect();
            let Some(line) = fit::line(&seen) else { continue };
            for (stripe, point) in picture.stripe.iter_mut().zip(points) {
                let Some(point) = point else { continue };
                stripe.px_per_m = point.px_per_m;
                stripe.along_m = line.direction().dot(&(point.point_in_camera - line.anchor()));
            }
            let middle = picture.stripe.iter().map(|s| s.along_m).sum::<f64>() / seen.len().max(1) as f64;
            picture.stripe.iter_mut().for_each(|stripe| stripe.along_m -= middle);
        }
    }

    /// Residuals of a picture's stripe, px.
    fn stripe_residuals(&self, k: usize) -> Vec<f64> {
        let Some(plane) = self.state.laser_plane_in_camera else { return Vec::new() };
        let (camera, board) = (&self.state.camera, &self.state.boards[k]);
        let residual = |s: &StripePixel| {
            StripePoint::of(camera, &plane, board, s).map_or(f64::INFINITY, |p| p.distance_m * s.px_per_m)
        };
        self.bundle.pictures[k].stripe.iter().map(residual).collect()
    }

    /// Distances of a picture's corners from where they should be, px.
    fn corner_distances(&self, k: usize) -> Vec<f64> {
        let pose = &self.state.boards[k].camera_from_board;
        let distance = |corner: &FoundCorner| {
            let point = self.bundle.board.corner(corner.column, corner.row);
            let seen = project_from_board(&self.state.camera, pose, &point);
            seen.map_or(f64::INFINITY, |seen| (seen.pixel - corner.pixel).norm())
        };
        self.bundle.pictures[k].corners.iter().map(distance).collect()
    }

    /// Corners that the stripe's light has moved, and pixels that are not on the stripe.
    fn leave_out(&mut self) {
        let pictures = self.bundle.pictures.len();
        let usual_px = median((0..pictures).flat_map(|k| self.corner_distances(k))).unwrap_or(0.0);
        for k in 0..pictures {
            let distances = self.corner_distances(k);
            let mut fine = distances.iter().map(|distance| *distance <= MOVED_CORNER * usual_px);
            if distances.iter().filter(|distance| **distance <= MOVED_CORNER * usual_px).count()
                >= FEWEST_CORNERS
            {
                self.bundle.pictures[k].corners.retain(|_| fine.next().unwrap_or(false));
            }
        }
        let most = OUTLIER_SIGMAS * self.bundle.stripe_sigma_px.max(self.noise().1);
        for k in 0..pictures {
            let residuals = self.stripe_residuals(k);
            let mut fine = residuals.iter().map(|r| r.abs() <= most);
            self.bundle.pictures[k].stripe.retain(|_| fine.next().unwrap_or(false));
        }
    }

    /// Noise of corners and of the stripes' pixels, px: squares by their freedom.
    fn noise(&self) -> (f64, f64) {
        let (mut corner_sum, mut corners) = (0.0, 0.0);
        let (mut stripe_sum, mut pixels) = (0.0, 0.0);
        for (k, (picture, board)) in self.bundle.pictures.iter().zip(&self.state.boards).enumerate() {
            for corner in &picture.corners {
                let point = self.bundle.board.corner(corner.column, corner.row);
                if let Some(seen) = project_from_board(&self.state.camera, &board.camera_from_board, &point) {
                    corner_sum += (seen.pixel - corner.pixel).norm_squared();
                    corners += 2.0;
                }
            }
            let residuals = self.stripe_residuals(k);
            stripe_sum += residuals.iter().map(|r| r * r).sum::<f64>();
            pixels += residuals.len() as f64;
            // A pose takes six numbers from the corners, offset and twist two from the stripe.
            corners -= 6.0;
            pixels -= 2.0;
        }
        let sigma = |sum: f64, freedom: f64| (sum / freedom.max(1.0)).sqrt().max(1e-4);
        (sigma(corner_sum, corners), sigma(stripe_sum, pixels))
    }

    fn conclude(self) -> Result<JointFit, Error> {
        let mut equations = NormalEquations::zeros(SHARED_SIZE);
        self.bundle.linearize(&self.state, &mut equations);
        let information = SMatrix::from_fn(|i, j| equations.hessian[(i, j)]);
        let covariance = inverse_of_free(&information, &self.fixed).ok_or(Error::NotFixed)?;
        let plane = self.state.laser_plane_in_camera.ok_or(Error::OneLine)?;
        let points: Vec<Vec<Vector3<f64>>> = (self.bundle.pictures.iter().zip(&self.state.boards))
            .map(|(picture, board)| {
                let flat = BoardState::flat(board.camera_from_board);
                picture.stripe.iter().filter_map(|s| on_board(&self.state.camera, &flat, &s.pixel)).collect()
            })
            .collect();
        let all: Vec<f64> = points.iter().flatten().map(|p| plane.signed_distance(p)).collect();
        let stripes = || self.bundle.pictures.iter().flat_map(|picture| &picture.stripe);
        let stripe_px_per_m = stripes().map(|s| s.px_per_m).sum::<f64>() / stripes().count().max(1) as f64;
        Ok(JointFit {
            covariance,
            corner_sigma_px: self.bundle.corner_sigma_px,
            stripe_sigma_px: self.bundle.stripe_sigma_px,
            stripe_px_per_m,
            flatness_m: self.bundle.flatness_m,
            rms_m: (all.iter().map(|d| d * d).sum::<f64>() / all.len().max(1) as f64).sqrt(),
            left_out: 0,
            points,
            state: self.state,
        })
    }
}
