//! A drawn equivalent of an aluminium angle in daylight before a web camera, and what stands on it besides a stripe.
#![allow(dead_code, reason = "each test uses a part")]

use crate::drawn::{Paper, Stroke};

pub(crate) const SIZE: [usize; 2] = [640, 480];
/// Meeting point of the arms, px: they lead downwards from there, and downwards is towards the camera.
pub(crate) const CORNER: [f64; 2] = [351.3, 177.6];
pub(crate) const TURN_DEG: [f64; 2] = [153.0, 38.0];

/// Kinds of [`clutter`].
pub(crate) const CLUTTERS: usize = 5;

fn grain(u: f64, v: f64, cell: f64) -> f64 {
    let hash = ((u / cell).floor() * 12.9898 + (v / cell).floor() * 78.233).sin() * 43758.545;
    hash - hash.floor()
}

/// A workbench beyond the dark ground. Much on it is as bright as the stripe, so its levels do not identify the stripe.
pub(crate) fn bench(paper: &mut Paper) {
    paper.surface(0.5, |u, v| !(150.0..448.0).contains(&u) && grain(u, v, 9.0) < 0.5);
}

/// A sheet of metal in daylight, of which the border is brighter than any stripe, with shades on it, before a dark ground.
pub(crate) fn metal(paper: &mut Paper) {
    paper.surface(0.45, |u, _| (220.0..390.0).contains(&u));
    paper.surface(0.12, |u, v| (220.0..318.0 - 0.05 * v).contains(&u));
    paper.surface(0.9, |u, _| (383.0..391.0).contains(&u));
    for (part, cell) in [(0.3, 1.0), (0.5, 2.0), (0.7, 3.0)] {
        paper.surface(0.012, |u, v| (220.0..383.0).contains(&u) && grain(u, v, cell) < part);
    }
}

pub(crate) fn arm(heading_deg: f64, length_px: f64, brightness: f64) -> Stroke {
    Stroke { brightness, ..Stroke::new(CORNER, heading_deg, length_px, 1.3) }
}

/// Glints in a row where a short arm could be, a stripe's thickness each.
pub(crate) fn glints(seed: u64) -> impl Iterator<Item = Stroke> {
    let heading_deg = TURN_DEG[1] + 7.0 * seed as f64;
    let (sin, cos) = heading_deg.to_radians().sin_cos();
    (0..4).map(move |k| {
        let s = 6.0 + 11.0 * f64::from(k);
        let from = [CORNER[0] + s * cos, CORNER[1] + s * sin];
        Stroke { brightness: 0.3, ..Stroke::new(from, heading_deg, 3.0, 1.3) }
    })
}

/// An object at the place of a possible short arm.
pub(crate) fn clutter(paper: &mut Paper, kind: usize, seed: u64) {
    let turn = 7.0 * seed as f64;
    match kind {
        // The metal alone.
        0 => {}
        1 => glints(seed).for_each(|glint| paper.stroke(&glint)),
        // The border of a shade.
        2 => {
            let slope = (0.4 + 0.05 * seed as f64).tan();
            paper.surface(0.15, |u, v| u > CORNER[0] && v > CORNER[1] + slope * (u - CORNER[0]));
        }
        // A dark joint between two sheets, along which both are equally bright.
        3 => paper.surface(-0.2, |u, _| (u - CORNER[0] + 0.1 * turn).abs() < 1.5),
        // A chessboard.
        _ => {
            paper.surface(0.3, |u, v| ((u + turn) / 14.0).floor() as i64 % 2 == (v / 14.0).floor() as i64 % 2)
        }
    }
}
