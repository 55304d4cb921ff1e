//! References of welds: the stored calibration, and the usual place of each part's seams.

use crate::parameters::{CALIBRATION, ROTATION, SHAPE, TRANSLATION, UNITS};
use crate::quadratic::Quadratic;
use nalgebra::{DMatrix, DVector, Vector3, Vector4};
use trueline_dataset::Guess;
use trueline_dataset::result_file::ResultFile;
use trueline_geometry::{Line, so3};
use trueline_method::input::timestamps::Dejittered;

/// A stored calibration as the detector needs it.
#[derive(Clone, Debug)]
pub struct Reference {
    /// Time offset and hand-eye transform.
    pub guess: Guess,
    /// The stamps that it was made with.
    pub dejittered: Dejittered,
    /// Uncertainty of its error θ, in [`UNITS`]: the calibration's own covariance.
    pub prior: Quadratic,
    /// Origin of the shape's coordinates, in the sheet, m: fixed by the first weld.
    pub shape_origin_m: [f64; 2],
}

/// Prior standard deviation of unknowns that a calibration does not determine: large, but less than a full turn.
const UNKNOWN: [f64; CALIBRATION] =
    [0.010, 0.0873, 0.0873, 0.0873, 0.010, 0.010, 0.010, 5e-3, 5e-3, 5e-3, 0.15, 0.15];

const NAMES: [[&str; 2]; SHAPE] = [
    ["time_offset_s", "time_offset_s"],
    ["rotation_x_rad", "rotation_x_rad"],
    ["rotation_y_rad", "rotation_y_rad"],
    ["rotation_z_rad", "rotation_z_rad"],
    ["translation_x_m", "translation_x_mm"],
    ["translation_y_m", "translation_y_mm"],
    ["translation_z_m", "translation_z_mm"],
];

impl Reference {
    /// A calibration without uncertainties.
    #[must_use]
    pub fn of_value(guess: Guess, shape_origin_m: [f64; 2]) -> Self {
        let variances = DVector::from_fn(CALIBRATION, |k, _| (UNKNOWN[k] / UNITS[k]).powi(2));
        Self {
            guess,
            dejittered: Dejittered::default(),
            prior: information(DMatrix::from_diagonal(&variances)),
            shape_origin_m,
        }
    }

    /// A calibration with the covariance that its result states.
    #[must_use]
    pub(crate) fn of_result(guess: Guess, result: &ResultFile, shape_origin_m: [f64; 2]) -> Self {
        let regular = |used: &str| used == "regular";
        Self {
            dejittered: Dejittered {
                robot: regular(&result.stamps.robot.stream.used),
                images: regular(&result.stamps.features.stream.used),
            },
            prior: information(with_shape(covariance(result), guess, result, shape_origin_m)),
            ..Self::of_value(guess, shape_origin_m)
        }
    }
}

/// Covariance of θ in [`UNITS`]; unstated values are practically unknown.
fn covariance(result: &ResultFile) -> DMatrix<f64> {
    let stated = &result.covariance;
    // Files have millimetres where the inside has metres.
    let place = |k: usize| {
        let names = NAMES.get(k)?;
        let index = stated.order.iter().position(|name| names.contains(&name.as_str()))?;
        Some((index, if stated.order[index].ends_with("_mm") { 1e-3 } else { 1.0 }))
    };
    let entry = |i: usize, j: usize| {
        let ((row, row_unit), (column, column_unit)) = (place(i)?, place(j)?);
        let value = (*stated.matrix.get(row)?.get(column)?)?;
        Some(value * row_unit * column_unit / (UNITS[i] * UNITS[j]))
    };
    let known = |k: usize| entry(k, k).is_some_and(|variance| variance > 0.0 && variance.is_finite());
    DMatrix::from_fn(CALIBRATION, CALIBRATION, |i, j| match (known(i) && known(j), i == j) {
        (true, _) => entry(i, j).unwrap_or(0.0),
        (false, true) => (UNKNOWN[i] / UNITS[i]).powi(2),
        (false, false) => 0.0,
    })
}

/// The transform of the result belongs to its sensor file, and the welds are corrected by the shape. The
/// uncertainty of the shape moves the transform of the corrected sensor: δω = δω′ − R D_ω δh, δt = δt′ + R p
/// × δω − R D_t δh.
fn with_shape(
    covariance: DMatrix<f64>,
    guess: Guess,
    result: &ResultFile,
    shape_origin_m: [f64; 2],
) -> DMatrix<f64> {
    let Some((d_shape, moved)) = result.sensor.rigid_part.as_ref().and_then(|rigid| {
        Some((rigid.d_shape(shape_origin_m)?, rigid.corrected_from_file()?.translation.vector))
    }) else {
        return covariance;
    };
    let turn = guess.tool_from_camera.rotation.to_rotation_matrix().into_inner();
    let by_shape = [0, 3].map(|row| turn * d_shape.fixed_rows::<3>(row));
    let lever = so3::hat(&(turn * moved));
    let mut slope = DMatrix::identity(CALIBRATION, CALIBRATION);
    slope.view_mut((ROTATION, SHAPE), (3, 5)).copy_from(&-by_shape[0]);
    slope.view_mut((TRANSLATION, ROTATION), (3, 3)).copy_from(&lever);
    slope.view_mut((TRANSLATION, SHAPE), (3, 5)).copy_from(&(-by_shape[1] - lever * by_shape[0]));
    for i in 0..CALIBRATION {
        for j in 0..CALIBRATION {
            slope[(i, j)] *= UNITS[j] / UNITS[i];
        }
    }
    &slope * covariance * slope.transpose()
}

/// Score zero: the stored value is the best guess of itself. Directions without variance are known to a ten-thousandth of
/// a unit, far below the smallest change that a weld can show.
fn information(covariance: DMatrix<f64>) -> Quadratic {
    let eigen = covariance.symmetric_eigen();
    let inverse = eigen.eigenvalues.map(|value| value.max(1e-8).recip());
    let matrix = &eigen.eigenvectors * DMatrix::from_diagonal(&inverse) * eigen.eigenvectors.transpose();
    Quadratic { matrix, vector: DVector::zeros(CALIBRATION) }
}

/// Place of the seams of one kind of part: the chart in which its pieces are compared.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// Its seams, anchored in the middle of the seen points.
    pub lines: Vec<Line>,
}

/// Two pieces with their seams further apart than this are different parts, m.
const SAME_WITHIN_M: f64 = 0.020;
/// The same for directions, rad.
const SAME_WITHIN_RAD: f64 = 0.1;

impl Part {
    /// The middle of all seams, m: the part turns about it.
    #[must_use]
    pub fn middle(&self) -> Vector3<f64> {
        let sum: Vector3<f64> = self.lines.iter().map(|line| *line.anchor()).sum();
        sum / self.lines.len().max(1) as f64
    }

    /// Whether a piece with these seams is one of this part.
    #[must_use]
    pub(crate) fn is_like(&self, seams: &[Line]) -> bool {
        let near = |(a, b): (&Line, &Line)| {
            a.distance(b.anchor()) < SAME_WITHIN_M && a.direction().angle(&b.direction()) < SAME_WITHIN_RAD
        };
        self.lines.len() == seams.len() && self.lines.iter().zip(seams).all(near)
    }

    /// Motion of the seams with the part, 4·seams × 6: from translation (m) and rotation about [`Part::middle`]
    /// (rad), base axes, to (θ₂, θ₃, δ₂, δ₃) of each seam. Of ω × (a − middle) and of the rotation only the part
    /// perpendicular to the seam is visible.
    #[must_use]
    pub fn seams_from_placement(&self) -> DMatrix<f64> {
        let middle = self.middle();
        let mut map = DMatrix::zeros(4 * self.lines.len(), 6);
        for (k, line) in self.lines.iter().enumerate() {
            let axes = line.axes();
            let arm = line.anchor() - middle;
            for (row, axis) in [axes.column(1), axes.column(2)].into_iter().enumerate() {
                let axis: Vector3<f64> = axis.into();
                // axis · (ω × arm) = ω · (arm × axis)
                let lever = arm.cross(&axis);
                for c in 0..3 {
                    map[(4 * k + row, 3 + c)] = axis[c];
                    map[(4 * k + 2 + row, c)] = axis[c];
                    map[(4 * k + 2 + row, 3 + c)] = lever[c];
                }
            }
        }
        map
    }
}

/// The step (θ₂, θ₃, δ₂, δ₃) with which `from` becomes `to`: the inverse of [`Line::retract`].
#[must_use]
pub(crate) fn line_step(from: &Line, to: &Line) -> Vector4<f64> {
    let axes = from.axes();
    let (u1, u2, u3): (Vector3<f64>, Vector3<f64>, Vector3<f64>) =
        (axes.column(0).into(), axes.column(1).into(), axes.column(2).into());
    let direction = to.direction();
    let cross = u1.cross(&direction);
    let angle = cross.norm().atan2(u1.dot(&direction));
    // The turn from u₁ to the direction is about their normal, which is square to u₁: it has no part along it.
    let turn = cross.try_normalize(1e-300).map_or_else(Vector3::zeros, |axis| axis * angle);
    // The point of `to` that lies in the plane through the anchor square to u₁.
    let along = u1.dot(&(from.anchor() - to.anchor())) / u1.dot(&direction);
    let shift = to.anchor() + direction * along - from.anchor();
    Vector4::new(turn.dot(&u2), turn.dot(&u3), shift.dot(&u2), shift.dot(&u3))
}
