//! The laser plane together with the camera and the boards, from corners and stripes in the same pictures.
//!
//! The flatness of the boards is estimated with it (`flatness`): each board's surface may be offset and twisted at its
//! stripe, by the spread of the boards about the plane.

use crate::board::{Board, FoundCorner, View};
use crate::bundle::{Bundle, BundleState, CameraPrior, Picture, SENSOR_SIZE, SHARED_SIZE};
use crate::error::Error;
use crate::inverse_of_free::inverse_of_free;
use crate::laser_plane::FEWEST_BOARDS;
use crate::laser_plane::flatness::Flatness;
use crate::laser_plane::known_camera::KnownCamera;
use crate::laser_plane::striped_view::StripedView;
use crate::laser_plane::{seen_boards, shared_plane};
use crate::projection::CAMERA_SIZE;
use crate::sheet::SheetShape;
use crate::stripe_residual::{Sheet, StripePixel, StripePoint};
use nalgebra::{SMatrix, Vector3};
use trueline_geometry::statistics::median;
use trueline_geometry::{Plane, fit};
use trueline_lsq::{LeastSquares, NormalEquations, SolveOptions, solve};

/// Rounds of fitting, with weights, noise and flatness from the round before.
const ROUNDS: usize = 6;

/// Noise and flatness at first, at least: corners alone shall say where the boards are. If the stripes lie farther from the
/// first plane, that distance is their standard deviation.
const FIRST_CORNER_PX: f64 = 0.2;
const FIRST_STRIPE_PX: f64 = 1.0;
const FIRST_FLATNESS_M: f64 = 1e-4;

/// Stretches of a stripe for the comparison of mean residuals: a bent sheet moves neighbours in the same way.
const STRETCHES: usize = 8;

/// A corner farther off than this many times the median is left out: five standard deviations of one axis (Rayleigh).
const MOVED_CORNER: f64 = 4.2;

/// Fewest corners of a picture, or all.
const FEWEST_CORNERS: usize = 12;

/// A stripe's pixel farther off than this is left out, in standard deviations.
const OUTLIER_SIGMAS: f64 = 5.0;

/// A laser plane and all that was estimated with it.
#[derive(Clone, Debug)]
pub struct JointFit {
    /// Camera, plane and boards.
    pub state: BundleState,
    /// Covariance of camera (nine) and plane (θ₁, θ₂, offset); zero for those held fixed.
    pub covariance: SMatrix<f64, SENSOR_SIZE, SENSOR_SIZE>,
    /// Noise of corners along each axis, px.
    pub corner_sigma_px: f64,
    /// Noise of the stripe's pixels across the stripe, px.
    pub stripe_sigma_px: f64,
    /// Pixels across the stripe for each metre off the laser plane, in the middle of all stripes.
    pub stripe_px_per_m: f64,
    /// How flat the boards are: spread of their offsets at the stripe, m.
    pub flatness_m: f64,
    /// How far the sheet of the boards rises from its middle to the corner of the squares that is farthest off, m.
    pub sheet_rise_m: f64,
    /// The stripe's points on the boards, in the camera frame, m.
    pub points: Vec<Vec<Vector3<f64>>>,
    /// Root mean square distance of these from the plane, m.
    pub rms_m: f64,
    /// Views that count, by their place in the input.
    pub counting: Vec<usize>,
    /// Boards with a stripe far from the plane of the others, which do not count.
    pub left_out: usize,
}

impl JointFit {
    /// Standard deviation of the plane's offset in the middle of the stripes' points, m: independent of the tilt's error.
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
    let whole: Vec<usize> = (0..views.len()).filter(|k| views[*k].stripe.len() >= 2).collect();
    if whole.len() < FEWEST_BOARDS {
        return Err(Error::TooFewBoards { found: whole.len(), needed: FEWEST_BOARDS });
    }
    let candidates: Vec<&StripedView> = whole.iter().map(|k| &views[*k]).collect();
    let corners: Vec<&View> = candidates.iter().map(|view| &view.view).collect();
    let seen = seen_boards::of_corners(known, board, &corners)?;
    let (near, plane) = shared_plane::of_most(&known.camera, board, &seen, &candidates)?;
    if near.len() < FEWEST_BOARDS {
        return Err(Error::NoCommonPlane { found: near.len(), needed: FEWEST_BOARDS });
    }
    let counting = near.iter().map(|k| whole[*k]).collect();
    let boards = near.iter().map(|k| seen.boards[*k]).collect();
    let state =
        BundleState { camera: known.camera, laser_plane_in_camera: Some(plane), sheet: seen.sheet, boards };
    let near: Vec<&StripedView> = near.iter().map(|k| candidates[*k]).collect();
    let mut joint = Joint { counting, ..Joint::begin(known, board, &near, state)? };
    joint.begin_with_what_is_seen()?;
    for _ in 0..ROUNDS {
        joint.round()?;
    }
    let left_out = whole.len() - joint.state.boards.len();
    Ok(JointFit { left_out, ..joint.conclude()? })
}

struct Joint {
    bundle: Bundle,
    state: BundleState,
    fixed: Vec<usize>,
    counting: Vec<usize>,
}

impl Joint {
    fn begin(
        known: &KnownCamera,
        board: &Board,
        views: &[&StripedView],
        state: BundleState,
    ) -> Result<Self, Error> {
        let prior = CameraPrior::new(&known.camera, &known.covariance).ok_or(Error::NotFixed)?;
        let mut fixed = prior.held();
        if !SheetShape::is_seen_on(board) {
            fixed.extend(SENSOR_SIZE..SHARED_SIZE);
        }
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
        Ok(Self { bundle, state, fixed, counting: (0..views.len()).collect() })
    }

    /// Noise and flatness from the first plane, so that no camera is bent to explain the sheets.
    fn begin_with_what_is_seen(&mut self) -> Result<(), Error> {
        self.weigh();
        self.bundle.stripe_sigma_px = self.noise().1.max(FIRST_STRIPE_PX);
        let flatness = Flatness::at(&self.bundle, &self.state, &self.fixed).ok_or(Error::NotFixed)?;
        self.bundle.flatness_m = flatness.most_likely().ok_or(Error::NotFixed)?.max(FIRST_FLATNESS_M);
        Ok(())
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
            self.counting.remove(k);
            flatness = at(self)?;
        }
        self.bundle.flatness_m = flatness.most_likely().ok_or(Error::NotFixed)?;
        Ok(())
    }

    /// The board and the shape of its sheet.
    fn sheet(&self) -> Sheet<'_> {
        Sheet { board: &self.bundle.board, shape: &self.state.sheet }
    }

    fn weigh(&mut self) {
        let Some(plane) = self.state.laser_plane_in_camera else { return };
        let Bundle { board: target, pictures, .. } = &mut self.bundle;
        let sheet = Sheet { board: target, shape: &self.state.sheet };
        for (picture, board) in pictures.iter_mut().zip(&self.state.boards) {
            let camera = &self.state.camera;
            let points: Vec<Option<StripePoint>> =
                picture.stripe.iter().map(|s| StripePoint::of(camera, &plane, (board, sheet), s)).collect();
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
            StripePoint::of(camera, &plane, (board, self.sheet()), s)
                .map_or(f64::INFINITY, |p| p.distance_m * s.px_per_m)
        };
        self.bundle.pictures[k].stripe.iter().map(residual).collect()
    }

    /// Distances of a picture's corners from their predictions, px.
    fn corner_distances(&self, k: usize) -> Vec<f64> {
        let pose = &self.state.boards[k].camera_from_board;
        let distance = |corner: &FoundCorner| {
            let seen = self.state.pixel_of(&self.bundle.board, pose, corner);
            seen.map_or(f64::INFINITY, |seen| (seen - corner.pixel).norm())
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

    /// Noise of corners and of the stripes' pixels, px: squares by their freedom, of single pixels or of stretches, whichever is more.
    fn noise(&self) -> (f64, f64) {
        let (mut corner_sum, mut corners) = (0.0, 0.0);
        let (mut stripe_sum, mut pixels) = (0.0, 0.0);
        let (mut shared_sum, mut stretches) = (0.0, 0.0);
        for (k, (picture, board)) in self.bundle.pictures.iter().zip(&self.state.boards).enumerate() {
            for corner in &picture.corners {
                let pose = &board.camera_from_board;
                if let Some(seen) = self.state.pixel_of(&self.bundle.board, pose, corner) {
                    corner_sum += (seen - corner.pixel).norm_squared();
                    corners += 2.0;
                }
            }
            let residuals = self.stripe_residuals(k);
            stripe_sum += residuals.iter().map(|r| r * r).sum::<f64>();
            pixels += residuals.len() as f64;
            let length = residuals.len().div_ceil(STRETCHES).max(1);
            for stretch in residuals.chunks(length) {
                shared_sum += stretch.iter().sum::<f64>().powi(2) / stretch.len() as f64;
                stretches += 1.0;
            }
            stretches -= 2.0;
            // A pose takes six numbers from the corners, offset and twist two from the stripe.
            corners -= 6.0;
            pixels -= 2.0;
        }
        let sigma = |sum: f64, freedom: f64| (sum / freedom.max(1.0)).sqrt().max(1e-4);
        // Neighbours that are off alike are worth fewer: the noise is that of pixels that would be independent.
        let stripe_px = sigma(stripe_sum, pixels).max(sigma(shared_sum, stretches));
        (sigma(corner_sum, corners), stripe_px)
    }

    fn conclude(self) -> Result<JointFit, Error> {
        let mut equations = NormalEquations::zeros(SHARED_SIZE);
        self.bundle.linearize(&self.state, &mut equations);
        let information = SMatrix::<f64, SHARED_SIZE, SHARED_SIZE>::from_fn(|i, j| equations.hessian[(i, j)]);
        let covariance = inverse_of_free(&information, &self.fixed).ok_or(Error::NotFixed)?;
        let covariance = covariance.fixed_view::<SENSOR_SIZE, SENSOR_SIZE>(0, 0).into();
        let plane = self.state.laser_plane_in_camera.ok_or(Error::OneLine)?;
        let points: Vec<Vec<Vector3<f64>>> = (self.bundle.pictures.iter().zip(&self.state.boards))
            .map(|(picture, board)| {
                let seen = |s: &StripePixel| {
                    self.sheet().seen(&self.state.camera, &board.camera_from_board, &s.pixel)
                };
                picture.stripe.iter().filter_map(seen).collect()
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
            sheet_rise_m: self.state.sheet.rise_m(&self.bundle.board),
            rms_m: (all.iter().map(|d| d * d).sum::<f64>() / all.len().max(1) as f64).sqrt(),
            left_out: 0,
            counting: self.counting,
            points,
            state: self.state,
        })
    }
}
