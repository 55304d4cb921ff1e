//! Pose of the sensor relative to the seam.

use crate::noise::Noise;
use std::f64::consts::TAU;

/// A place of the sensor at the seam.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Swing {
    /// Place along the scan, from −½ to ½.
    pub(crate) progress: f64,
    /// Place of the seam along the stripe, and in range, from the middle of the field, m.
    pub(crate) in_sheet_m: [f64; 2],
    /// Work angle, travel angle and spin, rad.
    pub(crate) tilt_rad: [f64; 3],
}

/// How far a motion may swing.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Limits {
    /// Duration, s.
    pub(crate) duration_s: f64,
    /// Along the stripe and in range, m.
    pub(crate) in_sheet_m: [f64; 2],
    /// About each axis, rad.
    pub(crate) tilt_rad: f64,
}

/// A motion: its swing at a time since the start, s.
pub(crate) type Swings = Box<dyn Fn(f64) -> Swing + Send + Sync>;

/// Amplitude, frequency (Hz) and phase (rad).
#[derive(Clone, Copy, Debug)]
pub(super) struct Wave(pub(super) f64, pub(super) f64, pub(super) f64);

impl Wave {
    /// A wave of random phase.
    pub(super) fn drawn(noise: &mut Noise, amplitude: f64, hz: f64) -> Self {
        Self(amplitude, hz, noise.uniform(0.0, TAU))
    }

    /// Its value at a time, s.
    pub(super) fn at(&self, time_s: f64) -> f64 {
        self.0 * (TAU * self.1 * time_s + self.2).sin()
    }
}

/// Progress at constant speed.
pub(super) fn even(time_s: f64, limits: &Limits) -> f64 {
    time_s / limits.duration_s - 0.5
}
