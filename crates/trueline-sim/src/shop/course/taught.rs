//! Taught points, between which the robot moves straight, with blended corners.

use super::swing::{Limits, Swing, Swings};
use crate::noise::Noise;

/// Time between two points, s.
const BETWEEN_S: [f64; 2] = [1.5, 5.0];
/// Half of the time that a corner is blended over, as a part of the time between points.
const BLEND: f64 = 0.2;
/// Points before the scan and after it, so that the robot is on its way there too.
const BEYOND: usize = 3;
/// A taught point: progress, two places, three tilts.
type Point = [f64; 6];

/// The motion.
pub(super) fn drawn(noise: &mut Noise, limits: Limits) -> Swings {
    let between_s = noise.uniform(BETWEEN_S[0], BETWEEN_S[1]).min(limits.duration_s / 5.0);
    let count = (limits.duration_s / between_s).ceil() as usize;
    let step = 1.0 / count as f64;
    let points: Vec<Point> = (0..=count + 2 * BEYOND)
        .map(|k| {
            let progress = (k as f64 - BEYOND as f64 + noise.uniform(-0.3, 0.3)) * step - 0.5;
            let [a, b] = limits.in_sheet_m.map(|limit| noise.uniform(-limit, limit));
            let [work, travel, spin] = [limits.tilt_rad; 3].map(|limit| noise.uniform(-limit, limit));
            [progress, a, b, work, travel, spin]
        })
        .collect();
    let period_s = limits.duration_s * step;
    Box::new(move |time_s| {
        let [progress, a, b, work, travel, spin] = blended(&points, time_s / period_s + BEYOND as f64);
        Swing { progress, in_sheet_m: [a, b], tilt_rad: [work, travel, spin] }
    })
}

/// The place after this many points: straight between them, a parabola about each.
fn blended(points: &[Point], position: f64) -> Point {
    let nearest = (position.round() as usize).clamp(1, points.len() - 2);
    let [before, here, after] = [0, 1, 2].map(|k| &points[nearest - 1 + k]);
    let beyond = position - nearest as f64;
    std::array::from_fn(|k| {
        let (into, out) = (here[k] - before[k], after[k] - here[k]);
        let bend = (beyond + BLEND).clamp(0.0, 2.0 * BLEND);
        let straight = if beyond > BLEND { out * beyond } else { into * beyond };
        let blend = if beyond.abs() <= BLEND { (out - into) * bend * bend / (4.0 * BLEND) } else { 0.0 };
        here[k] + straight + blend
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_are_blended_without_a_jump_in_place_or_speed() {
        let points: Vec<Point> = [0.0, 1.0, -1.0, 0.5, 2.0].iter().map(|value| [*value; 6]).collect();
        let (mut place, mut speed) = (blended(&points, 0.6)[0], None::<f64>);
        for k in 1..2600 {
            let next = blended(&points, 0.6 + f64::from(k) * 1e-3)[0];
            // The speed changes by at most 3.5 over 400 steps of a blend.
            if let Some(speed) = speed {
                assert!(((next - place) - speed).abs() < 1.1e-3 * 3.5 / 400.0, "{k}");
            }
            speed = Some(next - place);
            place = next;
        }
    }
}
