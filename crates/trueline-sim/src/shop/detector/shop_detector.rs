//! The detector's result for an image.

use super::super::drawn_errors::DrawnErrors;
use super::feature_noise;
use super::other_edge::OtherEdge;
use super::reflections::Reflections;
use super::spatter::Spatter;
use super::{gaps, stretches};
use crate::capture::SheetAxes;
use crate::noise::Noise;
use crate::scenario::SensorModel;
use nalgebra::Vector3;
use trueline_dataset::Measured;

/// Streams of random numbers: noise of features, and where spatter is.
const STREAMS: [u64; 2] = [3911, 3912];
/// Half of the field of view of a camera that measures points, m.
const POINTS_FIELD_M: f64 = 0.025;

/// A feature, and whether it has to do with the seam.
pub(crate) struct Detected {
    pub(crate) measured: Measured,
    pub(crate) is_outlier: bool,
}

/// The detector of a scan.
pub(crate) struct ShopDetector {
    errors: DrawnErrors,
    spatter: Spatter,
    reflections: Reflections,
    other_edge: OtherEdge,
    gaps_s: Vec<[f64; 2]>,
    noise: Noise,
    anywhere: Noise,
}

impl ShopDetector {
    pub(crate) fn new(errors: &DrawnErrors, duration_s: f64, seed: u64) -> Self {
        Self {
            spatter: Spatter::of(errors),
            reflections: Reflections::of(errors, duration_s),
            other_edge: OtherEdge::of(errors, duration_s),
            gaps_s: gaps::of(errors, duration_s),
            noise: Noise::new(seed, STREAMS[0]),
            anywhere: Noise::new(seed, STREAMS[1]),
            errors: errors.clone(),
        }
    }

    /// How far aside of the seam the line is that it follows at a time, m.
    pub(crate) fn aside_m(&self, time_s: f64) -> f64 {
        self.other_edge.aside_m(time_s)
    }

    /// The feature of an image in which the seam is at `seen`; `None` if nothing is found.
    pub(crate) fn detect(
        &mut self,
        seen: Measured,
        time_s: f64,
        sensor: &SensorModel,
        sheet: &SheetAxes,
    ) -> Option<Detected> {
        let measured = self.noisy(seen, sheet);
        let outlier = |measured| Some(Detected { measured, is_outlier: true });
        // Every image draws the same numbers, independent of its findings.
        let spatter = self.spatter.next().then(|| self.anywhere.outlier(sensor, sheet));
        if stretches::at(&self.gaps_s, time_s).is_some() {
            return None;
        }
        if let Some(spatter) = spatter {
            return outlier(spatter);
        }
        if let Some(away) = self.reflections.at(time_s) {
            return outlier(away_from(measured, away, sensor, sheet));
        }
        Some(Detected { measured, is_outlier: self.aside_m(time_s) != 0.0 })
    }

    fn noisy(&mut self, seen: Measured, sheet: &SheetAxes) -> Measured {
        let sigma = feature_noise::sigma(&self.errors, !matches!(seen, Measured::Pixel(_)));
        let [a, b] = [0; 2].map(|_| feature_noise::drawn(&mut self.noise, sigma));
        moved(seen, [a, b], sheet)
    }
}

fn moved(seen: Measured, [a, b]: [f64; 2], sheet: &SheetAxes) -> Measured {
    match seen {
        Measured::Pixel([u, v]) => Measured::Pixel([u + a, v + b]),
        Measured::Profile([x, z]) => Measured::Profile([x + a, z + b]),
        Measured::Point(point) => {
            Measured::Point((Vector3::from(point) + sheet.camera_from_sheet * Vector3::new(a, 0.0, b)).into())
        }
    }
}

/// A feature moved by parts of half the field of view.
fn away_from(seen: Measured, away: [f64; 2], sensor: &SensorModel, sheet: &SheetAxes) -> Measured {
    let half = match sensor {
        SensorModel::CameraLaser { camera, .. } => camera.size.map(|size| 0.5 * f64::from(size)),
        SensorModel::Profiler { half_width_m, range_m } => [*half_width_m, 0.5 * (range_m[1] - range_m[0])],
        SensorModel::Points { .. } => [POINTS_FIELD_M; 2],
    };
    let away = moved(seen, [away[0] * half[0], away[1] * half[1]], sheet);
    match (away, sensor) {
        // A detector uses only the image.
        (Measured::Pixel([u, v]), SensorModel::CameraLaser { camera, .. }) => {
            let [width, height] = camera.size.map(|size| f64::from(size) - 1.0);
            Measured::Pixel([u.clamp(0.0, width), v.clamp(0.0, height)])
        }
        _ => away,
    }
}
