//! Pictures drawn as strokes, without plates, rays or a laser: nothing is shared with the renderer.
#![allow(dead_code, reason = "each test uses a part")]

use nalgebra::{Vector2, Vector3};
use trueline_geometry::Plane;
use trueline_model::{BrownConrady, Camera};
use trueline_sim::noise::Noise;
use trueline_vision::{Detector, Joint, Lens, NotFound, Picture, Seam};

/// A camera with its laser plane leaning away by 25°: higher in the picture is further away.
pub(crate) fn detector([width, height]: [usize; 2]) -> Detector {
    let size = [width, height].map(|n| f64::from(n as u32));
    let camera = Camera {
        size: [width as u32, height as u32],
        focal: Vector2::new(1.3 * size[0], 1.3 * size[0]),
        centre: Vector2::new(0.5 * (size[0] - 1.0), 0.5 * (size[1] - 1.0)),
        distortion: BrownConrady::default(),
    };
    let angle = 25.0_f64.to_radians();
    let plane = Plane::new(Vector3::new(0.0, angle.cos(), angle.sin()), 0.2 * angle.sin()).unwrap();
    Detector::new(Lens::new(camera, plane))
}

/// A picture that is drawn on.
pub(crate) struct Paper {
    pub size: [usize; 2],
    light: Vec<f64>,
    noise: Noise,
}

/// A straight stroke.
#[derive(Clone, Copy)]
pub(crate) struct Stroke {
    pub from: [f64; 2],
    /// Direction, degrees from u towards v.
    pub heading_deg: f64,
    pub length_px: f64,
    pub sigma_px: f64,
    /// How far its ends fade, px.
    pub blur_px: f64,
    /// Radius with which it bends off to its left before it ends, px.
    pub rounding_px: f64,
    /// Part of the light that fades off slowly on its right.
    pub tail: f64,
    /// Its light for that of a usual stroke.
    pub brightness: f64,
    /// Size of the grains of full speckle that it is made of, px; zero: mild speckle, pixel by pixel.
    pub grain_px: usize,
}

/// Thicknesses of a stroke from its middle beyond which it has no light: e⁻⁷².
const DARK: f64 = 12.0;

impl Stroke {
    pub(crate) fn new(from: [f64; 2], heading_deg: f64, length_px: f64, sigma_px: f64) -> Self {
        Self {
            from,
            heading_deg,
            length_px,
            sigma_px,
            blur_px: 0.6,
            rounding_px: 0.0,
            tail: 0.0,
            brightness: 1.0,
            grain_px: 0,
        }
    }

    /// Light at a pixel. A fade is linear, unlike what the detector assumes.
    fn light(&self, u: f64, v: f64) -> f64 {
        let (sin, cos) = self.heading_deg.to_radians().sin_cos();
        let (x, y) = (u - self.from[0], v - self.from[1]);
        let (along, mut beside) = (x * cos + y * sin, y * cos - x * sin);
        if self.rounding_px > 0.0 {
            let over = (along - self.length_px + self.rounding_px).clamp(0.0, self.rounding_px);
            beside += self.rounding_px - (self.rounding_px * self.rounding_px - over * over).sqrt();
        }
        let fade = |inside: f64| (0.5 + 0.25 * inside / self.blur_px).clamp(0.0, 1.0);
        let ends = self.brightness * fade(along) * fade(self.length_px - along);
        if ends == 0.0 {
            return 0.0;
        }
        let thicknesses = beside / self.sigma_px;
        // Denormal numbers take a hundred times longer.
        let bell = if thicknesses.abs() > DARK { 0.0 } else { (-0.5 * thicknesses * thicknesses).exp() };
        let tail = if thicknesses > 0.0 { self.tail } else { 0.0 };
        ends * ((1.0 - tail) * bell + tail * (-0.5 * thicknesses).exp())
    }
}

impl Paper {
    pub(crate) fn new(size: [usize; 2], seed: u64) -> Self {
        Self { size, light: vec![0.0; size[0] * size[1]], noise: Noise::new(seed, 3) }
    }

    /// Draws a stroke with speckle over what is there.
    pub(crate) fn stroke(&mut self, stroke: &Stroke) {
        let [width, height] = self.size;
        let grains = self.grains(stroke.grain_px);
        for v in 0..height {
            for u in 0..width {
                let light = stroke.light(u as f64, v as f64);
                if light > 1e-4 {
                    let speckle =
                        match grains.get(width * (v / stroke.grain_px.max(1)) + u / stroke.grain_px.max(1)) {
                            Some(grain) => *grain,
                            None => 1.0 + 0.3 * self.noise.uniform(-1.0, 1.0),
                        };
                    let at = &mut self.light[v * width + u];
                    *at = at.max(light * speckle);
                }
            }
        }
    }

    /// Light of grains of a size, which has an exponential distribution; none of no size.
    fn grains(&mut self, size_px: usize) -> Vec<f64> {
        if size_px == 0 {
            return Vec::new();
        }
        let [width, height] = self.size;
        (0..width * height.div_ceil(size_px)).map(|_| -self.noise.uniform(1e-9, 1.0).ln()).collect()
    }

    /// Lights the surface wherever it is, behind all that is drawn: a part of a usual stroke's light.
    pub(crate) fn surface(&mut self, light: f64, is_there: impl Fn(f64, f64) -> bool) {
        let [width, height] = self.size;
        for (v, u) in (0..height).flat_map(|v| (0..width).map(move |u| (v, u))) {
            if is_there(u as f64, v as f64) {
                self.light[v * width + u] += light;
            }
        }
    }

    /// Grey levels with read noise; this part of the pixels is hot.
    pub(crate) fn levels(&mut self, hot: f64) -> Vec<u8> {
        let noise = &mut self.noise;
        let level = |light: &f64| {
            let stuck = if noise.happens(hot) { noise.uniform(60.0, 250.0) } else { 0.0 };
            (6.0 + 160.0 * light + noise.normal(1.2)).max(stuck).clamp(0.0, 255.0) as u8
        };
        self.light.iter().map(level).collect()
    }

    pub(crate) fn seam(&mut self, detector: &mut Detector, joint: Joint) -> Result<Seam, NotFound> {
        let levels = self.levels(0.0);
        detector.seam(&Picture::new(self.size[0], self.size[1], &levels).unwrap(), joint)
    }
}

/// A stroke from one point to another.
pub(crate) fn between(from: [f64; 2], to: [f64; 2], sigma_px: f64) -> Stroke {
    let (x, y) = (to[0] - from[0], to[1] - from[1]);
    Stroke::new(from, y.atan2(x).to_degrees(), x.hypot(y), sigma_px)
}

/// Two arms of a length from a corner, each 60° beside the vertical: downwards a valley, upwards a ridge.
pub(crate) fn arms(corner: [f64; 2], length_px: f64, sigma_px: f64, ridge: bool) -> [Stroke; 2] {
    let headings = if ridge { [-150.0, -30.0] } else { [150.0, 30.0] };
    headings.map(|heading| Stroke::new(corner, heading, length_px, sigma_px))
}
