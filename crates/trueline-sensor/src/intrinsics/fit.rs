//! The joint fit of camera and boards to corners, robust against wrong corners and wrong pictures.

use super::distortion_model::{DistortionModel, Evidence};
use super::start::start;
use crate::board::{Board, View};
use crate::bundle::{Bundle, BundleState, Picture, SENSOR_SIZE, SHARED_SIZE};
use crate::error::Error;
use crate::inverse_of_free::inverse_of_free;
use crate::projection::CAMERA_SIZE;
use crate::sheet::{SHEET_SIZE, SheetShape};
use nalgebra::{SMatrix, Vector2};
use trueline_geometry::statistics::median;
use trueline_lsq::{NormalEquations, SolveOptions, solve};

/// A corner is left out if it is farther off than this, in robust standard deviations of its picture's fit. Of 10,000
/// good corners (a two-dimensional normal distribution) one reaches 4.3.
const OUTLIER_SIGMAS: f64 = 5.0;

/// A picture is left out if the scatter of its corners is this many times that of the others.
const PICTURE_FACTOR: f64 = 4.0;

/// In a bad picture, corners this many of its own robust standard deviations off go first.
const WORST_SIGMAS: f64 = 3.0;

/// Rounds of leaving out and fitting again.
const MOST_ROUNDS: usize = 10;

/// Rounds in which a bad picture loses only its worst corners.
const GENTLE_ROUNDS: usize = 4;

/// σ of one axis from the median distance of a two-dimensional normal distribution: 1/√(2 ln 2).
const SIGMA_FROM_MEDIAN_DISTANCE: f64 = 0.849_321_8;

/// Fewest pictures for a camera: with two, errors cannot be separated from the model.
pub const FEWEST_PICTURES: usize = 3;

/// A fitted camera and its data.
#[derive(Clone, Debug)]
pub struct CameraFit {
    /// Camera and boards; pictures that were left out have a board too.
    pub state: BundleState,
    /// The distortion that was fitted.
    pub model: DistortionModel,
    /// Whether the board's sheet is bent or stretched by more than noise explains; else it is held flat.
    pub is_sheet_free: bool,
    /// Height of the sheet at its farthest corner of the squares over its middle, m; positive away from the camera.
    pub sheet_rise_m: f64,
    /// For each picture and each of its corners, the measured place less the predicted one, px.
    pub residuals_px: Vec<Vec<Vector2<f64>>>,
    /// Corners with a weight.
    pub used: Vec<Vec<bool>>,
    /// Standard deviation of a corner along each axis, px, from the residuals.
    pub corner_sigma_px: f64,
    /// Root mean square distance of the corners that count, px.
    pub rms_px: f64,
    /// Covariance of the camera's parameters; zero for those held fixed.
    pub covariance: SMatrix<f64, CAMERA_SIZE, CAMERA_SIZE>,
    /// Fit of each distortion model to the pictures.
    pub evidence: Vec<Evidence>,
}

impl CameraFit {
    /// Corners that count.
    #[must_use]
    pub fn corners(&self) -> usize {
        self.used.iter().flatten().filter(|used| **used).count()
    }

    /// Pictures that count.
    #[must_use]
    pub fn pictures(&self) -> usize {
        self.used.iter().filter(|picture| picture.contains(&true)).count()
    }

    /// Standard deviations of the camera's parameters.
    #[must_use]
    pub fn sigma(&self) -> [f64; CAMERA_SIZE] {
        std::array::from_fn(|k| self.covariance[(k, k)].max(0.0).sqrt())
    }
}

/// Fits a camera to the views of a board.
///
/// Without a stated `model` the distortion that predicts best is chosen by its evidence.
///
/// # Errors
/// Too few pictures, pictures without a pose, or pictures that do not fix the camera.
pub fn fit(
    size: [u32; 2],
    board: &Board,
    views: &[View],
    model: Option<DistortionModel>,
) -> Result<CameraFit, Error> {
    if views.len() < FEWEST_PICTURES {
        return Err(Error::TooFewPictures { found: views.len(), needed: FEWEST_PICTURES });
    }
    let mut rough = Rough {
        board: *board,
        views,
        used: views.iter().map(|view| vec![true; view.corners.len()]).collect(),
        state: start(size, board, views).ok_or(Error::NoPose)?,
        is_sheet_free: SheetShape::is_seen_on(board),
    };
    for model in DistortionModel::ALL {
        rough.solve(model)?;
    }
    rough.leave_out(DistortionModel::Five)?;
    let candidates: Vec<DistortionModel> = model.map_or(DistortionModel::ALL.to_vec(), |m| vec![m]);
    let mut fits = Vec::new();
    for candidate in candidates {
        rough.solve(candidate)?;
        fits.push((rough.evidence(candidate), rough.state.clone()));
    }
    let evidence: Vec<Evidence> = fits.iter().map(|(evidence, _)| *evidence).collect();
    let best = (0..fits.len()).min_by(|a, b| evidence[*a].akaike.total_cmp(&evidence[*b].akaike));
    let best = best.ok_or(Error::NoPose)?;
    rough.state = fits.swap_remove(best).1;
    rough.flatten(&evidence[best])?;
    rough.concluded(evidence[best].model, evidence)
}

/// A fit in the making.
struct Rough<'a> {
    board: Board,
    views: &'a [View],
    used: Vec<Vec<bool>>,
    state: BundleState,
    /// Whether the shape of the board's sheet is estimated.
    is_sheet_free: bool,
}

impl Rough<'_> {
    /// Takes the sheet for flat where the pictures do not bear out that it is not.
    fn flatten(&mut self, bent: &Evidence) -> Result<(), Error> {
        if !self.is_sheet_free {
            return Ok(());
        }
        let bent_state = self.state.clone();
        self.is_sheet_free = false;
        self.solve(bent.model)?;
        if self.evidence(bent.model).akaike > bent.akaike {
            (self.state, self.is_sheet_free) = (bent_state, true);
        }
        Ok(())
    }

    /// Numbers that all pictures share and that are held.
    fn fixed(&self, model: DistortionModel) -> Vec<usize> {
        let mut fixed = model.fixed();
        fixed.extend(CAMERA_SIZE..if self.is_sheet_free { SENSOR_SIZE } else { SHARED_SIZE });
        fixed
    }

    /// Numbers that all pictures share and that are estimated, besides the four of every camera.
    fn coefficients(&self, model: DistortionModel) -> usize {
        model.size() + if self.is_sheet_free { SHEET_SIZE } else { 0 }
    }

    fn bundle(&self, corner_sigma_px: f64) -> Bundle {
        let pictures = self.views.iter().zip(&self.used).map(|(view, used)| Picture {
            corners: view.corners.iter().zip(used).filter(|(_, used)| **used).map(|(c, _)| *c).collect(),
            stripe: Vec::new(),
        });
        // A picture that is left out has no corners: its board stays constant.
        Bundle {
            board: self.board,
            pictures: pictures.filter(|picture| !picture.corners.is_empty()).collect(),
            corner_sigma_px,
            stripe_sigma_px: 1.0,
            flatness_m: 0.0,
            camera_prior: None,
        }
    }

    /// Indices of the pictures that count.
    fn counting(&self) -> Vec<usize> {
        (0..self.views.len()).filter(|k| self.used[*k].contains(&true)).collect()
    }

    fn solve(&mut self, model: DistortionModel) -> Result<(), Error> {
        let counting = self.counting();
        let bundle = self.bundle(1.0);
        let fixed = self.fixed(model);
        let mut camera = self.state.camera;
        let mut coefficients = camera.distortion.to_opencv();
        coefficients[model.size()..].fill(0.0);
        camera.distortion = trueline_model::BrownConrady::from_opencv(coefficients);
        let boards = counting.iter().map(|k| self.state.boards[*k]).collect();
        let sheet = if self.is_sheet_free { self.state.sheet } else { SheetShape::default() };
        let begin = bundle.fitted(BundleState { camera, laser_plane_in_camera: None, sheet, boards });
        let options = SolveOptions { max_iterations: 200, ..SolveOptions::default() };
        let solution = solve(&bundle, begin, &fixed, &options).map_err(|_| Error::NoPose)?;
        (self.state.camera, self.state.sheet) = (solution.state.camera, solution.state.sheet);
        for (k, board) in counting.into_iter().zip(solution.state.boards) {
            self.state.boards[k] = board;
        }
        if self.state.camera.focal.iter().all(|f| f.is_finite() && *f > 0.0) {
            Ok(())
        } else {
            Err(Error::NoPose)
        }
    }

    fn residuals(&self) -> Vec<Vec<Vector2<f64>>> {
        let of_view = |(view, board): (&View, &crate::bundle::BoardState)| {
            let seen = view.corners.iter().map(|corner| {
                self.state
                    .pixel_of(&self.board, &board.camera_from_board, corner)
                    .map_or(Vector2::repeat(f64::INFINITY), |seen| corner.pixel - seen)
            });
            seen.collect()
        };
        self.views.iter().zip(&self.state.boards).map(of_view).collect()
    }

    /// Leaves out corners, then pictures, that do not fit, until nothing changes. Wrong corners spoil the pose of their
    /// picture and with it all its corners, so a bad picture first loses its worst corners.
    fn leave_out(&mut self, model: DistortionModel) -> Result<(), Error> {
        for round in 0..MOST_ROUNDS {
            let used = self.fitting(round < GENTLE_ROUNDS);
            if used == self.used {
                if round >= GENTLE_ROUNDS {
                    return Ok(());
                }
                continue;
            }
            self.used = used;
            let left = self.counting().len();
            if left < FEWEST_PICTURES {
                return Err(Error::TooFewPictures { found: left, needed: FEWEST_PICTURES });
            }
            self.solve(model)?;
        }
        Ok(())
    }

    /// Which corners fit; gently, a bad picture loses only its worst corners.
    fn fitting(&self, gently: bool) -> Vec<Vec<bool>> {
        let residuals = self.residuals();
        let sigma = robust_sigma(residuals.iter().flatten());
        let of_picture = |picture: &Vec<Vector2<f64>>| {
            let own = robust_sigma(picture.iter());
            let most = match (own > PICTURE_FACTOR * sigma, gently) {
                (false, _) => OUTLIER_SIGMAS * sigma,
                (true, true) => WORST_SIGMAS * own,
                (true, false) => 0.0,
            };
            let used: Vec<bool> = picture.iter().map(|r| r.norm() <= most).collect();
            // A picture with few corners left fixes no pose.
            let enough = 2 * used.iter().filter(|u| **u).count() >= used.len();
            used.into_iter().map(|u| u && enough).collect()
        };
        residuals.iter().map(of_picture).collect()
    }

    fn sum_of_squares(&self) -> (f64, usize) {
        let residuals = self.residuals();
        let of_used = residuals.iter().flatten().zip(self.used.iter().flatten()).filter(|(_, used)| **used);
        of_used.fold((0.0, 0), |(sum, count), (r, _)| (sum + r.norm_squared(), count + 2))
    }

    fn evidence(&self, model: DistortionModel) -> Evidence {
        let (sum, count) = self.sum_of_squares();
        Evidence::new(model, self.coefficients(model), sum, count)
    }

    fn concluded(self, model: DistortionModel, evidence: Vec<Evidence>) -> Result<CameraFit, Error> {
        let (sum, count) = self.sum_of_squares();
        let unknowns = 4 + self.coefficients(model) + 6 * self.counting().len();
        if count <= unknowns {
            return Err(Error::TooFewCorners { found: count / 2, needed: unknowns / 2 + 1 });
        }
        let corner_sigma_px = (sum / (count - unknowns) as f64).sqrt();
        let counting = self.counting();
        let boards = counting.iter().map(|k| self.state.boards[*k]).collect();
        let at = BundleState { boards, ..self.state.clone() };
        let covariance = camera_covariance(&self.bundle(corner_sigma_px), &at, &self.fixed(model))
            .ok_or(Error::NotFixed)?;
        let residuals_px = self.residuals();
        Ok(CameraFit {
            residuals_px,
            model,
            is_sheet_free: self.is_sheet_free,
            sheet_rise_m: self.state.sheet.rise_m(&self.board),
            corner_sigma_px,
            rms_px: (2.0 * sum / count as f64).sqrt(),
            covariance,
            evidence,
            state: self.state,
            used: self.used,
        })
    }
}

/// Covariance of the camera's parameters with boards and sheet free; `None` if the pictures do not fix them.
fn camera_covariance(
    bundle: &Bundle,
    state: &BundleState,
    fixed: &[usize],
) -> Option<SMatrix<f64, CAMERA_SIZE, CAMERA_SIZE>> {
    let mut prior = NormalEquations::zeros(SHARED_SIZE);
    bundle.add_prior(state, &mut prior);
    let mut information = SMatrix::<f64, SHARED_SIZE, SHARED_SIZE>::from_fn(|i, j| prior.hessian[(i, j)]);
    for picture in bundle.picture_equations(state) {
        information += picture.reduced()?.0;
    }
    let covariance = inverse_of_free(&information, fixed)?;
    Some(covariance.fixed_view::<CAMERA_SIZE, CAMERA_SIZE>(0, 0).into_owned())
}

/// σ of one axis, from the median distance.
fn robust_sigma<'a>(residuals: impl Iterator<Item = &'a Vector2<f64>>) -> f64 {
    SIGMA_FROM_MEDIAN_DISTANCE * median(residuals.map(|r| r.norm())).unwrap_or(0.0)
}
