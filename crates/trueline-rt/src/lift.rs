//! Points of a frame → points in base: the inner loop.

use crate::calibration::{PlacerCalibration, SensorModel};
use crate::points::Points;
use crate::settings::Readout;
use crate::sweep::{Knot, Sweep, after_s};
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
    fn place(&self, [a, b]: [f64; 2], base: &mut [f64; 3], sigma_m: &mut f64) -> bool {
        let (m, q) = (&self.base_by_sheet, &self.form);
        let point = [0, 1, 2].map(|row| m[(row, 0)] * a + m[(row, 1)] * b + m[(row, 2)]);
        let variance = a * (q[(0, 0)] * a + 2.0 * (q[(0, 1)] * b + q[(0, 2)]))
            + b * (q[(1, 1)] * b + 2.0 * q[(1, 2)])
            + q[(2, 2)];
        answer(point, variance, base, sigma_m)
    }
}

/// Writes a point and its ±, or that there is none; returns whether there is one.
#[inline]
fn answer(point: [f64; 3], variance: f64, base: &mut [f64; 3], sigma_m: &mut f64) -> bool {
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
        let out = base_points.iter_mut().zip(sigma_m);
        match (points, sweep.only()) {
            (Points::Profile(points), Some(knot)) => {
                let knot = SheetKnot::of(knot, &self.sheet);
                let mut placed = 0;
                for (reading, (base, sigma_m)) in points.iter().zip(out) {
                    placed += usize::from(knot.place(self.corrected(*reading), base, sigma_m));
                }
                placed
            }
            (Points::Profile(points), None) => {
                let each = points.iter().enumerate().zip(out);
                let there = each.filter_map(|((index, reading), (base, sigma_m))| {
                    let point = self.sheet.point(&Vector2::from(self.corrected(*reading)));
                    placed_at(sweep, after_s(readout, index, *reading), Some(point), base, sigma_m)
                });
                there.count()
            }
            (Points::Pixels(pixels), _) => {
                let each = pixels.iter().enumerate().zip(out);
                let there = each.filter_map(|((index, pixel), (base, sigma_m))| {
                    let after_s = after_s(readout, index, *pixel);
                    placed_at(sweep, after_s, self.of_pixel(*pixel), base, sigma_m)
                });
                there.count()
            }
            (Points::Camera(points), _) => {
                let each = points.iter().enumerate().zip(out);
                let there = each.filter_map(|((index, point), (base, sigma_m))| {
                    let point = self.in_sheet(Vector3::from(*point));
                    placed_at(sweep, after_s(readout, index, [0.0; 2]), Some(point), base, sigma_m)
                });
                there.count()
            }
        }
    }

    /// Corrected place of a point of the sheet that the sensor reports here.
    #[inline]
    fn corrected(&self, reading: [f64; 2]) -> [f64; 2] {
        self.shape.map_or(reading, |shape| shape.corrected(&Vector2::from(reading)).0.into())
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

/// One point of a frame that is read out over a time.
fn placed_at(
    sweep: &Sweep,
    after_s: f64,
    point: Option<Vector3<f64>>,
    base: &mut [f64; 3],
    sigma_m: &mut f64,
) -> Option<()> {
    let Some((point, knot)) = point.zip(sweep.at(after_s)) else {
        answer([f64::NAN; 3], f64::NAN, base, sigma_m);
        return None;
    };
    let point = point.push(1.0);
    let variance = point.dot(&(knot.form * point));
    answer((knot.base_by_point * point).into(), variance, base, sigma_m).then_some(())
}
