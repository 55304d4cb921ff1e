//! Start and fit, while the robot moves or stands at stops, from the fact alone that one board stands still.
//!
//! Start: the time offset at which camera and robot turn by the same angles (angles do not depend on the mounting). A
//! closed form for the hand-eye transform follows. Stops have no time offset, and a guess takes the place of either.

use super::joint::{self, BoardFit, ErrorModel, FEWEST};
use super::robot_path::RobotPath;
use super::sighting::{BoardSighting, symmetries};
use super::start::{self, Few};
use crate::board::Board;
use crate::error::Error;
use trueline_geometry::{Pose, Trajectory};

/// Range of the search for the time offset, s.
pub(crate) const REACH_S: f64 = 1.0;
/// Noise of poses that were smoothed over 40 ms is shared by pictures so near to each other, s.
const SHARED_S: f64 = 0.05;
/// Pictures before that may be so near.
const LAGS: usize = 3;

/// Estimates time offset, hand-eye transform and board from sightings of a board that stands still. The stamps (s) are in
/// the time of the trajectory, rising.
///
/// # Errors
/// Too few pictures, motion that does not fix the hand-eye transform, or a robot that does not turn.
pub fn calibrate(
    board: &Board,
    sightings: &[BoardSighting],
    stamps_s: &[f64],
    trajectory: &Trajectory,
    noise: &ErrorModel,
) -> Result<BoardFit, Error> {
    calibrate_along(board, sightings, RobotPath::Moving { trajectory, stamps_s }, noise, None)
}

/// The same along any path of the robot, from a guess of time offset and hand-eye transform if there is one.
///
/// # Errors
/// As [`calibrate`].
pub fn calibrate_along(
    board: &Board,
    sightings: &[BoardSighting],
    robot: RobotPath<'_>,
    noise: &ErrorModel,
    guess: Option<(f64, Pose)>,
) -> Result<BoardFit, Error> {
    if sightings.len() < FEWEST {
        return Err(Error::TooFewPictures { found: sightings.len(), needed: FEWEST });
    }
    let guessed_s = guess.map(|(time_offset_s, _)| time_offset_s);
    let counted = counted_alike(board, sightings, &robot, guessed_s.unwrap_or(0.0));
    let time_offset_s = match (robot, guessed_s) {
        (RobotPath::Stops(_), _) => 0.0,
        (_, Some(guessed_s)) => guessed_s,
        (_, None) => {
            let best = start::offsets_s(&counted, &robot, REACH_S, 1);
            *best.first().ok_or(Error::NoCommonTime)?
        }
    };
    let few = Few::of(&counted, &robot, time_offset_s);
    let start = match guess {
        Some((_, tool_from_camera)) => few.with_hand_eye(tool_from_camera),
        None => few.by_closed_form(),
    };
    let mut fit = joint::fit(&counted, robot, noise, start.ok_or(Error::HandEyeNotFixed)?)?;
    fit.covariance *= correlation(&fit, robot.stamps_s());
    Ok(fit)
}

/// The same at stops, with the noise of the robot that explains the residuals. If they are larger than the stated noise,
/// both parts of the noise are raised equally until the sum of squares equals the degrees of freedom. This is the restricted
/// likelihood's own condition for a variance. It is bounded, so that unrelated boards and poses are not explained as robot
/// noise.
///
/// # Errors
/// As [`calibrate`].
pub fn calibrate_at_stops(
    board: &Board,
    sightings: &[BoardSighting],
    poses: &[Pose],
    stated: &ErrorModel,
    guess: Option<(f64, Pose)>,
) -> Result<(BoardFit, ErrorModel), Error> {
    let raised = |factor: f64| ErrorModel {
        position_m: factor * stated.position_m,
        rotation_rad: factor * stated.rotation_rad,
        ..*stated
    };
    let fitted =
        |noise: &ErrorModel| calibrate_along(board, sightings, RobotPath::Stops(poses), noise, guess);
    let fit = fitted(stated)?;
    if fit.squares_per_freedom <= 1.0 {
        return Ok((fit, *stated));
    }
    let (mut low, mut high) = (0.0, MOST_RAISED.ln());
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if fitted(&raised(middle.exp()))?.squares_per_freedom > 1.0 { low = middle } else { high = middle }
    }
    let noise = raised(high.exp());
    Ok((fitted(&noise)?, noise))
}

/// By how many times the robot's noise at stops may be larger than stated: 0.05 mm of a robot of 0.3 mm become 1 mm.
const MOST_RAISED: f64 = 20.0;
/// Halvings of its logarithm: to a hundredth.
const HALVINGS: usize = 8;

/// Ratio of the variance of a mean over the pictures to that of independent errors: pictures in close sequence share
/// noise of the robot, as its poses are smoothed. 1 + 2 Σ ρ over the first lags.
fn correlation(fit: &BoardFit, stamps_s: &[f64]) -> f64 {
    let at = |k: usize| fit.residuals.get(k).copied().flatten().filter(|_| fit.used[k]);
    let squares: f64 = (0..fit.residuals.len()).filter_map(at).map(|residual| residual.norm_squared()).sum();
    let mut factor = 1.0;
    for lag in 1..=LAGS {
        for k in lag..stamps_s.len() {
            let near = stamps_s[k] - stamps_s[k - lag] < SHARED_S;
            if let (true, Some(a), Some(b)) = (near, at(k), at(k - lag)) {
                factor += 2.0 * a.dot(&b) / squares;
            }
        }
    }
    factor.max(1.0)
}

/// All boards counted from the same corner. A plain board can be counted in several ways: the one counts with a rotation
/// nearest to the robot's since the nearest attitude already counted.
fn counted_alike(
    board: &Board,
    sightings: &[BoardSighting],
    robot: &RobotPath<'_>,
    time_offset_s: f64,
) -> Vec<BoardSighting> {
    let mut counted = sightings.to_vec();
    // An offset hardly matters here: ways of counting differ by a quarter turn at least.
    let attitudes: Vec<_> = (0..sightings.len()).map(|k| robot.attitude(k, time_offset_s)).collect();
    let turn = |a: usize, b: usize| attitudes[a].zip(attitudes[b]).map_or(0.0, |(a, b)| a.angle_to(&b));
    // Boards not counted yet, with the nearest counted one. Each is taken at the smallest rotation of the robot, a few
    // degrees as a rule.
    let mut left: Vec<(usize, usize)> = (1..sightings.len()).map(|k| (k, 0)).collect();
    while let Some(next) = (0..left.len()).min_by(|a, b| {
        let turned = |k: usize| turn(left[k].0, left[k].1);
        turned(*a).total_cmp(&turned(*b))
    }) {
        let (k, near) = left.swap_remove(next);
        let before = counted[near].camera_from_board.rotation;
        let off = |quarters: usize| {
            let turned = sightings[k].turned(board, quarters).camera_from_board.rotation;
            (before.angle_to(&turned) - turn(k, near)).abs()
        };
        let best = symmetries(board).iter().copied().min_by(|a, b| off(*a).total_cmp(&off(*b)));
        counted[k] = sightings[k].turned(board, best.unwrap_or(0));
        for other in &mut left {
            if turn(other.0, k) < turn(other.0, other.1) {
                other.1 = k;
            }
        }
    }
    counted
}
