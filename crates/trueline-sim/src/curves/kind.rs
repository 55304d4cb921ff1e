//! Forms of curved seams, each a formula.

use nalgebra::Vector3;
use std::f64::consts::{PI, TAU};

/// Radii of the saddle's pipe, and of the pipe on which it stands, m.
pub(super) const SADDLE_RADII_M: [f64; 2] = [0.045, 0.08];

/// A form of a seam.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CurveKind {
    /// A straight line, 220 mm long.
    Straight,
    /// An arc of 60°, radius 280 mm.
    Arc,
    /// A whole pipe, radius 50 mm.
    Pipe,
    /// A pipe on a pipe: a closed saddle, radius 45 mm.
    Saddle,
    /// Two lines with a corner of radius 12 mm.
    Corner,
    /// A line with waves of 6 mm.
    Wavy,
    /// A curve in space.
    Free,
    /// A closed figure eight, 140 mm long, that crosses itself at 90°.
    Eight,
}

impl CurveKind {
    /// All of them.
    pub const ALL: [Self; 8] = [
        Self::Straight,
        Self::Arc,
        Self::Pipe,
        Self::Saddle,
        Self::Corner,
        Self::Wavy,
        Self::Free,
        Self::Eight,
    ];

    /// The name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Straight => "straight",
            Self::Arc => "arc",
            Self::Pipe => "pipe",
            Self::Saddle => "saddle",
            Self::Corner => "corner",
            Self::Wavy => "wavy",
            Self::Free => "free",
            Self::Eight => "eight",
        }
    }

    /// Whether its end is its beginning.
    #[must_use]
    pub fn is_closed(self) -> bool {
        matches!(self, Self::Pipe | Self::Saddle | Self::Eight)
    }

    /// The point at a place s, 0 to 1, m, in the part's own frame.
    #[must_use]
    pub fn point(self, s: f64) -> Vector3<f64> {
        let (m, turn) = (s - 0.5, TAU * s);
        match self {
            Self::Straight => Vector3::new(0.22 * m, 0.0, 0.0),
            Self::Arc => {
                let a = PI / 3.0 * m;
                Vector3::new(a.sin(), 1.0 - a.cos(), 0.0) * 0.28
            }
            Self::Pipe => Vector3::new(turn.cos(), turn.sin(), 0.0) * 0.05,
            Self::Saddle => {
                let [r, other] = SADDLE_RADII_M;
                let height = (other.powi(2) - (r * turn.cos()).powi(2)).sqrt() - other;
                Vector3::new(r * turn.cos(), r * turn.sin(), height)
            }
            Self::Corner => corner(m),
            Self::Wavy => {
                Vector3::new(0.24 * m, 0.006 * (TAU * 2.5 * m).sin(), 0.004 * (TAU * 1.7 * m).cos())
            }
            Self::Free => {
                let a = 2.2 * m;
                Vector3::new(0.11 * a, 0.05 * a * a - 0.02 * a.powi(3), 0.025 * (1.9 * a).sin())
            }
            Self::Eight => Vector3::new(turn.sin(), turn.sin() * turn.cos(), 0.0) * 0.07,
        }
    }
}

/// Two lines of 90 mm at 80° with an arc between them.
fn corner(m: f64) -> Vector3<f64> {
    let (radius, angle, arm) = (0.012, 80.0 * PI / 180.0, 0.09);
    let arc = radius * angle;
    let along = m * (2.0 * arm + arc);
    let half = 0.5 * angle;
    let at = |a: f64| Vector3::new(radius * a.sin(), radius * (1.0 - a.cos()), 0.0);
    if along.abs() <= 0.5 * arc {
        return at(along / radius);
    }
    let (end, sign) = (at(half * along.signum()), along.signum());
    end + Vector3::new(half.cos(), sign * half.sin(), 0.0) * (along - sign * 0.5 * arc)
}
