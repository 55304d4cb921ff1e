//! How a curve is scanned.

use super::kind::CurveKind;
use super::sensor_error::SensorError;
use super::surface::BesideCurve;
use std::f64::consts::PI;

/// How a curve is scanned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurveScan {
    /// The curve.
    pub kind: CurveKind,
    /// How long, s.
    pub lasts_s: f64,
    /// How often over it.
    pub passes: f64,
    /// How far it tilts about three axes, rad.
    pub tilt_rad: f64,
    /// How often it weaves by ±3 mm across the seam, Hz; 0 is not at all.
    pub weave_hz: f64,
    /// Noise of a reading, m per axis.
    pub noise_m: f64,
    /// Noise of a robot's position, m per axis.
    pub robot_noise_m: f64,
    /// Part of the readings that are anywhere within 8 mm.
    pub outliers: f64,
    /// Part of the curve, in its middle, of which there are no readings.
    pub unseen: f64,
    /// Errors of the sensor.
    pub sensor: SensorError,
    /// How far the part moves between passes: standard deviations of shift, m, and turn, rad, about each axis.
    pub part_moves: [f64; 2],
    /// The surfaces beside the seam, if their stripes are measured: the seam point is then where the lines through them meet.
    pub plates: Option<BesideCurve>,
}

impl CurveScan {
    /// A good scan of a curve: 20 s, ±18°, three passes, of a closed curve two.
    #[must_use]
    pub fn good(kind: CurveKind) -> Self {
        let passes = if kind.is_closed() { 2.0 } else { 3.0 };
        Self {
            kind,
            lasts_s: 20.0,
            passes,
            tilt_rad: 18.0 * PI / 180.0,
            weave_hz: 0.0,
            noise_m: 0.04e-3,
            robot_noise_m: 0.02e-3,
            outliers: 0.02,
            unseen: 0.0,
            sensor: SensorError::default(),
            part_moves: [0.0; 2],
            plates: None,
        }
    }

    /// The same without noise and outliers.
    #[must_use]
    pub fn exact(self) -> Self {
        Self { noise_m: 0.0, robot_noise_m: 0.0, outliers: 0.0, ..self }
    }
}
