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

    /// Points of one block, and their ±, coordinate by coordinate: so the compiler computes several at once.
    #[inline]
    fn place(&self, [a, b]: &[[f64; BLOCK]; 2], points: &mut [[f64; BLOCK]; 3], sigmas: &mut [f64; BLOCK]) {
        let (m, q) = (&self.base_by_sheet, &self.form);
        for (row, coordinates) in points.iter_mut().enumerate() {
            let (by_a, by_b, shift) = (m[(row, 0)], m[(row, 1)], m[(row, 2)]);
            for k in 0..BLOCK {
                coordinates[k] = by_a * a[k] + by_b * b[k] + shift;
            }
        }
        let (aa, ab, ac) = (q[(0, 0)], 2.0 * q[(0, 1)], 2.0 * q[(0, 2)]);
        let (bb, bc, cc) = (q[(1, 1)], 2.0 * q[(1, 2)], q[(2, 2)]);
        for k in 0..BLOCK {
            let variance = a[k] * (aa * a[k] + ab * b[k] + ac) + b[k] * (bb * b[k] + bc) + cc;
            // Rounding may leave less than nothing of a variance that is zero. NaN stays.
            sigmas[k] = if variance < 0.0 { 0.0 } else { variance.sqrt() };
        }
    }
}

/// Points that are placed together.
const BLOCK: usize = 16;

/// Writes a point and its ±, or that there is none; returns whether there is one.
#[inline]
fn answer(point: [f64; 3], sigma_m: f64, into: (&mut [f64; 3], &mut f64)) -> bool {
    let is_good = (point[0] + point[1] + point[2]).is_finite() && sigma_m.is_finite();
    *into.0 = if is_good { point } else { [f64::NAN; 3] };
    *into.1 = if is_good { sigma_m } else { f64::INFINITY };
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
        if let (Points::Profile(readings), Sweep::Still(knot)) = (points, sweep) {
            return self.place_profile(readings, &SheetKnot::of(knot, &self.sheet), base_points, sigma_m);
        }
        let mut out = base_points.iter_mut().zip(sigma_m);
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

    /// The same of a profile that is exposed at once, block by block.
    fn place_profile(
        &self,
        readings: &[[f64; 2]],
        knot: &SheetKnot,
        base_points: &mut [[f64; 3]],
        sigma_m: &mut [f64],
    ) -> usize {
        let (mut readings_of, mut points, mut sigmas) = ([[0.0; BLOCK]; 2], [[0.0; BLOCK]; 3], [0.0; BLOCK]);
        let mut placed = 0;
        let out = base_points.chunks_mut(BLOCK).zip(sigma_m.chunks_mut(BLOCK));
        for (readings, (base_points, sigma_m)) in readings.chunks(BLOCK).zip(out) {
            for (k, reading) in readings.iter().enumerate() {
                [readings_of[0][k], readings_of[1][k]] = self.corrected(*reading);
            }
            knot.place(&readings_of, &mut points, &mut sigmas);
            for (k, into) in base_points.iter_mut().zip(sigma_m).enumerate() {
                placed += usize::from(answer(points.map(|coordinates| coordinates[k]), sigmas[k], into));
            }
        }
        placed
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

/// One point, with the camera at its exposure.
fn placed_at(knot: Option<&Knot>, point: Option<Vector3<f64>>, into: (&mut [f64; 3], &mut f64)) -> bool {
    let Some((point, knot)) = point.zip(knot) else {
        return answer([f64::NAN; 3], f64::NAN, into);
    };
    let point = point.push(1.0);
    let variance = point.dot(&(knot.form * point));
    // Rounding may leave less than nothing of a variance that is zero.
    answer((knot.base_by_point * point).into(), if variance < 0.0 { 0.0 } else { variance.sqrt() }, into)
}
