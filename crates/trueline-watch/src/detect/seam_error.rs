//! Effect of a change on the points that are measured next: their error in directions that a person can point at.
//!
//! Each seam point of a weld moves by D δ with a change δ of θ. Root mean squares over the weld come from M =
//! mean(dᵀ d), where d is the row of D along one axis of the sensor. The sign is that of the mean movement,
//! if there is one.

use super::change::Change;
use super::sensor_axes::SensorAxes;
use crate::innovation::linearized::d_point_d_shape;
use crate::parameters::{
    CALIBRATION, Kind, PART_ROTATION, PART_TRANSLATION, ROTATION, SHAPE, TIME_OFFSET, TRANSLATION,
};
use crate::reference::Part;
use nalgebra::{DMatrix, DVector, SMatrix, SVector, Vector2};
use trueline_method::evaluate::placed_features::PlacedFeatures;

/// How seam points move with θ, by axis of the sensor (across, along, depth).
#[derive(Clone, Debug)]
pub struct Movement {
    mean: [SVector<f64, CALIBRATION>; 3],
    square: [SMatrix<f64, CALIBRATION, CALIBRATION>; 3],
    points: usize,
}

/// Errors of seam points, each with its standard deviation, m; `None` if the welds do not determine it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SeamError {
    /// By [`super::sensor_axes::AXES`], root mean square over a weld; nothing for a displaced part.
    pub by_axis: [Option<[f64; 2]>; 3],
    /// Root mean square of all visible parts, at least zero; a displaced part counts perpendicular to its seams.
    pub total: Option<[f64; 2]>,
}

impl SeamError {
    /// Whether these welds determine all of it, along every axis. A displaced part does not count along its seams.
    #[must_use]
    pub fn is_shown_whole(&self) -> bool {
        let shown = self.by_axis.iter().flatten().count();
        shown == 3 || shown == 0 && self.total.is_some()
    }
}

impl Default for Movement {
    fn default() -> Self {
        Self { mean: [SVector::zeros(); 3], square: [SMatrix::zeros(); 3], points: 0 }
    }
}

impl Movement {
    /// From the seam points of a weld; the shape of the laser plane has its origin at `shape_origin_m` in the sheet.
    #[must_use]
    pub(crate) fn of(features: &PlacedFeatures, axes: &SensorAxes, shape_origin_m: [f64; 2]) -> Self {
        let mut all = Self::default();
        for feature in &features.list {
            let jacobian = feature.placement.jacobian(&feature.point_in_camera);
            let tool_from_base = feature.placement.base_from_tool.rotation.inverse().to_rotation_matrix();
            let axes_from_base = axes.tool_from_axes.transpose() * tool_from_base.into_inner();
            let mut by_axis = SMatrix::<f64, 3, CALIBRATION>::zeros();
            by_axis.set_column(TIME_OFFSET, &(axes_from_base * jacobian.d_point_d_time_offset));
            by_axis
                .fixed_columns_mut::<3>(ROTATION)
                .copy_from(&(axes_from_base * jacobian.d_point_d_rotation));
            by_axis
                .fixed_columns_mut::<3>(TRANSLATION)
                .copy_from(&(axes_from_base * jacobian.d_point_d_translation));
            let at = features.sheet.coordinates(&feature.point_in_camera) - Vector2::from(shape_origin_m);
            // The sheet has no direction along the seam.
            let in_sheet = d_point_d_shape(&at);
            by_axis.fixed_view_mut::<1, 5>(0, SHAPE).copy_from(&in_sheet.row(0));
            by_axis.fixed_view_mut::<1, 5>(2, SHAPE).copy_from(&in_sheet.row(1));
            all.add(&by_axis);
        }
        all
    }

    /// Adds a point, by its movement along each axis.
    pub fn add(&mut self, by_axis: &SMatrix<f64, 3, CALIBRATION>) {
        self.points += 1;
        for axis in 0..3 {
            let row = by_axis.row(axis).transpose();
            self.mean[axis] += row;
            self.square[axis] += row * row.transpose();
        }
    }

    /// Displacement of seam points by a change of the calibration or of a part.
    #[must_use]
    pub fn by(&self, change: &Change, part: &Part) -> SeamError {
        if change.kind == Kind::Seam {
            return SeamError { by_axis: [None; 3], total: change.root_mean_square(&placement_square(part)) };
        }
        let columns = change.kind.columns();
        let count = self.points.max(1) as f64;
        let own = |axis: usize| {
            let square =
                self.square[axis].view((columns.start, columns.start), (columns.len(), columns.len()));
            DMatrix::from_fn(columns.len(), columns.len(), |i, j| square[(i, j)] / count)
        };
        let mut shown = DMatrix::zeros(columns.len(), columns.len());
        let by_axis = [0, 1, 2].map(|axis| {
            let square = own(axis);
            let [size, sigma] = change.root_mean_square(&square)?;
            shown += square;
            let mean = DVector::from_fn(columns.len(), |k, _| self.mean[axis][columns.start + k] / count);
            let signed = change.combination(mean.as_slice()).map_or(0.0, |[value, _]| value);
            Some([if signed < 0.0 { -size } else { size }, sigma])
        });
        let total = by_axis.iter().any(Option::is_some).then(|| change.root_mean_square(&shown)).flatten();
        SeamError { by_axis, total }
    }
}

/// M of a part: displacement of its seams perpendicular to themselves, with equal weights.
fn placement_square(part: &Part) -> DMatrix<f64> {
    let map = part.seams_from_placement();
    let offsets: Vec<usize> = (0..map.nrows()).filter(|row| row % 4 >= 2).collect();
    let rows = map.select_rows(&offsets);
    debug_assert_eq!(rows.ncols(), PART_ROTATION + 3 - PART_TRANSLATION);
    rows.transpose() * &rows / part.lines.len().max(1) as f64
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use crate::detect::change::Confidence;
    use crate::parameters::UNITS;
    use crate::quadratic::Quadratic;
    use nalgebra::Vector3;

    const SIGMA_M: f64 = 2e-6;

    /// Place of a point of the camera after a change of the bracket. The gradient is by differences, so no
    /// formula of the code is used.
    fn moved(x: &[f64], point_m: &Vector3<f64>) -> Vector3<f64> {
        trueline_geometry::so3::exp(&Vector3::new(x[0], x[1], x[2])) * point_m
            + Vector3::new(x[3], x[4], x[5])
    }

    fn gradient(point_m: &Vector3<f64>) -> SMatrix<f64, 3, CALIBRATION> {
        SMatrix::from_fn(|i, j| {
            let step = |h: f64| {
                let mut x = [0.0; 6];
                if let Some(own) = j.checked_sub(ROTATION).and_then(|k| x.get_mut(k)) {
                    *own = h;
                }
                moved(&x, point_m)[i]
            };
            (step(1e-6) - step(-1e-6)) / 2e-6
        })
    }

    /// A sensor that turns about the seam point leaves the point in place. Welds that view only this point determine only its
    /// place: the information below is that of a point, J Jᵀ, of rank three.
    #[test]
    fn the_seam_point_is_known_where_shift_and_turn_are_not() {
        let point_m = Vector3::new(0.02, -0.05, 0.13);
        let delta = [1e-3, -2e-3, 5e-4, 2e-4, 1e-4, -3e-4];
        let (turn, shift) =
            (Vector3::from_column_slice(&delta[..3]), Vector3::from_column_slice(&delta[3..]));
        let known = turn.cross(&point_m) + shift;
        let units = &UNITS[Kind::Bracket.columns()];
        let own = gradient(&point_m);
        let jacobian = DMatrix::from_fn(3, 6, |i, j| own[(i, ROTATION + j)] * units[j] / SIGMA_M);
        let matrix = jacobian.transpose() * &jacobian;
        let change = DVector::from_fn(6, |k, _| delta[k] / units[k]);
        let evidence = Quadratic { vector: &matrix * change, matrix };
        let confidence = Confidence { noise_freedom: 1e6, taught_by: 0, dispersion: 1.0, pieces: 1 };
        let bracket = Change::of(Kind::Bracket, &evidence, None, confidence);
        assert!(bracket.value.iter().all(Option::is_none), "shift and turn are not separated: {bracket:?}");
        let mut movement = Movement::default();
        movement.add(&own);
        let found = movement.by(&bracket, &Part { lines: Vec::new() });
        for (found, known) in found.by_axis.into_iter().zip(known.iter()) {
            let [value, sigma] = found.unwrap();
            // A shift of a unit along each axis has one standard deviation of 2 µm; rounding of the differences is 1e-9 of it.
            assert!(
                (value - known).abs() < 1e-9 && (sigma / SIGMA_M - 1.0).abs() < 1e-6,
                "{value} {known} {sigma}"
            );
        }
        let [total, sigma] = found.total.unwrap();
        assert!((total - known.norm()).abs() < 1e-9 && (sigma / SIGMA_M - 1.0).abs() < 1e-6);
    }

    /// Points at both sides move apart when the sensor's widths change: nothing on average, and yet each lies off.
    #[test]
    fn points_that_move_apart_have_a_root_mean_square() {
        let mut movement = Movement::default();
        for across_m in [-0.003, 0.003] {
            let mut by_axis = SMatrix::zeros();
            by_axis[(0, SHAPE)] = across_m;
            movement.add(&by_axis);
        }
        let mut matrix = DMatrix::zeros(5, 5);
        matrix[(0, 0)] = 100.0;
        let evidence = Quadratic { vector: &matrix * DVector::from_element(5, 2.0), matrix };
        let confidence = Confidence { noise_freedom: 1e6, taught_by: 0, dispersion: 1.0, pieces: 1 };
        let sensor = Change::of(Kind::Sensor, &evidence, None, confidence);
        let found = movement.by(&sensor, &Part { lines: Vec::new() });
        // Two units of 0.3 % of 3 mm, known to a tenth of a unit.
        let [value, sigma] = found.by_axis[0].unwrap();
        assert!((value - 2.0 * 3e-3 * 3e-3).abs() < 1e-12 && (sigma - 0.1 * 9e-6).abs() < 1e-12);
        assert_eq!(found.by_axis[1], Some([0.0, 0.0]), "no direction along the seam");
        assert_eq!(found.total, Some([value, sigma]));
    }

    /// A straight weld at one attitude determines nothing along itself: an error there may have any size.
    #[test]
    fn an_axis_that_is_not_shown_leaves_the_error_open() {
        let some = Some([1e-4, 1e-5]);
        let whole = |by_axis, total| SeamError { by_axis, total }.is_shown_whole();
        assert!(whole([some; 3], some) && whole([None; 3], some));
        assert!(!whole([some, None, some], some) && !whole([None; 3], None));
    }
}
