//! Whether a sensor's calibration may be used, and warnings.

use crate::board::{Board, FoundCorner, View};
use crate::board_hand_eye::joint::{BoardFit, HAND_EYE, SIZE, TIME_OFFSET};
use crate::intrinsics::cross_validation::AGREES;
use crate::intrinsics::{CameraFit, CrossValidation};
use crate::laser_plane::plate::PlateFit;
use crate::laser_plane::{DOUBTFUL, JointFit, PlaneFit};
use nalgebra::{Matrix3, SMatrix};
use std::fmt;

/// The focal length must be known at least this well, as a fraction.
pub(crate) const MOST_FOCAL_SIGMA: f64 = 0.02;

/// The plane's normal must be known at least this well, rad.
pub(crate) const MOST_NORMAL_SIGMA_RAD: f64 = 0.035;

/// The plane's offset in the middle of its points must be known at least this well, m.
pub(crate) const MOST_MIDDLE_SIGMA_M: f64 = 1e-3;

/// The fewest pictures of a board before the robot: 36 numbers leave 23 to judge the noise of 13 unknowns by.
pub(crate) const LEAST_BOARD_PICTURES: usize = 6;

/// Board and robot that differ by more than this multiple of their noise have another error.
pub(crate) const MOST_DISAGREEMENT: f64 = 3.0;

/// Above this the noise differs from the expected noise, and the user is warned.
pub(crate) const USUAL_DISAGREEMENT: f64 = 1.5;

/// The hand-eye transform must be known at least this well, rad.
pub(crate) const MOST_ROTATION_SIGMA_RAD: f64 = 5e-3;

/// And this well, m.
pub(crate) const MOST_TRANSLATION_SIGMA_M: f64 = 1e-3;

/// The time offset must be known at least this well, s.
pub(crate) const MOST_TIME_OFFSET_SIGMA_S: f64 = 2e-3;

/// Corners with a worse fit than this are not of a sharp board, px.
pub(crate) const MOST_RMS_PX: f64 = 2.0;

/// Points of a laser plane scatter by less than this about it, m: a stripe's middle is found to a tenth of it.
const USUAL_PLANE_RMS_M: f64 = 0.5e-3;

/// Points with a larger scatter than this are not of a plane, m.
const MOST_PLANE_RMS_M: f64 = 2e-3;

/// Reasons for a refusal of a calibration, and warnings.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Remark {
    /// The focal length is not known well enough.
    FocalUncertain {
        /// Standard deviation as a fraction.
        sigma: f64,
    },
    /// Corners do not fit any camera.
    BadFit {
        /// Root mean square, px.
        rms_px: f64,
    },
    /// Halves of the pictures disagree.
    HalvesDisagree {
        /// Their difference by its expectation.
        ratio: f64,
    },
    /// Pictures were left out.
    PicturesLeftOut {
        /// Number.
        count: usize,
    },
    /// The plane's normal is not known well enough.
    NormalUncertain {
        /// Standard deviation, rad.
        sigma_rad: f64,
    },
    /// The plane's offset is too uncertain in the measured range.
    OffsetUncertain {
        /// Standard deviation, m.
        sigma_m: f64,
    },
    /// The plate was seen at too few attitudes.
    TooLittleTilt {
        /// Standard deviation of its attitude about two axes, the larger first, rad.
        tilts_rad: [f64; 2],
    },
    /// A board lies off the plane.
    BoardDoubtful {
        /// Which, by its place in the order.
        index: usize,
        /// Its offset or slope in standard deviations.
        z: f64,
    },
    /// Points lie off the plane.
    PointsOffPlane {
        /// Root mean square, m.
        rms_m: f64,
    },
    /// No picture shows all of the board.
    BoardNeverWhole {
        /// Columns and rows that were stated.
        stated: [usize; 2],
        /// The most of them that a picture shows.
        seen: [usize; 2],
    },
    /// Few pictures of the moving board count.
    FewBoardPictures {
        /// Their number.
        count: usize,
    },
    /// The robot stands at each picture, but this was not stated.
    AtStops {
        /// Number of stops.
        stops: usize,
    },
    /// Board and robot disagree by more than their noise.
    BoardAndRobotDisagree {
        /// By how many times.
        factor: f64,
    },
    /// The hand-eye transform is not known well enough.
    HandEyeUncertain {
        /// Largest standard deviation of the rotation, rad.
        rotation_rad: f64,
        /// And of the translation, m.
        translation_m: f64,
    },
    /// The time offset is not known well enough.
    TimeOffsetUncertain {
        /// Standard deviation, s.
        sigma_s: f64,
    },
}

impl Remark {
    /// A stable word for programs.
    #[must_use]
    pub fn code(&self) -> &'static str {
        match self {
            Self::FocalUncertain { .. } => "focal-length-uncertain",
            Self::BadFit { .. } => "corners-do-not-fit",
            Self::HalvesDisagree { .. } => "halves-disagree",
            Self::PicturesLeftOut { .. } => "pictures-left-out",
            Self::NormalUncertain { .. } => "plane-normal-uncertain",
            Self::OffsetUncertain { .. } => "plane-offset-uncertain",
            Self::TooLittleTilt { .. } => "too-little-tilt",
            Self::BoardDoubtful { .. } => "board-doubtful",
            Self::PointsOffPlane { .. } => "points-off-plane",
            Self::BoardNeverWhole { .. } => "board-never-whole",
            Self::FewBoardPictures { .. } => "few-board-pictures",
            Self::AtStops { .. } => "unobservable",
            Self::BoardAndRobotDisagree { .. } => "board-and-robot-disagree",
            Self::HandEyeUncertain { .. } => "hand-eye-uncertain",
            Self::TimeOffsetUncertain { .. } => "time-offset-uncertain",
        }
    }
}

impl fmt::Display for Remark {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::FocalUncertain { sigma } => write!(
                f,
                "the focal length has a large uncertainty: ± {:.1} %. Tilt the board by about 30 degrees in \
                different directions",
                sigma * 100.0
            ),
            Self::BadFit { rms_px } => {
                write!(
                    f,
                    "the corner residuals are {rms_px:.2} px RMS. Check that the board is flat and the \
                    pictures are sharp"
                )
            }
            Self::HalvesDisagree { ratio } => halves_disagree(f, *ratio),
            Self::PicturesLeftOut { count: 1 } => {
                write!(f, "one picture is an outlier and was left out")
            }
            Self::PicturesLeftOut { count } => {
                write!(f, "{count} pictures are outliers and were left out")
            }
            Self::NormalUncertain { sigma_rad } => normal_uncertain(f, sigma_rad.to_degrees()),
            Self::OffsetUncertain { sigma_m } => {
                write!(
                    f,
                    "the plane's offset has a large uncertainty: ± {:.2} mm. Use more boards",
                    sigma_m * 1e3
                )
            }
            Self::TooLittleTilt { tilts_rad } => too_little_tilt(f, tilts_rad.map(f64::to_degrees)),
            Self::BoardDoubtful { index, z } => {
                write!(f, "board {} lies {:.1} σ off the plane", index + 1, z.abs())
            }
            Self::PointsOffPlane { rms_m } => points_off_plane(f, *rms_m),
            Self::BoardNeverWhole { stated, seen } => board_never_whole(f, *stated, *seen),
            Self::FewBoardPictures { count } => few_board_pictures(f, *count),
            Self::AtStops { stops } => write!(
                f,
                "the time offset cannot be determined, because the robot stands still at each of the {stops} \
                 pictures. Use --at-stops to calibrate without it, or take pictures while the robot moves"
            ),
            Self::BoardAndRobotDisagree { factor } => board_and_robot_disagree(f, *factor),
            Self::HandEyeUncertain { rotation_rad, translation_m } => {
                hand_eye_uncertain(f, rotation_rad.to_degrees(), translation_m * 1e3)
            }
            Self::TimeOffsetUncertain { sigma_s } => write!(
                f,
                "the time offset has a large uncertainty: ± {:.2} ms. Move faster, and change speed and \
                direction more often",
                sigma_s * 1e3
            ),
        }
    }
}

fn halves_disagree(f: &mut fmt::Formatter<'_>, ratio: f64) -> fmt::Result {
    write!(
        f,
        "two halves of the pictures differ {ratio:.1} times more than their uncertainty explains. The lens was refocused between the \
         pictures, or the board is wavy: glue it on something flat, and take all pictures in one session"
    )
}

fn normal_uncertain(f: &mut fmt::Formatter<'_>, sigma_deg: f64) -> fmt::Result {
    write!(
        f,
        "the plane's normal has a large uncertainty: ± {sigma_deg:.2} degrees. Put the board at more distances and tilts"
    )
}

fn few_board_pictures(f: &mut fmt::Formatter<'_>, count: usize) -> fmt::Result {
    write!(
        f,
        "only {count} pictures are usable; at least {LEAST_BOARD_PICTURES} and half of all are needed. Keep the whole board in view"
    )
}

fn board_and_robot_disagree(f: &mut fmt::Formatter<'_>, factor: f64) -> fmt::Result {
    write!(
        f,
        "board and robot disagree {factor:.1} times more than their noise explains. Check that the board stood still and that its square \
         has the stated length"
    )
}

fn hand_eye_uncertain(f: &mut fmt::Formatter<'_>, rotation_deg: f64, translation_mm: f64) -> fmt::Result {
    write!(
        f,
        "the hand-eye transform has a large uncertainty: ± {rotation_deg:.3} degrees and ± {translation_mm:.2} mm. Turn the tool further, \
         about all axes"
    )
}

fn too_little_tilt(f: &mut fmt::Formatter<'_>, [first_deg, second_deg]: [f64; 2]) -> fmt::Result {
    write!(
        f,
        "the tool was tilted too little: ± {first_deg:.1} degrees about one axis and ± {second_deg:.1} about \
         the other. Tilt it by 20 degrees or more to every side, near and far"
    )
}

fn points_off_plane(f: &mut fmt::Formatter<'_>, rms_m: f64) -> fmt::Result {
    write!(
        f,
        "the points lie {:.2} mm RMS off the plane. Check that the boards are flat, the points in mm, and \
        the laser's lines in one plane",
        rms_m * 1e3
    )
}

fn board_never_whole(
    f: &mut fmt::Formatter<'_>,
    [columns, rows]: [usize; 2],
    [most_columns, most_rows]: [usize; 2],
) -> fmt::Result {
    write!(
        f,
        "no picture shows all {columns} x {rows} inner corners (at most {most_columns} x {most_rows}). Check \
        the stated size of the board"
    )
}

/// NaN exceeds every limit.
fn exceeds(value: f64, limit: f64) -> bool {
    value.is_nan() || value > limit
}

/// Reasons for a refusal of a camera, and warnings.
#[must_use]
pub fn of_camera(fit: &CameraFit, halves: Option<&CrossValidation>) -> (Vec<Remark>, Vec<Remark>) {
    let (mut reasons, mut warnings) = (Vec::new(), Vec::new());
    let sigma = fit.sigma();
    let focal = fit.state.camera.focal;
    let fraction = (sigma[0] / focal.x).max(sigma[1] / focal.y);
    if exceeds(fraction, MOST_FOCAL_SIGMA) {
        reasons.push(Remark::FocalUncertain { sigma: fraction });
    }
    if exceeds(fit.rms_px, MOST_RMS_PX) {
        reasons.push(Remark::BadFit { rms_px: fit.rms_px });
    }
    if let Some(halves) = halves.filter(|halves| exceeds(halves.ratio(), AGREES)) {
        let remarks = if halves.is_beyond_chance() { &mut reasons } else { &mut warnings };
        remarks.push(Remark::HalvesDisagree { ratio: halves.ratio() });
    }
    let left_out = fit.used.len() - fit.pictures();
    if left_out > 0 {
        warnings.push(Remark::PicturesLeftOut { count: left_out });
    }
    (reasons, warnings)
}

/// Reasons for a refusal of a plane: from the covariance of (θ₁, θ₂, offset) and the offset's σ in the measured
/// range.
#[must_use]
pub fn of_plane(covariance: &Matrix3<f64>, middle_sigma_m: f64) -> Vec<Remark> {
    let mut reasons = Vec::new();
    let sigma_rad = covariance[(0, 0)].max(covariance[(1, 1)]).max(0.0).sqrt();
    if exceeds(sigma_rad, MOST_NORMAL_SIGMA_RAD) {
        reasons.push(Remark::NormalUncertain { sigma_rad });
    }
    if exceeds(middle_sigma_m, MOST_MIDDLE_SIGMA_M) {
        reasons.push(Remark::OffsetUncertain { sigma_m: middle_sigma_m });
    }
    reasons
}

/// Reasons for a refusal of a plane from points on boards, and warnings.
#[must_use]
pub fn of_points(fit: &PlaneFit) -> (Vec<Remark>, Vec<Remark>) {
    let mut reasons = of_plane(&fit.covariance, fit.middle_sigma_m);
    let mut warnings = doubtful_boards(fit);
    if exceeds(fit.rms_m, MOST_PLANE_RMS_M) {
        reasons.push(Remark::PointsOffPlane { rms_m: fit.rms_m });
    } else if fit.rms_m > USUAL_PLANE_RMS_M {
        warnings.push(Remark::PointsOffPlane { rms_m: fit.rms_m });
    }
    (reasons, warnings)
}

/// A board never completely visible: it may be smaller than stated.
#[must_use]
pub fn never_whole(views: &[View], board: &Board) -> Option<Remark> {
    if views.iter().any(|view| view.complete) {
        return None;
    }
    let most = |of: fn(&FoundCorner) -> usize| {
        views.iter().flat_map(|view| &view.corners).map(of).max().map_or(0, |last| last + 1)
    };
    let seen = [most(|corner| corner.column), most(|corner| corner.row)];
    Some(Remark::BoardNeverWhole { stated: [board.columns, board.rows], seen })
}

/// Reasons for a refusal of a plane from a plate, and warnings.
#[must_use]
pub fn of_plate(fit: &PlateFit) -> (Vec<Remark>, Vec<Remark>) {
    let mut reasons = of_plane(&fit.plane_covariance(), fit.middle_sigma_m());
    if !reasons.is_empty() {
        reasons.push(Remark::TooLittleTilt { tilts_rad: fit.tilts_rad });
    }
    let count = fit.stops.len() - fit.used();
    (reasons, (count > 0).then_some(Remark::PicturesLeftOut { count }).into_iter().collect())
}

/// Reasons for a refusal of a hand-eye transform from a board, and warnings. The covariance contains all included
/// effects.
#[must_use]
pub fn of_board(fit: &BoardFit, covariance: &SMatrix<f64, SIZE, SIZE>) -> (Vec<Remark>, Vec<Remark>) {
    let (mut reasons, mut warnings) = (Vec::new(), Vec::new());
    let sigma = |k: usize| covariance[(k, k)].max(0.0).sqrt();
    let largest = |first: usize| (first..first + 3).map(sigma).fold(0.0, f64::max);
    let count = fit.used.iter().filter(|used| **used).count();
    if count < LEAST_BOARD_PICTURES || 2 * count < fit.used.len() {
        reasons.push(Remark::FewBoardPictures { count });
    } else if count < fit.used.len() {
        warnings.push(Remark::PicturesLeftOut { count: fit.used.len() - count });
    }
    let factor = fit.squares_per_freedom.sqrt();
    if exceeds(factor, MOST_DISAGREEMENT) {
        reasons.push(Remark::BoardAndRobotDisagree { factor });
    } else if factor > USUAL_DISAGREEMENT {
        warnings.push(Remark::BoardAndRobotDisagree { factor });
    }
    let (rotation_rad, translation_m) = (largest(HAND_EYE), largest(HAND_EYE + 3));
    if exceeds(rotation_rad, MOST_ROTATION_SIGMA_RAD) || exceeds(translation_m, MOST_TRANSLATION_SIGMA_M) {
        reasons.push(Remark::HandEyeUncertain { rotation_rad, translation_m });
    }
    if exceeds(sigma(TIME_OFFSET), MOST_TIME_OFFSET_SIGMA_S) {
        reasons.push(Remark::TimeOffsetUncertain { sigma_s: sigma(TIME_OFFSET) });
    }
    (reasons, warnings)
}

/// Pictures with a false stripe.
#[must_use]
pub fn stripes_left_out(fit: &JointFit) -> Vec<Remark> {
    (fit.left_out > 0).then_some(Remark::PicturesLeftOut { count: fit.left_out }).into_iter().collect()
}

/// Boards that lie off the plane by more than noise explains.
#[must_use]
pub fn doubtful_boards(fit: &PlaneFit) -> Vec<Remark> {
    let worst = |z: [f64; 2]| if z[0].abs() > z[1].abs() { z[0] } else { z[1] };
    let boards = fit.boards.iter().enumerate().map(|(index, board)| (index, worst(board.z)));
    boards.filter(|(_, z)| z.abs() > DOUBTFUL).map(|(index, z)| Remark::BoardDoubtful { index, z }).collect()
}
