//! From brightness to grey levels: shot and read noise, saturation, whole numbers.

use super::look::Look;
use crate::noise::Noise;

/// Normal numbers are drawn once and entered at a random place for each row: twenty times faster than drawing
/// five million for each picture.
const DRAWN: usize = 1 << 20;

/// The camera's sensor.
#[derive(Clone, Debug)]
pub struct Exposure {
    normal: Vec<f32>,
    read_variance: f32,
    per_electron: f32,
    background: f32,
}

impl Exposure {
    /// The sensor of a look.
    #[must_use]
    pub fn new(look: &Look, seed: u64) -> Self {
        let mut noise = Noise::new(seed, 11);
        let silent = look.read_noise == 0.0 && look.full_well_electrons.is_infinite();
        Self {
            normal: if silent { Vec::new() } else { (0..DRAWN).map(|_| noise.normal(1.0) as f32).collect() },
            read_variance: look.read_noise.powi(2) as f32,
            per_electron: (1.0 / look.full_well_electrons) as f32,
            background: look.background as f32,
        }
    }

    /// Grey levels of a picture (parts of full scale), from 0 to `full`.
    pub(crate) fn develop(
        &self,
        picture: &[f32],
        width: usize,
        full: f32,
        noise: &mut Noise,
        mut put: impl FnMut(f32),
    ) {
        for row in picture.chunks_exact(width) {
            if self.normal.is_empty() {
                row.iter().for_each(|light| put(level(light + self.background, full)));
                continue;
            }
            let from = noise.uniform(0.0, (DRAWN - width) as f64) as usize;
            for (light, normal) in row.iter().zip(&self.normal[from..from + width]) {
                let mean = light + self.background;
                let sigma = (self.read_variance + mean * self.per_electron).sqrt();
                put(level(mean + normal * sigma, full));
            }
        }
    }
}

fn level(brightness: f32, full: f32) -> f32 {
    (brightness * full).round().clamp(0.0, full)
}
