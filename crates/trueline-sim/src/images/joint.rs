//! Welding joints as cross-sections.

use super::cross_section::Facet;
use nalgebra::Vector2;

/// How far plates reach from the seam, m: out of any view.
const FAR_M: f64 = 0.5;

/// How far beside the seam it is looked whether the stripe is visible, m.
const BESIDE_M: f64 = 3e-3;

/// What the laser shines on. The seam is the line of the scenario.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Joint {
    /// Two plates that meet at an angle; the seam is where their surfaces meet.
    Fillet {
        /// Angle between the plates, rad.
        opening_rad: f64,
        /// How far the pair is turned about the seam, rad.
        roll_rad: f64,
        /// How much of each plate is missing at the corner, m.
        gap_m: f64,
    },
    /// A plate on a plate; the seam is the upper edge of the upper one.
    Lap {
        /// Thickness of the upper plate, m.
        step_m: f64,
    },
    /// Two plates with bevelled edges; the seam is the bottom of the groove.
    VGroove {
        /// Depth, m.
        depth_m: f64,
        /// Angle between the two faces, rad.
        opening_rad: f64,
    },
    /// Two plates side by side; the seam is the middle between them.
    Butt {
        /// Distance of the plates, m.
        gap_m: f64,
        /// How much deeper the second plate lies, m.
        mismatch_m: f64,
    },
    /// One plate without any joint.
    Plate,
    /// Nothing that the laser could light.
    Nothing,
}

impl Joint {
    /// A fillet of two plates square to each other.
    #[must_use]
    pub fn fillet() -> Self {
        Self::Fillet { opening_rad: std::f64::consts::FRAC_PI_2, roll_rad: 0.0, gap_m: 0.0 }
    }

    /// The surfaces.
    #[must_use]
    pub fn facets(&self) -> Vec<Facet> {
        match *self {
            Self::Fillet { opening_rad, roll_rad, gap_m } => {
                // Towards the sensor is negative y.
                let arm = |side: f64| {
                    let angle = side * 0.5 * opening_rad + roll_rad;
                    Vector2::new(angle.sin(), -angle.cos())
                };
                [(-1.0, 1.0), (1.0, 0.8)]
                    .map(|(side, reflectance)| facet(arm(side) * gap_m, arm(side) * FAR_M, reflectance))
                    .to_vec()
            }
            Self::Lap { step_m } => vec![
                facet(Vector2::new(-FAR_M, 0.0), Vector2::zeros(), 1.0),
                facet(Vector2::zeros(), Vector2::new(0.0, step_m), 0.7),
                facet(Vector2::new(-FAR_M, step_m), Vector2::new(FAR_M, step_m), 0.8),
            ],
            Self::VGroove { depth_m, opening_rad } => {
                let half_width_m = depth_m * (0.5 * opening_rad).tan();
                let (left, right) =
                    (Vector2::new(-half_width_m, -depth_m), Vector2::new(half_width_m, -depth_m));
                vec![
                    facet(Vector2::new(-FAR_M, -depth_m), left, 0.9),
                    facet(left, Vector2::zeros(), 1.0),
                    facet(Vector2::zeros(), right, 1.0),
                    facet(right, Vector2::new(FAR_M, -depth_m), 0.9),
                ]
            }
            Self::Butt { gap_m, mismatch_m } => {
                let (left, right) = (Vector2::new(-0.5 * gap_m, 0.0), Vector2::new(0.5 * gap_m, mismatch_m));
                let deep = Vector2::new(0.0, FAR_M);
                vec![
                    facet(Vector2::new(-FAR_M, 0.0), left, 1.0),
                    facet(left, left + deep, 0.0),
                    facet(right, right + deep, 0.0),
                    facet(right, Vector2::new(FAR_M, mismatch_m), 0.9),
                ]
            }
            Self::Plate => vec![facet(Vector2::new(-FAR_M, 0.0), Vector2::new(FAR_M, 0.0), 1.0)],
            Self::Nothing => Vec::new(),
        }
    }
}

impl Joint {
    /// Places of the cross-section beside the seam, m, where the stripe must be bright for the seam to be visible.
    /// None for what has no seam.
    #[must_use]
    pub fn witnesses(&self) -> Vec<Vector2<f64>> {
        let facets = self.facets();
        let beside = |number: usize, from_end: bool, away_m: f64| {
            let piece = &facets[number];
            let (near, far) = if from_end { (piece.to, piece.from) } else { (piece.from, piece.to) };
            let length_m = (far - near).norm();
            near.lerp(&far, (away_m / length_m).min(0.5))
        };
        match self {
            Self::Fillet { .. } => vec![beside(0, false, BESIDE_M), beside(1, false, BESIDE_M)],
            Self::Lap { .. } => vec![beside(0, true, BESIDE_M)],
            Self::VGroove { .. } => vec![beside(1, true, BESIDE_M), beside(2, false, BESIDE_M)],
            Self::Butt { .. } => vec![beside(0, true, BESIDE_M), beside(3, false, BESIDE_M)],
            Self::Plate | Self::Nothing => Vec::new(),
        }
    }
}

fn facet(from: Vector2<f64>, to: Vector2<f64>, reflectance: f64) -> Facet {
    Facet { from, to, reflectance }
}
