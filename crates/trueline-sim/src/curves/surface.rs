//! The two surfaces beside a curved seam, each a formula.

use super::kind::{CurveKind, SADDLE_RADII_M};
use crate::noise::Noise;
use nalgebra::{Vector2, Vector3};
use std::f64::consts::{FRAC_PI_4, TAU};

/// The surfaces beside a curved seam, and how a profiler looks at them.
///
/// Straight lines through light on bent surfaces meet beside the seam: with these defaults and no noise 0.009 mm (RMS) beside an arc,
/// 0.05 mm beside a pipe and a corner, 0.04 to 0.06 mm beside free and wavy seams, and 0.27 mm beside a saddle. A shorter reach is better.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BesideCurve {
    /// Measured range of each surface, from the seam, m.
    pub reach_m: [f64; 2],
    /// Angle of the view against the wall, square to the seam, rad: from above at 0, into the joint at 45°. From above at
    /// 0 a sensor that tilts looks along the wall.
    pub view_rad: f64,
    /// Waviness of each surface: amplitude of its height at 20 mm from the seam, m; waves of 40 mm along and across.
    pub form_m: f64,
}

impl Default for BesideCurve {
    /// From 2 to 15 mm, seen at 45°, smooth.
    fn default() -> Self {
        Self { reach_m: [0.002, 0.015], view_rad: FRAC_PI_4, form_m: 0.0 }
    }
}

impl BesideCurve {
    /// Direction of the view of a sensor whose y axis is along the seam, both unit vectors; `up` is the part's z axis.
    pub(super) fn view(&self, along: &Vector3<f64>, up: &Vector3<f64>) -> Vector3<f64> {
        let wall = (up - along * along.dot(up)).normalize();
        -(wall * self.view_rad.cos() + along.cross(&wall) * self.view_rad.sin())
    }
}

/// A surface beside a curved seam.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Plate 0: outward of an arc, a pipe or a corner. Beside a saddle it is the pipe of 80 mm radius. In one loop of an
    /// eight it is inside, where it almost meets itself: some frames have no light there.
    Floor,
    /// Plate 1: along the part's z axis, of `Wavy` and `Free` square to the seam.
    Wall,
}

impl Side {
    /// Both, in the order of their numbers.
    pub const BOTH: [Self; 2] = [Self::Floor, Self::Wall];

    /// Number of its plate.
    #[must_use]
    pub fn plate(self) -> u32 {
        match self {
            Self::Floor => 0,
            Self::Wall => 1,
        }
    }
}

impl CurveKind {
    /// The point of a smooth surface beside the seam, m, in the part's own frame, at a place s of the seam and a distance from
    /// it, m. The distance is measured along the surface, square to the seam; along the wall of a saddle it is a height.
    #[must_use]
    pub fn beside(self, side: Side, s: f64, from_seam_m: f64) -> Vector3<f64> {
        place(self, side, s, from_seam_m).point
    }
}

/// A place on a smooth surface.
struct Place {
    point: Vector3<f64>,
    /// Unit normal.
    normal: Vector3<f64>,
}

/// Step of differences along the curve: their error is its square.
const STEP: f64 = 1e-6;

fn place(kind: CurveKind, side: Side, s: f64, from_seam_m: f64) -> Place {
    if (kind, side) == (CurveKind::Saddle, Side::Floor) {
        return on_other_pipe(s, from_seam_m);
    }
    let along = (kind.point(s + STEP) - kind.point(s - STEP)).normalize();
    let up = Vector3::z();
    let wall = if kind == CurveKind::Saddle { up } else { (up - along * along.dot(&up)).normalize() };
    let floor = along.cross(&wall);
    let outward = match side {
        Side::Floor => floor,
        Side::Wall => wall,
    };
    Place { point: kind.point(s) + outward * from_seam_m, normal: along.cross(&outward).normalize() }
}

/// A place on the pipe on which a saddle's pipe stands. Its axis is along y; unrolled, the way from the seam is straight.
fn on_other_pipe(s: f64, from_seam_m: f64) -> Place {
    let radius_m = SADDLE_RADII_M[1];
    let unrolled = |s: f64| {
        let point = CurveKind::Saddle.point(s);
        Vector2::new(radius_m * (point.x / radius_m).asin(), point.y)
    };
    let along = (unrolled(s + STEP) - unrolled(s - STEP)).normalize();
    let there = unrolled(s) + Vector2::new(along.y, -along.x) * from_seam_m;
    let normal = Vector3::new((there.x / radius_m).sin(), 0.0, (there.x / radius_m).cos());
    let axis = Vector3::new(0.0, there.y, -radius_m);
    Place { point: axis + normal * radius_m, normal }
}

/// Length of a wave, m; along a closed seam about this.
const WAVE_M: f64 = 0.04;

/// A wavy surface of a cell.
#[derive(Clone, Copy)]
pub(super) struct Surface {
    kind: CurveKind,
    side: Side,
    form_m: f64,
    /// Waves along the whole seam.
    waves: f64,
    phase_rad: f64,
}

impl Surface {
    /// Both surfaces of a seed.
    pub(super) fn both(kind: CurveKind, form_m: f64, seed: u64) -> [Self; 2] {
        const PIECES: u32 = 400;
        let mut phases = Noise::new(seed, 36);
        let at = |k: u32| kind.point(f64::from(k) / f64::from(PIECES));
        let length_m: f64 = (0..PIECES).map(|k| (at(k + 1) - at(k)).norm()).sum();
        let waves = (length_m / WAVE_M).round();
        Side::BOTH.map(|side| Self { kind, side, form_m, waves, phase_rad: phases.uniform(0.0, TAU) })
    }

    /// Whether the seam has a place.
    pub(super) fn has(&self, s: f64) -> bool {
        self.kind.is_closed() || (0.0..=1.0).contains(&s)
    }

    /// Its point, m, in the part's own frame.
    pub(super) fn point(&self, s: f64, from_seam_m: f64) -> Vector3<f64> {
        let Place { point, normal } = place(self.kind, self.side, s, from_seam_m);
        // At the seam the surface is in its place, and its tangent as well.
        let across = 0.5 * (1.0 - (TAU * from_seam_m / WAVE_M).cos());
        point + normal * (self.form_m * across * (TAU * self.waves * s + self.phase_rad).sin())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A way from the seam has its length, is square to the seam, and those of both surfaces are square to each other. Differences
    /// along the seam are exact to 1e-10 of a radian, of 15 mm.
    #[test]
    fn ruled_surfaces_are_square() {
        const FAR_M: f64 = 0.015;
        for kind in CurveKind::ALL.into_iter().filter(|kind| *kind != CurveKind::Saddle) {
            for k in 0..50 {
                let s = (f64::from(k) + 0.3) / 50.0;
                let along = kind.point(s + 1e-5) - kind.point(s - 1e-5);
                let ways = Side::BOTH.map(|side| kind.beside(side, s, FAR_M) - kind.point(s));
                for way in ways {
                    assert!((way.norm() - FAR_M).abs() < 1e-12, "{}", kind.name());
                    // These differences are ten times as coarse: 1e-8 of a radian, where curves bend most.
                    assert!(way.dot(&along.normalize()).abs() < 1e-8 * FAR_M, "{}", kind.name());
                }
                assert!(ways[0].dot(&ways[1]).abs() < 1e-12, "{}", kind.name());
            }
        }
    }

    /// Both surfaces of a saddle are cylinders, and the way over the other one is an arc of its length.
    #[test]
    fn surfaces_of_a_saddle_are_cylinders() {
        let kind = CurveKind::Saddle;
        for k in 0..50 {
            let s = f64::from(k) / 50.0;
            let wall = kind.beside(Side::Wall, s, 0.01);
            assert!((wall.xy().norm() - 0.045).abs() < 1e-12);
            assert!((wall.z - kind.point(s).z - 0.01).abs() < 1e-12);
            let way = (0..=100).map(|k| kind.beside(Side::Floor, s, 1.5e-4 * f64::from(k)));
            let way: Vec<Vector3<f64>> = way.collect();
            for point in &way {
                assert!((point.x.hypot(point.z + 0.08) - 0.08).abs() < 1e-12);
            }
            // Chords of 0.15 mm on a radius of 80 mm are 1.5e-7 of themselves shorter than their arcs.
            let length_m: f64 = way.windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum();
            assert!((length_m - 0.015).abs() < 3e-9, "{length_m}");
            assert!(way[100].xy().norm() > 0.045 + 0.009, "not outward: {}", way[100]);
        }
    }

    /// A wavy surface leaves the seam where it is, is closed along a pipe and has its stated amplitude.
    #[test]
    fn waves_leave_the_seam_in_place() {
        let form_m = 1e-4;
        for kind in CurveKind::ALL {
            let both = Surface::both(kind, form_m, 3);
            assert_ne!(both[0].phase_rad, both[1].phase_rad);
            for (surface, side) in both.into_iter().zip(Side::BOTH) {
                let off_m = |s: f64, r: f64| (surface.point(s, r) - kind.beside(side, s, r)).norm();
                let most_m = |r: f64| (0..1000).map(|k| off_m(1e-3 * f64::from(k), r)).fold(0.0, f64::max);
                assert_eq!(most_m(0.0), 0.0);
                // A hundred places a wave or more: 1 − cos(2π/200) beside the crest at most.
                assert!((most_m(0.02) - form_m).abs() < 5e-4 * form_m, "{}: {}", kind.name(), most_m(0.02));
                if kind.is_closed() {
                    assert!((surface.point(1.0, 0.01) - surface.point(0.0, 0.01)).norm() < 1e-12);
                }
            }
        }
    }
}
