//! Starts for a robot that stands at each reading. Its readings are few and its tool may be long, so the points form no line before the translation
//! is known.
//!
//! For an assumed attitude R of the sensor and direction v of a line, translation and place of the line follow from a linear problem. With a and b
//! perpendicular to v, each reading c at a pose (R_i, p_i) gives two equations,
//!
//! ```text
//! a·R_i t − α = −a·(R_i R c + p_i),   b·R_i t − β = −b·(R_i R c + p_i).
//! ```
//!
//! Attitudes and directions are tried on a grid for the line with the most readings. The translation of each places the points of the other lines.
//! The trials with the smallest residuals over all lines are the starts.

use crate::input::observations::{Observation, Observations};
use crate::problem::parameters::Parameters;
use crate::problem::placement::placement;
use crate::solve::placed_lines::lines_for;
use nalgebra::{Matrix5, UnitQuaternion, UnitVector3, Vector3, Vector5};
use trueline_dataset::Guess;
use trueline_geometry::{Line, Pose, se3, so3};

/// Rotations about each axis between the attitudes of a cube, rad. With them neighbouring attitudes are within some 25°.
const BETWEEN_RAD: [f64; 3] = [-std::f64::consts::FRAC_PI_6, 0.0, std::f64::consts::FRAC_PI_6];

/// Directions of a line that are tried, half a sphere of them: neighbours are 20° apart.
const DIRECTIONS: usize = 48;

/// Rotation about the pole between successive directions, rad: it fills a sphere evenly.
const GOLDEN_ANGLE_RAD: f64 = 2.399_963_229_728_653;

/// Number of trials of one line that are tested on the other lines.
const PLACED: usize = 31_104;

/// Number of starts that are solved: the residuals of a grid of 20° rank them only roughly.
const FOLLOWED: usize = 3_000;

/// Ridge of the linear problem for each reading, which keeps an unobservable translation small.
const RIDGE: f64 = 1e-9;

/// A reading of the line with the most of them.
struct Reading {
    base_from_tool: Pose,
    point_in_camera: Vector3<f64>,
}

/// The result for an attitude and a direction.
struct Trial {
    mean_square_m2: f64,
    attitude: UnitQuaternion<f64>,
    translation_m: Vector3<f64>,
    line: Line,
}

/// The starts with the smallest residuals.
#[must_use]
pub(crate) fn starts(observations: &Observations, sample: &[Observation]) -> Vec<Parameters> {
    let (line, readings) = most_seen(observations, sample);
    let directions: Vec<UnitVector3<f64>> = (0..DIRECTIONS).map(direction).collect();
    let of_attitude = |attitude: UnitQuaternion<f64>| {
        let readings = &readings;
        directions.iter().filter_map(move |direction| tried(readings, attitude, direction))
    };
    let mut trials: Vec<Trial> = attitudes().into_iter().flat_map(of_attitude).collect();
    trials.sort_by(|a, b| a.mean_square_m2.total_cmp(&b.mean_square_m2));
    trials.truncate(PLACED);
    let mut starts: Vec<(f64, Parameters)> = trials
        .iter()
        .filter_map(|trial| {
            let start = of_trial(observations, sample, (line, trial))?;
            Some((off_lines_m(observations, sample, &start)?, start))
        })
        .collect();
    starts.sort_by(|a, b| a.0.total_cmp(&b.0));
    starts.truncate(FOLLOWED);
    starts.into_iter().map(|(_, start)| start).collect()
}

fn of_trial(
    observations: &Observations,
    sample: &[Observation],
    (line, trial): (usize, &Trial),
) -> Option<Parameters> {
    let tool_from_camera = se3::from_parts(trial.attitude, trial.translation_m);
    let guess = Guess { time_offset_s: 0.0, tool_from_camera };
    let mut lines = lines_for(observations, sample, &guess)?;
    lines[line] = trial.line;
    Some(Parameters::straight(&guess, lines))
}

/// Mean distance of the points from their lines, m.
fn off_lines_m(observations: &Observations, sample: &[Observation], at: &Parameters) -> Option<f64> {
    let (mut sum_m, mut count) = (0.0, 0);
    for o in sample {
        let placement = placement(observations, o, at)?;
        sum_m += at.lines[o.line as usize].offset_of(&placement.point_in_base(&o.point_in_camera)).norm();
        count += 1;
    }
    Some(sum_m / f64::from(count))
}

/// The line with the most readings, and these.
fn most_seen(observations: &Observations, sample: &[Observation]) -> (usize, Vec<Reading>) {
    let at =
        Parameters::straight(&Guess { time_offset_s: 0.0, tool_from_camera: Pose::identity() }, Vec::new());
    let mut of_lines: Vec<Vec<Reading>> = (0..observations.line_count).map(|_| Vec::new()).collect();
    for o in sample {
        if let Some(placement) = placement(observations, o, &at) {
            let base_from_tool = placement.base_from_tool;
            of_lines[o.line as usize].push(Reading { base_from_tool, point_in_camera: o.point_in_camera });
        }
    }
    let most = of_lines.into_iter().enumerate().max_by_key(|(_, readings)| readings.len());
    most.unwrap_or_default()
}

fn attitudes() -> Vec<UnitQuaternion<f64>> {
    let turns = BETWEEN_RAD.into_iter().flat_map(|x| {
        BETWEEN_RAD.into_iter().flat_map(move |y| BETWEEN_RAD.map(|z| so3::exp(&Vector3::new(x, y, z))))
    });
    let between: Vec<UnitQuaternion<f64>> = turns.collect();
    let cube = so3::cube_rotations();
    cube.iter().flat_map(|turn| between.iter().map(move |by| turn * by)).collect()
}

/// The k-th direction of half a sphere.
fn direction(k: usize) -> UnitVector3<f64> {
    let height = (k as f64 + 0.5) / DIRECTIONS as f64;
    let (sin, cos) = (k as f64 * GOLDEN_ANGLE_RAD).sin_cos();
    let radius = (1.0 - height * height).sqrt();
    UnitVector3::new_normalize(Vector3::new(radius * cos, radius * sin, height))
}

/// The best translation and line for an attitude and a direction.
fn tried(readings: &[Reading], attitude: UnitQuaternion<f64>, direction: &UnitVector3<f64>) -> Option<Trial> {
    let line = Line::new(Vector3::zeros(), direction);
    let axes = line.axes();
    let mut normal = Matrix5::<f64>::zeros();
    let (mut right, mut squares) = (Vector5::<f64>::zeros(), 0.0);
    for Reading { base_from_tool, point_in_camera } in readings {
        let turned = base_from_tool.rotation * (attitude * point_in_camera);
        let point = turned + base_from_tool.translation.vector;
        for across in 0..2 {
            let axis: Vector3<f64> = axes.column(1 + across).into();
            let by_translation = base_from_tool.rotation.inverse() * axis;
            let mut row = Vector5::zeros();
            row.fixed_rows_mut::<3>(0).copy_from(&by_translation);
            row[3 + across] = -1.0;
            let wanted = -axis.dot(&point);
            normal += row * row.transpose();
            right += row * wanted;
            squares += wanted * wanted;
        }
    }
    let count = readings.len() as f64;
    for k in 0..5 {
        normal[(k, k)] += RIDGE * count;
    }
    let solved = normal.cholesky()?.solve(&right);
    let mean_square_m2 = (squares - solved.dot(&right)).max(0.0) / count;
    let anchor = axes.column(1) * solved[3] + axes.column(2) * solved[4];
    Some(Trial {
        mean_square_m2,
        attitude,
        translation_m: solved.fixed_rows::<3>(0).into(),
        line: Line::new(anchor, direction),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Exact readings at twelve stops with a long tool: at the true attitude and direction the residuals vanish and the translation is correct.
    #[test]
    fn the_true_attitude_and_direction_leave_nothing() {
        let attitude = so3::exp(&Vector3::new(0.3, -1.2, 2.0));
        let (translation_m, direction) =
            (Vector3::new(0.08, -0.01, 0.27), UnitVector3::new_normalize(Vector3::new(0.9, -0.3, 0.1)));
        let point_on_line = Vector3::new(1.0, 0.2, 0.1);
        let readings: Vec<Reading> = (0..12)
            .map(|k| {
                let of = |phase: f64| (2.1 * f64::from(k) + phase).sin();
                let turn = so3::exp(&(Vector3::new(of(0.0), of(1.0), of(2.0)) * 0.3));
                let point_in_camera = Vector3::new(0.02 * of(3.0), 0.0, 0.1 + 0.01 * of(4.0));
                let in_base = point_on_line + direction.as_ref() * (0.05 * of(5.0));
                let origin = in_base - turn * (attitude * point_in_camera + translation_m);
                Reading { base_from_tool: se3::from_parts(turn, origin), point_in_camera }
            })
            .collect();
        let found = tried(&readings, attitude, &direction);
        let found = found.as_ref().map(|trial| (trial.mean_square_m2, trial.translation_m - translation_m));
        // The ridge biases by 1e-9, relative. Squares of a metre are subtracted.
        assert!(found.is_some_and(|(left, off)| left < 1e-9 && off.norm() < 1e-5), "{found:?}");
        let turned = tried(&readings, attitude * so3::exp(&(Vector3::x() * 0.3)), &direction);
        assert!(turned.is_some_and(|trial| trial.mean_square_m2 > 1e-6));
    }
}
