//! Which motion a cell has, how long it takes and how far it swings.

use super::swing::{Limits, Swing, Swings};
use super::{c_path, hand_guided, planned, s_path, taught, weave};
use crate::noise::Noise;

/// A motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    /// Sines of different frequencies.
    S,
    /// One arc.
    C,
    /// One frequency for everything.
    Weave,
    /// A designed scan.
    Plan,
    /// Taught points.
    Taught,
    /// Guided by hand.
    Hand,
}

/// Motions with their share of the cells (report, by the cells of each motion; C and weaves: own).
const SHARES: [(Motion, f64); 6] = [
    (Motion::S, 0.31),
    (Motion::C, 0.08),
    (Motion::Weave, 0.08),
    (Motion::Plan, 0.13),
    (Motion::Taught, 0.26),
    (Motion::Hand, 0.14),
];
/// Durations, s, and those of designed scans.
const DURATIONS_S: [f64; 2] = [8.0, 90.0];
const PLANNED_S: [f64; 2] = [10.0, 24.0];
/// Tilts about each axis, rad, with small ones more frequent (own: 60 % of the cells are good scans, as in the report).
/// Designed scans have one for each duration.
const TILTS_RAD: [f64; 2] = [2.0 * DEGREE, 25.0 * DEGREE];
const PLANNED_RAD: [f64; 2] = [8.0 * DEGREE, 13.5 * DEGREE];
const DEGREE: f64 = std::f64::consts::PI / 180.0;
/// Lengths of seam, m.
const LENGTHS_M: [f64; 2] = [0.12, 0.42];
/// Part of half the field of view that the seam swings over.
const OF_FIELD: [f64; 2] = [0.3, 0.7];

impl Motion {
    /// The name in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::S => "s",
            Self::C => "c",
            Self::Weave => "weave",
            Self::Plan => "plan",
            Self::Taught => "taught",
            Self::Hand => "hand",
        }
    }

    /// Whether a scan of it can show everything: a C shows too little, a weave looks the same one period later.
    #[must_use]
    pub fn shows_everything(self) -> bool {
        !matches!(self, Self::C | Self::Weave)
    }

    fn drawn(noise: &mut Noise) -> Self {
        let mut left = noise.uniform(0.0, 1.0);
        for (motion, share) in SHARES {
            if left < share {
                return motion;
            }
            left -= share;
        }
        Self::Hand
    }
}

/// The motion of a cell.
pub(crate) struct Course {
    pub(crate) motion: Motion,
    pub(crate) duration_s: f64,
    /// Length of seam that is passed over, m.
    pub(crate) length_m: f64,
    /// How far the seam swings in the sheet, m, and the sensor about it, rad.
    pub(crate) in_sheet_m: [f64; 2],
    pub(crate) tilt_rad: f64,
    swings: Swings,
}

impl Course {
    /// A motion over a field of view: half of its width and depth, m.
    pub(crate) fn drawn(noise: &mut Noise, half_field_m: [f64; 2]) -> Self {
        let motion = Motion::drawn(noise);
        let log_uniform = |noise: &mut Noise, [low, high]: [f64; 2]| noise.uniform(low.ln(), high.ln()).exp();
        let mut duration_s = log_uniform(noise, DURATIONS_S);
        let mut tilt_rad = noise.uniform(TILTS_RAD[0].sqrt(), TILTS_RAD[1].sqrt()).powi(2);
        let is_long = noise.happens(0.7);
        if motion == Motion::Plan {
            duration_s = PLANNED_S[usize::from(is_long)];
            tilt_rad = PLANNED_RAD[usize::from(is_long)];
        }
        let length_m = noise.uniform(LENGTHS_M[0], LENGTHS_M[1]);
        let in_sheet_m = half_field_m.map(|half| half * noise.uniform(OF_FIELD[0], OF_FIELD[1]));
        let limits = Limits { duration_s, in_sheet_m, tilt_rad };
        let draw = match motion {
            Motion::S => s_path::drawn,
            Motion::C => c_path::drawn,
            Motion::Weave => weave::drawn,
            Motion::Plan => planned::drawn,
            Motion::Taught => taught::drawn,
            Motion::Hand => hand_guided::drawn,
        };
        Self { motion, duration_s, length_m, in_sheet_m, tilt_rad, swings: draw(noise, limits) }
    }

    /// Pose of the sensor relative to the seam at a time since the start, s.
    pub(crate) fn at(&self, time_s: f64) -> Swing {
        (self.swings)(time_s)
    }
}
