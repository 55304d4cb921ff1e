//! Mistakes with a number of their own, which the scan tells: how far a picture was cut out, by how much an axis is too long.

use crate::calibrate::calibrate;
use crate::config::{Config, SensorMode};
use crate::diagnose::mistake::with_pixels;
use crate::diagnose::pose_mistakes::with_axis_scaled;
use crate::diagnose::quick_fit::quick_fit;
use nalgebra::Vector2;
use trueline_dataset::sensor_setup::SensorUncertainty;
use trueline_dataset::{Measured, Recording, Sensor};

/// A mistake that was estimated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Estimated {
    /// Pixels are of a picture that was cut out of the sensor's: its corner there, px.
    Crop([f64; 2]),
    /// An axis of the robot's positions is too long by this factor.
    AxisScale {
        /// x, y or z.
        axis: usize,
        /// Longer than it is.
        factor: f64,
    },
}

impl Estimated {
    /// Short name.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Crop(_) => "cropped images",
            Self::AxisScale { axis, .. } => ["robot x scaled", "robot y scaled", "robot z scaled"][*axis],
        }
    }

    /// What was probably done, and what to do about it.
    #[must_use]
    pub fn says(&self) -> String {
        match self {
            Self::Crop([u, v]) => format!(
                "the pixels are of a picture that was cut out of the sensor's at about ({u:.0}, {v:.0}) px: add the corner of \
                 the region of interest to them, or take it from the principal point"
            ),
            Self::AxisScale { axis, factor } => format!(
                "the robot's {} is {:+.2} % too long: check its scale, and the calibration of that axis",
                ["x", "y", "z"][*axis],
                100.0 * (factor - 1.0)
            ),
        }
    }

    /// The recording without it.
    #[must_use]
    pub fn mend(&self, recording: &Recording) -> Option<Recording> {
        match *self {
            Self::Crop([u0, v0]) => with_pixels(recording, |[u, v], _| [u + u0, v + v0]),
            Self::AxisScale { axis, factor } => Some(with_axis_scaled(recording, axis, 1.0 / factor)),
        }
    }
}

/// How far the principal point may be off where a picture was cut out, px: a fifth of a large sensor.
const CROP_SIGMA_PX: f64 = 500.0;
/// A smaller cut is an ordinary error of the principal point, px.
const LEAST_CROP_PX: f64 = 40.0;
/// Rounds in which the pixels are moved by what was found.
const CROP_ROUNDS: usize = 4;

/// The corner of a picture that was cut out, from where the principal point seems to be; `None` if it was not, or if the
/// pixels would not lie in the sensor's picture.
#[must_use]
pub fn crop(recording: &Recording, config: &Config) -> Option<Estimated> {
    let Sensor::CameraLaser { camera, .. } = &recording.sensor else { return None };
    let config = Config { sensor: SensorMode::Prior, ..config.clone() };
    let mut corner = Vector2::zeros();
    for _ in 0..CROP_ROUNDS {
        let mut moved = Estimated::Crop(corner.into()).mend(recording)?;
        moved.setup.uncertainty = Some(SensorUncertainty {
            principal_point_px: Some(CROP_SIGMA_PX),
            ..SensorUncertainty::default()
        });
        let found = calibrate(&moved, None, &config).ok()?;
        let Sensor::CameraLaser { camera: corrected, .. } =
            &found.findings.unknowns.corrected.as_ref()?.sensor
        else {
            return None;
        };
        corner -= corrected.centre - camera.centre;
    }
    let inside = recording.features.iter().all(|feature| match feature.measured {
        Measured::Pixel(uv) => (0..2).all(|k| {
            let there = uv[k] + corner[k];
            (0.0..f64::from(camera.size[k])).contains(&there)
        }),
        _ => false,
    });
    let least = corner.min() > -LEAST_CROP_PX && corner.max() > LEAST_CROP_PX;
    (inside && least).then(|| Estimated::Crop(corner.map(f64::round).into()))
}

/// Distances from the middle at which a scale is tried, first and then about what was found.
const SCALE_STEPS: [f64; 3] = [0.02, 0.01, 0.003];
/// A scale further off is no scale.
const MOST_SCALE: f64 = 0.1;
/// A scale nearer to one is none.
const LEAST_SCALE: f64 = 5e-4;

/// The scale of an axis that leaves the smallest residuals, by a parabola through three of them.
#[must_use]
pub fn axis_scale(recording: &Recording, config: &Config, axis: usize) -> Option<Estimated> {
    let left = |factor: f64| {
        let scaled = Estimated::AxisScale { axis, factor }.mend(recording)?;
        Some(quick_fit(&scaled, config).ok()?.noise_factor.powi(2))
    };
    let mut best = 1.0;
    for step in SCALE_STEPS {
        let [below, here, above] = [left(best - step)?, left(best)?, left(best + step)?];
        let bend = below - 2.0 * here + above;
        if bend <= 0.0 {
            return None;
        }
        best += (0.5 * step * (below - above) / bend).clamp(-2.0 * step, 2.0 * step);
    }
    let off = (best - 1.0_f64).abs();
    (LEAST_SCALE..MOST_SCALE).contains(&off).then_some(Estimated::AxisScale { axis, factor: best })
}
