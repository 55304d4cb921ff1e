//! Several sensors on one robot, tied by their common seams.
//!
//! Each sensor's scan is calibrated by itself. Lines with one number are one seam, so the answers share it. With answers x of covariance C, and the
//! distance of the lines d = D x, the joint answer is
//!
//! ```text
//! x ← x − C Dᵀ (D C Dᵀ)⁻¹ d,     C ← C − C Dᵀ (D C Dᵀ)⁻¹ D C,
//! ```
//!
//! This equals one adjustment of all readings, to first order. C also has what two answers share: the same robot errs alike where it stood alike. With
//! columns G of unit variance by the modes of its errors, and the correlation K of two sensors' modes, that is G₁ K G₂ᵀ.

use crate::assess::robot_field::OfRobot;
use crate::calibration::Calibration;
use crate::problem::parameters::{LINES, ROTATION, TIME_OFFSET, TRANSLATION, line_index};
use nalgebra::{DMatrix, DVector, Matrix4, Vector3, Vector4};
use trueline_geometry::{Line, Pose, se3, so3};

/// A sensor's answer, tied to the others.
#[derive(Clone, Debug)]
pub struct TiedSensor {
    /// Its name.
    pub name: String,
    /// Time offset (s) of its readings.
    pub time_offset_s: f64,
    /// Its hand-eye transform.
    pub tool_from_camera: Pose,
    /// Standard deviations of time offset (s), rotation (rad) and translation (m).
    pub sigma: [f64; LINES],
}

/// Pose of one sensor in the frame of another.
#[derive(Clone, Debug)]
pub struct Between {
    /// Name of the sensor whose frame it is.
    pub from: String,
    /// Name of the other.
    pub to: String,
    /// `from_from_to`.
    pub transform: Pose,
    /// Standard deviations of its rotation (rad, axes of `from`) and translation (m).
    pub sigma: [f64; 6],
}

/// All sensors together.
#[derive(Clone, Debug)]
pub struct Tied {
    /// Each sensor, in the order given.
    pub sensors: Vec<TiedSensor>,
    /// Each other sensor in the frame of the first.
    pub between: Vec<Between>,
    /// Distance of the sensors' lines in standard deviations, RMS over the compared numbers.
    pub apart_sigmas: f64,
}

impl Tied {
    /// Whether the sensors disagree about a seam.
    #[must_use]
    pub fn disagrees(&self) -> bool {
        self.apart_sigmas > MOST_SIGMAS
    }
}

/// Largest RMS distance of four numbers of one seam, in standard deviations. Chance exceeds it once in 10⁹.
const MOST_SIGMAS: f64 = 3.5;
/// Lines are compared in two planes perpendicular to the seam, at this distance on either side of its middle, m.
const REACH_M: f64 = 0.05;
/// Steps of the differences, rad and m.
const STEP: f64 = 1e-6;
/// Rounding of the differences between lines, m.
const ROUNDING_M: f64 = 1e-9;

/// Ties sensors of one robot by their seams. Names and calibrations have one order. `None` if a required part of one of them is unobservable.
#[must_use]
pub fn tied(sensors: &[(String, Calibration)]) -> Option<Tied> {
    let lines = sensors.iter().map(|(_, one)| one.best_fit().lines.len()).min()?;
    let size = line_index(lines);
    let is_whole = |one: &Calibration| lines > 0 && (0..size).all(|component| one.is_known(component));
    if !sensors.iter().all(|(_, one)| is_whole(one)) {
        return None;
    }
    let count = sensors.len();
    let mut covariance = DMatrix::zeros(size * count, size * count);
    for (k, (_, one)) in sensors.iter().enumerate() {
        let own = one.findings.unknowns.of_file.covariance.view((0, 0), (size, size)).into_owned();
        covariance.view_mut((size * k, size * k), (size, size)).copy_from(&own);
    }
    add_shared(&mut covariance, sensors, size);
    let (apart, by) = comparison(sensors, lines, size);
    let Joined { step, covariance: tied, apart_sigmas } = joined(&covariance, &apart, &by)?;
    let sensors: Vec<TiedSensor> = sensors
        .iter()
        .enumerate()
        .map(|(k, (name, one))| {
            let three = |first: usize| step.fixed_rows::<3>(size * k + first).into_owned();
            let time_offset_s = one.best_fit().time_offset_s + step[size * k + TIME_OFFSET];
            let (pose, turn, shift) = (one.file_tool_from_camera(), three(ROTATION), three(TRANSLATION));
            TiedSensor {
                name: name.clone(),
                time_offset_s: one.in_recorded_stamps_s(time_offset_s),
                tool_from_camera: se3::retract_decoupled(pose, &turn, &shift),
                sigma: std::array::from_fn(|j| tied[(size * k + j, size * k + j)].sqrt()),
            }
        })
        .collect();
    let between = (1..count).map(|k| between(&sensors, k, &tied, size)).collect();
    Some(Tied { sensors, between, apart_sigmas })
}

/// Adds what two answers share of the robot's errors.
fn add_shared(covariance: &mut DMatrix<f64>, sensors: &[(String, Calibration)], size: usize) {
    let of_robot = |one: &Calibration| {
        let of = &one.findings.unknowns;
        let OfRobot { field, columns } = of.of_robot.as_ref()?;
        let columns = (&of.of_file.slope * columns).rows(0, size).into_owned();
        Some(OfRobot { field: field.clone(), columns })
    };
    let each: Vec<Option<OfRobot>> = sensors.iter().map(|(_, one)| of_robot(one)).collect();
    for (i, one) in each.iter().enumerate() {
        for (j, other) in each.iter().enumerate().skip(i + 1) {
            if let (Some(one), Some(other)) = (one, other) {
                let shared = one.shared_with(other);
                covariance.view_mut((size * i, size * j), (size, size)).copy_from(&shared);
                covariance.view_mut((size * j, size * i), (size, size)).copy_from(&shared.transpose());
            }
        }
    }
}

/// The joint answer.
struct Joined {
    step: DVector<f64>,
    covariance: DMatrix<f64>,
    apart_sigmas: f64,
}

/// The step that makes answers agree, from their covariance, their distance and its Jacobian. `None` without a solution.
fn joined(covariance: &DMatrix<f64>, apart: &DVector<f64>, by: &DMatrix<f64>) -> Option<Joined> {
    let gain = covariance * by.transpose();
    let mut of_apart = by * &gain;
    for k in 0..of_apart.nrows() {
        of_apart[(k, k)] += ROUNDING_M.powi(2);
    }
    let factor = of_apart.cholesky()?;
    Some(Joined {
        step: -(&gain * factor.solve(apart)),
        covariance: covariance - &gain * factor.solve(&gain.transpose()),
        apart_sigmas: (apart.dot(&factor.solve(apart)) / apart.len() as f64).sqrt(),
    })
}

/// Distance of each sensor's lines from those of the first, with its Jacobian by all unknowns.
fn comparison(sensors: &[(String, Calibration)], lines: usize, size: usize) -> (DVector<f64>, DMatrix<f64>) {
    let rows = 4 * lines * (sensors.len() - 1);
    let (mut apart, mut by) = (DVector::zeros(rows), DMatrix::zeros(rows, size * sensors.len()));
    for line in 0..lines {
        let first = &sensors[0].1.best_fit().lines[line];
        let (place, slopes) = crossings(first, first);
        for (k, (_, sensor)) in sensors.iter().enumerate().skip(1) {
            let other = &sensor.best_fit().lines[line];
            let (there, other_slopes) = crossings(first, other);
            let row = 4 * (lines * (k - 1) + line);
            apart.rows_mut(row, 4).copy_from(&(there - place));
            by.view_mut((row, line_index(line)), (4, 4)).copy_from(&-slopes);
            by.view_mut((row, size * k + line_index(line)), (4, 4)).copy_from(&other_slopes);
        }
    }
    (apart, by)
}

/// Intersections of a line with two planes perpendicular to a seam, in its two cross directions, m, with the Jacobian by the line.
fn crossings(seam: &Line, line: &Line) -> (Vector4<f64>, Matrix4<f64>) {
    let axes = seam.axes();
    let place = |line: &Line| {
        let at = |along_m: f64| {
            let in_seam = axes.tr_mul(&(line.anchor() - seam.anchor()));
            let direction = axes.tr_mul(&line.direction());
            let crossing: Vector3<f64> = in_seam + direction * ((along_m - in_seam.x) / direction.x);
            [crossing.y, crossing.z]
        };
        let [near, far] = [at(-REACH_M), at(REACH_M)];
        Vector4::new(near[0], near[1], far[0], far[1])
    };
    let slope = |k: usize| {
        let step = Vector4::from_fn(|j, _| if j == k { STEP } else { 0.0 });
        (place(&line.retract(&step)) - place(&line.retract(&-step))) / (2.0 * STEP)
    };
    (place(line), Matrix4::from_columns(&[slope(0), slope(1), slope(2), slope(3)]))
}

/// Pose of a sensor in the frame of the first. T₁ and T₂ are perturbed on their left by (δ, τ), rotation and translation separately. Then
/// `T₁⁻¹ T₂` rotates by R₁ᵀ (δ₂ − δ₁) and moves by R₁ᵀ (τ₂ − τ₁ + (t₂ − t₁) × δ₁).
fn between(sensors: &[TiedSensor], k: usize, covariance: &DMatrix<f64>, size: usize) -> Between {
    let (one, other) = (&sensors[0], &sensors[k]);
    let into_one = one.tool_from_camera.rotation.inverse().to_rotation_matrix().into_inner();
    let lever = other.tool_from_camera.translation.vector - one.tool_from_camera.translation.vector;
    let mut by = DMatrix::zeros(6, covariance.ncols());
    let second = size * k;
    by.view_mut((0, ROTATION), (3, 3)).copy_from(&-into_one);
    by.view_mut((0, second + ROTATION), (3, 3)).copy_from(&into_one);
    by.view_mut((3, TRANSLATION), (3, 3)).copy_from(&-into_one);
    by.view_mut((3, second + TRANSLATION), (3, 3)).copy_from(&into_one);
    by.view_mut((3, ROTATION), (3, 3)).copy_from(&(into_one * so3::hat(&lever)));
    let own = &by * covariance * by.transpose();
    Between {
        from: one.name.clone(),
        to: other.name.clone(),
        transform: one.tool_from_camera.inverse() * other.tool_from_camera,
        sigma: std::array::from_fn(|j| own[(j, j)].sqrt()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::UnitVector3;

    /// Two lengths of one thing, 1.0 ± 0.1 and 1.3 ± 0.2 m, are 1.06 ± 0.089 m: the mean by their weights, 100 and 25 of 125.
    #[test]
    fn joined_answers_agree_at_the_weighted_mean() {
        let covariance = DMatrix::from_diagonal(&DVector::from_vec(vec![0.01, 0.04]));
        let (apart, by) = (DVector::from_vec(vec![0.3]), DMatrix::from_row_slice(1, 2, &[-1.0, 1.0]));
        let joined = joined(&covariance, &apart, &by).unwrap_or_else(|| unreachable!("it has a solution"));
        assert!((joined.step[0] - 0.06).abs() < 1e-12 && (joined.step[1] + 0.24).abs() < 1e-12);
        for (i, j) in [(0, 0), (0, 1), (1, 1)] {
            assert!((joined.covariance[(i, j)] - 0.008).abs() < 1e-12, "{}", joined.covariance);
        }
        // 0.3 of √0.05.
        assert!((joined.apart_sigmas - 0.3 / 0.05_f64.sqrt()).abs() < 1e-9);
    }

    /// The comparison of two lines is how far the other is from the first, seen from the first: a step of it brings them together.
    #[test]
    fn lines_are_compared_in_the_direction_in_which_they_are_apart() {
        let direction = UnitVector3::new_normalize(Vector3::new(0.2, 0.9, 0.4));
        let seam = Line::new(Vector3::new(0.4, -0.2, 0.1), &direction);
        let step = Vector4::new(0.002, -0.001, 0.0015, 0.0005);
        let (here, slopes) = crossings(&seam, &seam);
        let (there, _) = crossings(&seam, &seam.retract(&step));
        // Beyond the first order a lean of 2 mrad moves a crossing 50 mm away by 0.1 µm.
        assert!((there - here - slopes * step).amax() < 1e-5);
        assert!((there - here).amax() > 1e-4);
    }

    /// Derivatives of the transform between two sensors, against differences.
    #[test]
    fn between_moves_as_differences_say() {
        let pose = |k: f64| {
            se3::from_parts(
                so3::exp(&Vector3::new(k.sin(), 0.4 * k, -0.3)),
                Vector3::new(0.1 * k, -0.05, 0.2),
            )
        };
        let sensor = |tool_from_camera: Pose| TiedSensor {
            name: String::new(),
            time_offset_s: 0.0,
            tool_from_camera,
            sigma: [0.0; LINES],
        };
        for k in (0..2 * LINES).filter(|k| k % LINES >= ROTATION) {
            let (number, component) = (k / LINES, k % LINES);
            // With unit variance in a single number the standard deviations are the slopes.
            let mut covariance = DMatrix::zeros(2 * LINES, 2 * LINES);
            covariance[(k, k)] = 1.0;
            let sensors = [sensor(pose(1.0)), sensor(pose(2.0))];
            let found = between(&sensors, 1, &covariance, LINES).sigma;
            let moved = |step: f64| {
                let mut poses = [pose(1.0), pose(2.0)];
                let three =
                    |first: usize| Vector3::from_fn(|j, _| if first + j == component { step } else { 0.0 });
                poses[number] = se3::retract_decoupled(&poses[number], &three(ROTATION), &three(TRANSLATION));
                poses[0].inverse() * poses[1]
            };
            let (turn, shift) = se3::difference_decoupled(&moved(1e-6), &moved(-1e-6));
            for j in 0..3 {
                assert!((found[j] - turn[j].abs() / 2e-6).abs() < 1e-6, "{k} {j}");
                assert!((found[3 + j] - shift[j].abs() / 2e-6).abs() < 1e-6, "{k} {j}");
            }
        }
    }
}
