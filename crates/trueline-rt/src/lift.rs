//! Points of a frame → points in base: the inner loop.

use crate::calibration::{PlacerCalibration, SensorModel};
use crate::points::Points;
use crate::settings::Readout;
use crate::sweep::{Knot, Sweep};
use nalgebra::{Matrix3, Matrix4x3, Vector2, Vector3};
use trueline_model::{LaserSheet, SheetShape};

/// Meaning of the sensor's readings in the camera frame.
#[derive(Clone, Debug)]
pub(crate) struct Lift {
    sensor: SensorModel,
    sheet: LaserSheet,
    shape: Option<SheetShape>,
}

/// A frame in the coordinates of the sheet: a point in base and its variance, by (a, b, 1).
struct SheetKnot {
    base_by_sheet: Matrix3<f64>,
    form: Matrix3<f64>,
}

impl SheetKnot {
    fn of(knot: &Knot, sheet: &LaserSheet) -> Self {
        let mut embedding = Matrix4x3::zeros();
        embedding.fixed_view_mut::<3, 2>(0, 0).copy_from(sheet.axes());
        embedding.fixed_view_mut::<3, 1>(0, 2).copy_from(sheet.origin());
        embedding[(3, 2)] = 1.0;
        Self {
            base_by_sheet: knot.base_by_point * embedding,
            form: embedding.transpose() * knot.form * embedding,
        }
    }

    #[inline]
    fn place(&self, [a, b]: [f64; 2], into: (&mut [f64; 3], &mut f64)) -> bool {
        let (m, q) = (&self.base_by_sheet, &self.form);
        let point = [0, 1, 2].map(|row| m[(row, 0)] * a + m[(row, 1)] * b + m[(row, 2)]);
        let variance = a * (q[(0, 0)] * a + 2.0 * (q[(0, 1)] * b + q[(0, 2)]))
            + b * (q[(1, 1)] * b + 2.0 * q[(1, 2)])
            + q[(2, 2)];
        answer(point, variance, into)
    }
}

/// Writes a point and its ±, or that there is none; returns whether there is one.
#[inline]
fn answer(point: [f64; 3], variance: f64, (base, sigma_m): (&mut [f64; 3], &mut f64)) -> bool {
    let is_good = (point[0] + point[1] + point[2]).is_finite() && variance.is_finite();
    *base = if is_good { point } else { [f64::NAN; 3] };
    // Rounding may leave less than nothing of a variance that is zero.
    *sigma_m = if is_good { variance.max(0.0).sqrt() } else { f64::INFINITY };
    is_good
}

impl Lift {
    pub(crate) fn of(calibration: &PlacerCalibration) -> Self {
        let sensor = calibration.sensor.clone();
        Self { sheet: sensor.sheet(), sensor, shape: calibration.shape }
    }

    /// Whether the sensor reports such points.
    pub(crate) fn takes(&self, points: &Points<'_>) -> bool {
        matches!(
            (&self.sensor, points),
            (SensorModel::Profiler, Points::Profile(_))
                | (SensorModel::CameraLaser { .. }, Points::Pixels(_))
                | (SensorModel::Points { .. }, Points::Camera(_))
        )
    }

    /// Places all points; returns how many could be.
    pub(crate) fn place(
        &self,
        points: Points<'_>,
        sweep: &Sweep,
        readout: Readout,
        base_points: &mut [[f64; 3]],
        sigma_m: &mut [f64],
    ) -> usize {
        let mut out = base_points.iter_mut().zip(sigma_m);
        if let (Points::Profile(readings), Sweep::Still(knot)) = (points, sweep) {
            let knot = SheetKnot::of(knot, &self.sheet);
            let each = readings.iter().zip(out);
            return each
                .filter_map(|(reading, into)| knot.place(self.corrected(*reading), into).then_some(()))
                .count();
        }
        let mut placed = 0;
        let mut place = |after_s: f64, point: Option<Vector3<f64>>| {
            let Some(into) = out.next() else { return };
            placed += usize::from(match sweep {
                Sweep::Still(knot) => placed_at(Some(knot), point, into),
                Sweep::Moving(knots) => placed_at(knots.at(after_s).as_ref(), point, into),
            });
        };
        match points {
            Points::Profile(readings) => {
                for (index, reading) in readings.iter().enumerate() {
                    let point = self.sheet.point(&Vector2::from(self.corrected(*reading)));
                    place(readout.after_s(index, *reading), Some(point));
                }
            }
            Points::Pixels(pixels) => {
                for (index, pixel) in pixels.iter().enumerate() {
                    place(readout.after_s(index, *pixel), self.of_pixel(*pixel));
                }
            }
            Points::Camera(points) => {
                for (index, point) in points.iter().enumerate() {
                    place(readout.after_s(index, [0.0; 2]), Some(self.in_sheet(Vector3::from(*point))));
                }
            }
        }
        placed
    }

    /// Corrected place of a point of the sheet that the sensor reports here.
    #[inline]
    fn corrected(&self, reading: [f64; 2]) -> [f64; 2] {
        match &self.shape {
            None => reading,
            Some(shape) => shape.corrected(&Vector2::from(reading)).0.into(),
        }
    }

    /// Place of a point of the camera frame; a part outside the sheet stays.
    fn in_sheet(&self, point: Vector3<f64>) -> Vector3<f64> {
        let Some(shape) = &self.shape else { return point };
        let reported = self.sheet.coordinates(&point);
        point + self.sheet.axes() * (shape.corrected(&reported).0 - reported)
    }

    fn of_pixel(&self, pixel: [f64; 2]) -> Option<Vector3<f64>> {
        let SensorModel::CameraLaser { camera, .. } = &self.sensor else { return None };
        let pixel = Vector2::from(pixel);
        if !(pixel.x.is_finite() && pixel.y.is_finite()) {
            return None;
        }
        let (ray, _) = camera.ray(&pixel).ok()?;
        Some(self.in_sheet(self.sheet.intersect(&ray)?.0))
    }
}

/// One point, with the camera at its exposure.
fn placed_at(knot: Option<&Knot>, point: Option<Vector3<f64>>, into: (&mut [f64; 3], &mut f64)) -> bool {
    let Some((point, knot)) = point.zip(knot) else {
        return answer([f64::NAN; 3], f64::NAN, into);
    };
    let point = point.push(1.0);
    let variance = point.dot(&(knot.form * point));
    answer((knot.base_by_point * point).into(), variance, into)
}
