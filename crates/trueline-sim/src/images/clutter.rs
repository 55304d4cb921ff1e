//! Welding effects in a picture: glowing spatter and the arc's glow.

use super::look::Look;
use crate::noise::Noise;

/// Adds spatter and glow around a place to a picture of brightness in parts of full scale.
pub fn add(picture: &mut [f32], size: [usize; 2], centre: [f64; 2], look: &Look, noise: &mut Noise) {
    if look.glow > 0.0 {
        glow(picture, size, centre, look.glow, noise);
    }
    for _ in 0..noise.count(look.spatter) {
        spatter(picture, size, centre, noise);
    }
}

fn glow(picture: &mut [f32], size: [usize; 2], centre: [f64; 2], peak: f64, noise: &mut Noise) {
    let place = centre.map(|c| c + noise.normal(200.0));
    let sigma = noise.uniform(150.0, 400.0);
    let height = peak * noise.uniform(0.3, 1.0);
    let fall = |at: f64, place: f64| (-0.5 * ((at - place) / sigma).powi(2)).exp() as f32;
    let across: Vec<f32> = (0..size[0]).map(|x| fall(x as f64, place[0])).collect();
    for (y, row) in picture.chunks_exact_mut(size[0]).enumerate() {
        let factor = height as f32 * fall(y as f64, place[1]);
        for (value, fall) in row.iter_mut().zip(&across) {
            *value += factor * fall;
        }
    }
}

/// A drop of hot metal, drawn out by its flight.
fn spatter(picture: &mut [f32], size: [usize; 2], centre: [f64; 2], noise: &mut Noise) {
    let near = noise.happens(0.5);
    let place = [0, 1].map(|axis: usize| {
        if near { centre[axis] + noise.normal(200.0) } else { noise.uniform(0.0, size[axis] as f64) }
    });
    let radius = noise.uniform(0.8, 5.0);
    let length = if noise.happens(0.4) { noise.uniform(5.0, 60.0) } else { 0.0 };
    let heading = noise.uniform(0.0, std::f64::consts::PI);
    let (along, brightness) = ([heading.cos(), heading.sin()], noise.uniform(0.4, 2.0));
    let reach = 0.5 * length + 3.0 * radius;
    let span = |c: f64, n: usize| {
        let from = (c - reach).max(0.0) as usize;
        from.min(n)..((c + reach + 1.0).max(0.0) as usize).min(n)
    };
    for y in span(place[1], size[1]) {
        for x in span(place[0], size[0]) {
            let (dx, dy) = (x as f64 - place[0], y as f64 - place[1]);
            let forward = dx * along[0] + dy * along[1];
            let beside = dy * along[0] - dx * along[1];
            let past = (forward.abs() - 0.5 * length).max(0.0);
            let distance2 = (past * past + beside * beside) / (radius * radius);
            picture[y * size[0] + x] += (brightness * (-0.5 * distance2).exp()) as f32;
        }
    }
}
