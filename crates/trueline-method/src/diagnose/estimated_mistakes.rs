//! Mistakes with a size that the scan determines: the corner of a region of interest, the scale of an axis.

use crate::Calibration;
use crate::config::Config;
use crate::diagnose::mistake::{with_image_stamps, with_pixels};
use crate::diagnose::pose_mistakes::with_axis_scaled;
use crate::diagnose::quick_fit::glance;
use crate::diagnose::steps::Budget;
use crate::parallel;
use nalgebra::Vector2;
use trueline_dataset::{Measured, Recording, Sensor};

/// An estimated mistake.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Estimated {
    /// Pixels refer to a crop of the sensor's image, with its corner there, px.
    Crop([f64; 2]),
    /// An axis of the robot's positions is too long by this factor.
    AxisScale {
        /// x, y or z.
        axis: usize,
        /// The factor.
        factor: f64,
    },
    /// Image stamps made with a wrong rate: their distances must be scaled by a factor.
    StampRate {
        /// The factor.
        factor: f64,
        /// Images per second according to their stamps.
        stamped_hz: f64,
    },
}

impl Estimated {
    /// Short name.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Crop(_) => "cropped images",
            Self::AxisScale { axis, .. } => ["robot x scaled", "robot y scaled", "robot z scaled"][*axis],
            Self::StampRate { .. } => "rate of the image stamps",
        }
    }

    /// The probable mistake and its remedy.
    #[must_use]
    pub fn says(&self) -> String {
        match self {
            Self::Crop([u, v]) => format!(
                "the pixels belong to a region of interest whose corner is at about ({u:.0}, {v:.0}) px: add \
                 this to the pixels, or subtract it from the principal point"
            ),
            Self::AxisScale { axis, factor } => format!(
                "the robot's {} is {:+.2} % too long: check its scale, and the calibration of that axis",
                ["x", "y", "z"][*axis],
                100.0 * (factor - 1.0)
            ),
            Self::StampRate { factor, stamped_hz } => format!(
                "the image (or profile) stamps were made with a wrong rate: the sensor runs at {:.2} Hz, \
                 {:.3} times the stamped {stamped_hz:.2} Hz. Give the true rate, or record a stamp with \
                 every image",
                stamped_hz / factor,
                1.0 / factor
            ),
        }
    }

    /// The recording without it.
    #[must_use]
    pub(crate) fn mend(&self, recording: &Recording) -> Option<Recording> {
        match *self {
            Self::Crop([u0, v0]) => with_pixels(recording, |[u, v], _| [u + u0, v + v0]),
            Self::AxisScale { axis, factor } => Some(with_axis_scaled(recording, axis, 1.0 / factor)),
            Self::StampRate { factor, .. } => {
                let first_ns = recording.features.first()?.stamp_ns;
                let since = |stamp_ns: i64| ((stamp_ns - first_ns) as f64 * factor).round() as i64;
                Some(with_image_stamps(recording, |stamp_ns| first_ns + since(stamp_ns)))
            }
        }
    }
}

impl Estimated {
    /// The remaining mistake, from a calibration without it. `None` if nothing remains, or it is not estimated.
    pub(super) fn refined(&self, without: &Calibration) -> Option<Self> {
        let (Self::StampRate { factor, stamped_hz }, Some(drift)) = (*self, without.findings.clock.drifted)
        else {
            return None;
        };
        Some(Self::StampRate { factor: factor / (1.0 + drift.ppm * 1e-6), stamped_hz })
    }
}

/// A smaller crop is an ordinary error of the principal point, px.
const LEAST_CROP_PX: f64 = 40.0;
/// Distance between the corners that start the search, px.
const CROP_STEP_PX: f64 = 250.0;
/// Steps around the best corner, px.
const CROP_STEPS_PX: [f64; 4] = [80.0, 30.0, 10.0, 3.0];

/// The corner of a crop with the smallest residuals. `None` if there is no crop, or if the pixels would lie outside the sensor's image.
#[must_use]
pub(super) fn crop(recording: &Recording, config: &Config, budget: Budget) -> Option<Estimated> {
    let mut corner = nearest_corner(recording, config, budget)?;
    for step in CROP_STEPS_PX {
        for axis in [1, 0, 1, 0] {
            let moved = |to: f64| {
                let mut corner = corner;
                corner[axis] = to;
                left(&Estimated::Crop(corner.into()).mend(recording)?, config, budget)
            };
            corner[axis] = least(moved, corner[axis], step)?;
        }
    }
    let is_crop = corner.min() > -LEAST_CROP_PX && corner.max() > LEAST_CROP_PX;
    (is_crop && is_inside(recording, &corner)).then(|| Estimated::Crop(corner.map(f64::round).into()))
}

/// Squared residuals of a recording, in units of noise. `None` without a result, or without time.
pub(super) fn left(recording: &Recording, config: &Config, budget: Budget) -> Option<f64> {
    if budget.is_spent() {
        return None;
    }
    Some(glance(recording, config).ok()?.left().powi(2))
}

/// Minimum of a function from a parabola through three values, within two steps. `None` if a value is missing.
pub(super) fn least(of: impl Fn(f64) -> Option<f64>, at: f64, step: f64) -> Option<f64> {
    let [below, here, above] = [of(at - step)?, of(at)?, of(at + step)?];
    let bend = below - 2.0 * here + above;
    let downhill = 2.0 * step * (below - above).signum();
    let by = if bend > 0.0 { 0.5 * step * (below - above) / bend } else { downhill };
    Some(at + by.clamp(-2.0 * step, 2.0 * step))
}

/// Whether the shifted pixels lie in the sensor's image, up to the rounding of a corner.
fn is_inside(recording: &Recording, corner: &Vector2<f64>) -> bool {
    let Sensor::CameraLaser { camera, .. } = &recording.sensor else { return false };
    recording.features.iter().all(|feature| match feature.measured {
        Measured::Pixel(uv) => (0..2).all(|k| {
            let there = uv[k] + corner[k];
            (-LEAST_CROP_PX..f64::from(camera.size[k]) + LEAST_CROP_PX).contains(&there)
        }),
        _ => false,
    })
}

/// The corner with the best fit, among corners all over the image.
fn nearest_corner(recording: &Recording, config: &Config, budget: Budget) -> Option<Vector2<f64>> {
    let Sensor::CameraLaser { camera, .. } = &recording.sensor else { return None };
    let steps = camera.size.map(|size| (f64::from(size) / CROP_STEP_PX) as u32);
    let corners = (0..steps[1]).flat_map(|v| (0..steps[0]).map(move |u| [u, v]));
    let corners: Vec<Vector2<f64>> = corners
        .map(|corner| Vector2::from(corner.map(f64::from)) * CROP_STEP_PX)
        .filter(|corner| is_inside(recording, corner))
        .collect();
    let (threads, config) = (config.threads, Config { threads: 1, ..config.clone() });
    let tried = parallel::filter_map(threads, &corners, |corner| {
        Some((left(&Estimated::Crop((*corner).into()).mend(recording)?, &config, budget)?, *corner))
    });
    tried.into_iter().min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, corner)| corner)
}

/// Steps of a scale: from the middle, then around the best.
const SCALE_STEPS: [f64; 2] = [0.02, 0.004];
/// Largest plausible error of a scale.
const MOST_SCALE: f64 = 0.1;
/// Least significant error of a scale.
const LEAST_SCALE: f64 = 5e-4;

/// The scale of an axis with the smallest residuals.
#[must_use]
pub(super) fn axis_scale(
    recording: &Recording,
    config: &Config,
    budget: Budget,
    axis: usize,
) -> Option<Estimated> {
    let scaled = |factor: f64| left(&Estimated::AxisScale { axis, factor }.mend(recording)?, config, budget);
    let mut best = 1.0;
    for step in SCALE_STEPS {
        best = least(scaled, best, step)?;
    }
    let off = (best - 1.0_f64).abs();
    (LEAST_SCALE..MOST_SCALE).contains(&off).then_some(Estimated::AxisScale { axis, factor: best })
}
