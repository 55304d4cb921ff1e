//! Welding joints as cross-sections.

use super::cross_section::Facet;
use nalgebra::Vector2;

/// How far plates reach from the seam, m: out of any view.
const FAR_M: f64 = 0.5;

/// Distance from the seam at which the stripe's visibility is checked, m.
const BESIDE_M: f64 = 3e-3;

/// Joint type. The seam is the line of the scenario.
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
    /// The outside corner of a block; the seam is where its faces meet.
    Corner {
        /// Angle between the faces, inside the block, rad.
        opening_rad: f64,
    },
    /// A plate over nothing; the seam is its edge.
    Edge,
    /// A step of one part; the seam is its edge, and a second line its foot.
    Step {
        /// Height, m.
        height_m: f64,
        /// How far the riser leans away from upright, rad: towards the light.
        lean_rad: f64,
    },
    /// A groove with a flat root; the seam lies in the middle between its shoulders, which are the two lines.
    Groove {
        /// Distance of the shoulders, m.
        width_m: f64,
        /// Width of the root, m.
        root_m: f64,
        /// Depth, m.
        depth_m: f64,
    },
    /// A block with a V; the seam is where its faces would meet.
    VBlock {
        /// How deep that is below the block's upper surface, m.
        depth_m: f64,
        /// Angle between the faces, rad.
        opening_rad: f64,
        /// Width of the relief slot, m.
        slot_m: f64,
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
            Self::Corner { opening_rad } => {
                let half = 0.5 * opening_rad;
                let face = |side: f64| Vector2::new(side * half.sin(), half.cos()) * FAR_M;
                vec![facet(face(-1.0), Vector2::zeros(), 1.0), facet(Vector2::zeros(), face(1.0), 0.9)]
            }
            Self::Edge => vec![facet(Vector2::new(-FAR_M, 0.0), Vector2::zeros(), 1.0)],
            Self::Step { height_m, lean_rad } => step(height_m, lean_rad),
            Self::Groove { width_m, root_m, depth_m } => groove(width_m, root_m, depth_m),
            Self::VBlock { depth_m, opening_rad, slot_m } => v_block(depth_m, opening_rad, slot_m),
            Self::Plate => vec![facet(Vector2::new(-FAR_M, 0.0), Vector2::new(FAR_M, 0.0), 1.0)],
            Self::Nothing => Vec::new(),
        }
    }
}

impl Joint {
    /// Places of the cross-section beside the seam, m, where the stripe must be bright for the seam to be visible.
    /// None for a joint without a seam.
    #[must_use]
    pub(crate) fn witnesses(&self) -> Vec<Vector2<f64>> {
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
            Self::Corner { .. } => vec![beside(0, true, BESIDE_M), beside(1, false, BESIDE_M)],
            Self::Edge => vec![beside(0, true, BESIDE_M)],
            Self::Step { .. } => {
                vec![beside(0, true, BESIDE_M), beside(1, false, BESIDE_M), beside(2, false, BESIDE_M)]
            }
            Self::Groove { .. } => vec![
                beside(0, true, BESIDE_M),
                beside(1, false, BESIDE_M),
                beside(3, true, BESIDE_M),
                beside(4, false, BESIDE_M),
            ],
            Self::VBlock { .. } => vec![beside(1, true, BESIDE_M), beside(4, false, BESIDE_M)],
            Self::Plate | Self::Nothing => Vec::new(),
        }
    }

    /// Places of its lines in the cross-section, m.
    #[must_use]
    pub fn lines(&self) -> Vec<Vector2<f64>> {
        match *self {
            Self::Step { height_m, lean_rad } => {
                vec![Vector2::zeros(), Vector2::new(height_m * lean_rad.tan(), height_m)]
            }
            Self::Groove { width_m, .. } => {
                vec![Vector2::new(-0.5 * width_m, 0.0), Vector2::new(0.5 * width_m, 0.0)]
            }
            Self::Plate | Self::Nothing => Vec::new(),
            _ => vec![Vector2::zeros()],
        }
    }
}

fn facet(from: Vector2<f64>, to: Vector2<f64>, reflectance: f64) -> Facet {
    Facet { from, to, reflectance }
}

fn step(height_m: f64, lean_rad: f64) -> Vec<Facet> {
    let foot = Vector2::new(height_m * lean_rad.tan(), height_m);
    vec![
        facet(Vector2::new(-FAR_M, 0.0), Vector2::zeros(), 1.0),
        facet(Vector2::zeros(), foot, 0.9),
        facet(foot, Vector2::new(FAR_M, height_m), 0.9),
    ]
}

fn groove(width_m: f64, root_m: f64, depth_m: f64) -> Vec<Facet> {
    let [left, right] = [-0.5, 0.5].map(|side| Vector2::new(side * width_m, 0.0));
    let [root_left, root_right] = [-0.5, 0.5].map(|side| Vector2::new(side * root_m, depth_m));
    vec![
        facet(Vector2::new(-FAR_M, 0.0), left, 1.0),
        facet(left, root_left, 0.9),
        facet(root_left, root_right, 0.7),
        facet(root_right, right, 0.9),
        facet(right, Vector2::new(FAR_M, 0.0), 0.9),
    ]
}

fn v_block(depth_m: f64, opening_rad: f64, slot_m: f64) -> Vec<Facet> {
    let at = |x: f64| Vector2::new(x, -x.abs() / (0.5 * opening_rad).tan());
    let half_width_m = depth_m * (0.5 * opening_rad).tan();
    let [left, right] = [-half_width_m, half_width_m].map(at);
    let [slot_left, slot_right] = [-0.5 * slot_m, 0.5 * slot_m].map(at);
    let deep = Vector2::new(0.0, FAR_M);
    vec![
        facet(Vector2::new(-FAR_M, -depth_m), left, 0.9),
        facet(left, slot_left, 1.0),
        facet(slot_left, slot_left + deep, 0.0),
        facet(slot_right, slot_right + deep, 0.0),
        facet(slot_right, right, 0.9),
        facet(right, Vector2::new(FAR_M, -depth_m), 0.9),
    ]
}
