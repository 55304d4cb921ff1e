//! One picture: rays through every pixel near the stripe, then everything that a camera adds.

use super::clutter;
use super::cross_section::Facet;
use super::exposure::Exposure;
use super::joint::Joint;
use super::light::Light;
use super::look::Look;
use super::patch::Patches;
use super::speckle::Speckle;
use crate::noise::Noise;
use nalgebra::{Unit, Vector2, Vector3};
use trueline_dataset::{GrayImage, Pixels};
use trueline_geometry::{Line, Plane, Pose};
use trueline_model::Camera;

/// Instants of an exposure; their pictures are added up.
const INSTANTS: usize = 5;

/// A stripe darker than this part of full scale counts as invisible: eight grey levels of 255.
const VISIBLE: f32 = 0.03;

/// Data shared by all pictures of a scan; made once.
pub struct Studio {
    camera: Camera,
    sheet: Plane,
    seam: Line,
    approach: Vector3<f64>,
    joint: Joint,
    facets: Vec<Facet>,
    lines: Vec<Vector2<f64>>,
    witnesses: Vec<Vector2<f64>>,
    look: Look,
    speckle: Option<Speckle>,
    exposure: Exposure,
    /// Ray (x, y, 1) through the centre of each pixel; not a number where the lens has none.
    rays: Vec<[f32; 2]>,
    seed: u64,
}

/// Pixels of places; `None` for those off the sheet, or behind the camera.
type PlacesPx = Vec<Option<Vector2<f64>>>;

/// A picture and where its seam is.
pub struct Picture {
    /// Grey levels.
    pub image: GrayImage,
    /// The seam at mid-exposure in distorted px, if it is in the picture and the stripe is visible beside it. For a
    /// joint with two lines it is that of line 0.
    pub seam_px: Option<Vector2<f64>>,
    /// The seam of line 1, likewise.
    pub second_px: Option<Vector2<f64>>,
}

impl Studio {
    /// A camera and its laser sheet before a joint along a seam.
    #[must_use]
    pub fn new(
        (camera, sheet): (Camera, Plane),
        (joint, seam, approach): (Joint, Line, Vector3<f64>),
        look: Look,
        seed: u64,
    ) -> Self {
        let speckle = (look.speckle_contrast > 0.0)
            .then(|| Speckle::new(look.speckle_contrast, look.speckle_length_px, seed));
        let [width, height] = camera.size;
        let ray = |u: u32, v: u32| {
            let ray = camera.ray(&Vector2::new(f64::from(u), f64::from(v)));
            ray.map_or([f32::NAN; 2], |(ray, _)| [ray.x as f32, ray.y as f32])
        };
        Self {
            rays: (0..height).flat_map(|v| (0..width).map(move |u| (u, v))).map(|(u, v)| ray(u, v)).collect(),
            exposure: Exposure::new(&look, seed),
            joint,
            facets: joint.facets(),
            lines: joint.lines(),
            witnesses: joint.witnesses(),
            camera,
            sheet,
            seam,
            approach,
            look,
            speckle,
            seed,
        }
    }

    fn size(&self) -> [usize; 2] {
        self.camera.size.map(|n| n as usize)
    }

    fn light<'a>(&'a self, missing: &'a [[f64; 2]], base_from_camera: &Pose) -> Light<'a> {
        let scene = (self.facets.as_slice(), missing, &self.look);
        Light::new(scene, (&self.seam, &self.approach), base_from_camera, &self.sheet)
    }

    /// Puts the lines of the joint in order as the camera sees them from a pose: line 0 of two equals is the left one in the
    /// picture.
    pub(crate) fn order_lines(&mut self, base_from_camera: &Pose) {
        let places = self.places_px(base_from_camera).0;
        if let (Joint::Groove { .. }, [Some(a), Some(b)]) = (self.joint, places.as_slice()) {
            let across = b - a;
            let forward = if across.x.abs() >= across.y.abs() { across.x } else { across.y };
            if forward < 0.0 {
                self.lines.swap(0, 1);
            }
        }
    }

    /// The lines of the joint in base.
    #[must_use]
    pub fn lines(&self) -> Vec<Line> {
        let along = self.seam.direction();
        let away = (self.approach - along * along.dot(&self.approach)).normalize();
        let across = along.cross(&away);
        let direction = Unit::new_normalize(along);
        let moved =
            |at: &Vector2<f64>| Line::new(self.seam.anchor() + across * at.x + away * at.y, &direction);
        self.lines.iter().map(moved).collect()
    }

    /// Places of the lines, and neighbouring places at which their stripe should be visible, px.
    fn places_px(&self, base_from_camera: &Pose) -> (PlacesPx, PlacesPx) {
        let light = self.light(&[], base_from_camera);
        let pixel = |at: &Vector2<f64>| light.on_sheet(at).and_then(|point| self.camera.project(&point));
        (self.lines.iter().map(pixel).collect(), self.witnesses.iter().map(pixel).collect())
    }
}

/// Draws pictures in a studio; keeps its memory from one to the next.
pub struct Renderer<'a> {
    studio: &'a Studio,
    patches: Patches,
    picture: Vec<f32>,
    blurred: Vec<f32>,
}

impl<'a> Renderer<'a> {
    /// A renderer of a studio.
    #[must_use]
    pub fn new(studio: &'a Studio) -> Self {
        let [width, height] = studio.size();
        Self {
            studio,
            patches: Patches::none([width, height]),
            picture: vec![0.0; width * height],
            blurred: vec![0.0; width * height],
        }
    }

    /// The picture of a frame. `base_from_camera` gives the true pose at a time from mid-exposure, s.
    pub fn draw(&mut self, frame: u64, base_from_camera: impl Fn(f64) -> Pose) -> Picture {
        let studio = self.studio;
        let mut noise = Noise::new(studio.seed, 1000 + frame);
        let missing = missing_stretches(&studio.look, &mut noise);
        let poses: Vec<Pose> = (0..INSTANTS)
            .map(|k| {
                let part = (k as f64 + 0.5) / INSTANTS as f64 - 0.5;
                base_from_camera(part * studio.look.exposure_s)
            })
            .collect();
        let lights: Vec<Light<'_>> = poses.iter().map(|pose| studio.light(&missing, pose)).collect();
        let (lines_px, witnesses) = studio.places_px(&base_from_camera(0.0));
        let [seam_px, second_px] = [0, 1].map(|line| lines_px.get(line).copied().flatten());
        self.picture.fill(0.0);
        self.mark(&lights, seam_px);
        self.cast(&lights);
        self.blur();
        let visible =
            witnesses.iter().all(|pixel| pixel.is_some_and(|pixel| self.brightness(&pixel) > VISIBLE));
        self.add_speckle(&mut noise);
        let middle = studio.size().map(|n| 0.5 * n as f64);
        let centre = seam_px.map_or(middle, Into::into);
        clutter::add(&mut self.picture, studio.size(), centre, &studio.look, &mut noise);
        let [seam_px, second_px] = [seam_px, second_px].map(|pixel| pixel.filter(|_| visible));
        Picture { image: self.develop(&mut noise), seam_px, second_px }
    }

    fn mark(&mut self, lights: &[Light<'_>], seam_px: Option<Vector2<f64>>) {
        let studio = self.studio;
        let focal = studio.camera.focal.max();
        self.patches.clear();
        for light in [lights.first(), lights.last()].into_iter().flatten() {
            for facet in &studio.facets {
                let Some([from, to]) = light.stripe_on(facet) else { continue };
                let steps = ((to - from).norm() / 0.1e-3).ceil();
                for k in 0..=steps as usize {
                    let point = from.lerp(&to, k as f64 / steps.max(1.0));
                    let Some(pixel) = studio.camera.project(&point) else { continue };
                    // The stripe may be seen and lit at a slant: twice its breadth when square.
                    let reach = 10.0 * studio.look.laser_sigma_m * focal / point.z;
                    self.patches.mark(pixel.into(), reach + 4.0 * studio.look.blur_sigma_px);
                }
            }
        }
        if let (Some(pixel), true) = (seam_px, studio.look.mirror > 0.0) {
            let px_per_m = focal / studio.sheet.offset().abs();
            self.patches.mark(pixel.into(), 3.0 * studio.look.mirror_reach_m * px_per_m);
        }
    }

    fn cast(&mut self, lights: &[Light<'_>]) {
        let studio = self.studio;
        let size = studio.size();
        let share = 1.0 / lights.len() as f64;
        for patch in self.patches.iter(size) {
            for row in patch.rows[0]..patch.rows[1] {
                for column in patch.columns[0]..patch.columns[1] {
                    let at = row * size[0] + column;
                    let [x, y] = studio.rays[at].map(f64::from);
                    if x.is_nan() {
                        continue;
                    }
                    let ray = Vector3::new(x, y, 1.0);
                    let sum: f64 = lights.iter().map(|light| light.along(&ray)).sum();
                    self.picture[at] = (sum * share) as f32;
                }
            }
        }
    }

    /// The lens spreads each point: rows, then columns, of the marked tiles.
    fn blur(&mut self) {
        let sigma = self.studio.look.blur_sigma_px;
        if sigma <= 0.0 {
            return;
        }
        let reach = (3.5 * sigma).ceil() as i64;
        let taps: Vec<f64> = (-reach..=reach).map(|k| (-0.5 * (k as f64 / sigma).powi(2)).exp()).collect();
        let sum: f64 = taps.iter().sum();
        let taps: Vec<(i64, f32)> = (-reach..=reach).zip(taps.iter().map(|t| (t / sum) as f32)).collect();
        self.blurred.fill(0.0);
        self.smooth(&taps, 0);
        std::mem::swap(&mut self.picture, &mut self.blurred);
        self.smooth(&taps, 1);
        std::mem::swap(&mut self.picture, &mut self.blurred);
    }

    /// `blurred` from `picture` along columns (axis 0) or rows (axis 1); dark beyond the border.
    fn smooth(&mut self, taps: &[(i64, f32)], axis: usize) {
        let size = self.studio.size();
        for patch in self.patches.iter(size) {
            for row in patch.rows[0]..patch.rows[1] {
                for column in patch.columns[0]..patch.columns[1] {
                    let mut sum = 0.0;
                    for (k, tap) in taps {
                        let mut at = [column as i64, row as i64];
                        at[axis] += k;
                        if (0..size[axis] as i64).contains(&at[axis]) {
                            sum += tap * self.picture[at[1] as usize * size[0] + at[0] as usize];
                        }
                    }
                    self.blurred[row * size[0] + column] = sum;
                }
            }
        }
    }

    /// The brightest pixel at a place, in parts of full scale.
    fn brightness(&self, pixel: &Vector2<f64>) -> f32 {
        let size = self.studio.size();
        let near =
            |at: f64, n: usize| (at.round() as usize).saturating_sub(1)..(at.round() as usize + 2).min(n);
        let rows =
            near(pixel.y, size[1]).flat_map(|row| near(pixel.x, size[0]).map(move |column| (row, column)));
        rows.map(|(row, column)| self.picture[row * size[0] + column]).fold(0.0, f32::max)
    }

    fn add_speckle(&mut self, noise: &mut Noise) {
        let Some(speckle) = &self.studio.speckle else { return };
        let size = self.studio.size();
        let corner = Speckle::corner(noise);
        for patch in self.patches.iter(size) {
            for row in patch.rows[0]..patch.rows[1] {
                for column in patch.columns[0]..patch.columns[1] {
                    self.picture[row * size[0] + column] *= speckle.at(column, row, corner);
                }
            }
        }
    }

    fn develop(&self, noise: &mut Noise) -> GrayImage {
        let [width, height] = self.studio.size();
        let exposure = &self.studio.exposure;
        let pixels = if self.studio.look.bits == 16 {
            let mut levels = Vec::with_capacity(width * height);
            exposure.develop(&self.picture, width, 65535.0, noise, |level| levels.push(level as u16));
            Pixels::Sixteen(levels)
        } else {
            let mut levels = Vec::with_capacity(width * height);
            exposure.develop(&self.picture, width, 255.0, noise, |level| levels.push(level as u8));
            Pixels::Eight(levels)
        };
        GrayImage { width, height, pixels }
    }
}

/// Stretches across the seam, m, that scatter nothing: soot, rust, a scratch.
fn missing_stretches(look: &Look, noise: &mut Noise) -> Vec<[f64; 2]> {
    (0..noise.count(look.missing))
        .map(|_| {
            let from = noise.uniform(-0.03, 0.03);
            [from, from + noise.uniform(0.5e-3, 3e-3)]
        })
        .collect()
}
