//! Compares methods for the stripe's middle: the usual ones and ours on the same sections of the same pictures, and the
//! bound that speckle and noise set.
//!
//! `cargo run --release -p trueline-studies -- methods` prints the table of BENCHMARKS.md. Every method gets the same
//! segments, the same sections and the same robust line through its middles; only the middle differs.
#![allow(clippy::unwrap_used, reason = "a study fails by panicking")]

use nalgebra::{Matrix2, Vector2};
use std::time::{Duration, Instant};
use trueline_dataset::{GrayImage, Pixels};
use trueline_sim::{Joint as Scene, Look, PictureScan, Preset, SensorModel};
use trueline_vision::frame::Frame;
use trueline_vision::joint::arm_pair::{ArmPair, pairs};
use trueline_vision::line::Line2;
use trueline_vision::measure::regression::{Regressor, Shift};
use trueline_vision::measure::track::Track;
use trueline_vision::{Detector, Joint, Lens, Picture};

const PICTURES: f64 = 60.0;
/// Half of a section, px: four standard deviations of the stripe.
const HALF: i64 = 10;
/// Start of arms, px from the corner.
const FROM_PX: f64 = 12.0;

#[derive(Clone, Copy)]
enum Method {
    Peak,
    Gravity,
    GaussianFit,
    Steger,
}

/// The middle of a section, px from its centre pixel.
fn middle(method: Method, section: &[f32]) -> Option<f64> {
    let ground = section[0].min(section[section.len() - 1]);
    let at = |k: usize| f64::from(section[k] - ground);
    let top = (1..section.len() - 1).max_by(|a, b| section[*a].total_cmp(&section[*b]))?;
    let vertex = |f: &dyn Fn(f64) -> f64| {
        let [a, b, c] = [f(at(top - 1)), f(at(top)), f(at(top + 1))];
        (a + c - 2.0 * b < 0.0).then(|| top as f64 + 0.5 * (a - c) / (a + c - 2.0 * b))
    };
    let place = match method {
        Method::Peak | Method::Steger => vertex(&|level| level)?,
        Method::Gravity => {
            let mass: f64 = (0..section.len()).map(at).sum();
            (0..section.len()).map(|k| k as f64 * at(k)).sum::<f64>() / mass
        }
        Method::GaussianFit => gaussian(section.len(), &at)?,
    };
    (place - HALF as f64).is_finite().then_some(place - HALF as f64)
}

/// Least squares of a Gaussian in its logarithm, weighted by the squared level \[Guo2011\].
fn gaussian(count: usize, at: &dyn Fn(usize) -> f64) -> Option<f64> {
    let (mut information, mut right) = (nalgebra::Matrix3::zeros(), nalgebra::Vector3::zeros());
    for k in 0..count {
        let (x, level) = (k as f64 - HALF as f64, at(k).max(0.5));
        let row = nalgebra::Vector3::new(1.0, x, x * x);
        information += row * row.transpose() * (level * level);
        right += row * (level * level * level.ln());
    }
    let fit = information.try_inverse()? * right;
    (fit.z < 0.0).then(|| HALF as f64 - 0.5 * fit.y / fit.z)
}

struct Bench {
    lens: Lens,
    regressor: Regressor,
    track: Track,
}

impl Bench {
    /// The corner from the middles of one method.
    fn corner(
        &mut self,
        method: Method,
        picture: &Picture<'_, u8>,
        smooth: &[f32],
        pair: &ArmPair,
    ) -> Option<Vector2<f64>> {
        let mut lines = pair.arms;
        // Twice: the second time around the line that the first has found.
        for _ in 0..2 {
            for (k, line) in lines.iter_mut().enumerate() {
                *line = self.line(method, picture, smooth, line, [FROM_PX, pair.lengths[k]])?;
            }
        }
        Some(self.lens.distorted(&lines[0].cross(&lines[1])?).0)
    }

    fn line(
        &mut self,
        method: Method,
        picture: &Picture<'_, u8>,
        smooth: &[f32],
        line: &Line2,
        span: [f64; 2],
    ) -> Option<Line2> {
        self.track.lay(line, span, Frame { picture, lens: &self.lens });
        let (width, height) = (picture.width() as i64, picture.height() as i64);
        let by_columns = self.track.by_columns;
        let mut section = [0.0_f32; 2 * HALF as usize + 1];
        let shifts: Vec<Shift> = self
            .track
            .stations
            .iter()
            .filter_map(|station| {
                let centre = station.centre.round() as i64;
                let limit = if by_columns { height } else { width };
                if centre < HALF || centre + HALF >= limit {
                    return None;
                }
                for (k, level) in section.iter_mut().enumerate() {
                    let across = (centre - HALF) as usize + k;
                    let (u, v) = if by_columns { (station.at, across) } else { (across, station.at) };
                    let at = v * picture.width() + u;
                    *level = if matches!(method, Method::Steger) {
                        smooth[at]
                    } else {
                        f32::from(picture.levels()[at])
                    };
                }
                let off = middle(method, &section)? + centre as f64 - station.centre;
                Some(Shift { s: station.s, shift_px: off / station.stretch, weight: 1.0, response: 1.0 })
            })
            .collect();
        let fit = self.regressor.fit(&shifts)?;
        let point = line.at(fit.centre);
        let moved = Line2 { point, along: line.along }.moved(fit.shift_px, fit.slope);
        // Arms count from their own beginning.
        Some(Line2 { point: moved.at(-fit.centre), along: moved.along })
    }
}

/// The picture smoothed as Steger's detector does it, along both axes.
fn smoothed(picture: &Picture<'_, u8>, sigma: f64) -> Vec<f32> {
    let reach = (3.0 * sigma).ceil() as i64;
    let taps: Vec<f32> = (-reach..=reach).map(|k| (-0.5 * (k as f64 / sigma).powi(2)).exp() as f32).collect();
    let sum: f32 = taps.iter().sum();
    let (width, height) = (picture.width(), picture.height());
    let mut across = vec![0.0_f32; width * height];
    for (row, out) in across.chunks_exact_mut(width).enumerate() {
        let levels = picture.row(row);
        for (k, tap) in taps.iter().enumerate() {
            for x in reach as usize..width - reach as usize {
                out[x] += tap / sum * f32::from(levels[x + k - reach as usize]);
            }
        }
    }
    let mut both = vec![0.0_f32; width * height];
    for y in reach as usize..height - reach as usize {
        for (k, tap) in taps.iter().enumerate() {
            let from = (y + k - reach as usize) * width;
            for x in 0..width {
                both[y * width + x] += tap / sum * across[from + x];
            }
        }
    }
    both
}

/// Amplitude and standard deviation of the stripe on an arm, from the picture without noise.
fn stripe_of(clean: &Picture<'_, u8>, lens: &Lens, arm: &Line2, length: f64) -> (f64, f64) {
    let (mut mass, mut second, mut count) = (0.0, 0.0, 0.0);
    for k in 0..50 {
        let s = FROM_PX + (length - FROM_PX) * (f64::from(k) + 0.5) / 50.0;
        for d in -40..=40 {
            let d = f64::from(d) * 0.25;
            let pixel = lens.distorted(&(arm.at(s) + arm.normal() * d)).0;
            let (u, v) = (pixel.x.round() as usize, pixel.y.round() as usize);
            if u >= clean.width() || v >= clean.height() {
                continue;
            }
            let level = (f64::from(clean.row(v)[u]) - 5.0).max(0.0) * 0.25;
            mass += level;
            second += level * d * d;
        }
        count += 1.0;
    }
    let sigma = (second / mass).sqrt();
    (mass / count / (sigma * std::f64::consts::TAU.sqrt()), sigma)
}

/// Cramér–Rao bound of the corner, px². A shift of an arm by e changes levels by −e μ′. Speckle of contrast one and
/// correlation area πℓ² gives them the spectral density μ²πℓ², the camera its variance.
fn bound(pair: &ArmPair, stripes: [(f64, f64); 2], look: &Look) -> f64 {
    let variance = [0, 1].map(|k| {
        let (amplitude, sigma) = stripes[k];
        let area = std::f64::consts::PI * look.speckle_length_px.powi(2) * look.speckle_contrast.powi(2);
        let density: f64 = (-200..=200)
            .map(|k| {
                let d = f64::from(k) * 0.05;
                let level = amplitude * (-0.5 * (d / sigma).powi(2)).exp();
                let camera = (255.0 * look.read_noise).powi(2)
                    + 255.0 * (level + 5.0) / look.full_well_electrons
                    + 1.0 / 12.0;
                0.05 * (level * d / (sigma * sigma)).powi(2) / (level * level * area + camera)
            })
            .sum();
        // At a line's end: the variance of its middle, and three times that for the lever of its slope.
        4.0 / (density * pair.lengths[k])
    });
    let normals = Matrix2::from_rows(&[pair.arms[0].normal().transpose(), pair.arms[1].normal().transpose()]);
    let inverse = normals.try_inverse().unwrap_or_else(Matrix2::identity);
    (inverse * Matrix2::from_diagonal(&Vector2::from(variance)) * inverse.transpose()).trace()
}

fn eight(image: &GrayImage) -> Picture<'_, u8> {
    let Pixels::Eight(levels) = &image.pixels else { unreachable!("eight bits are simulated") };
    Picture::new(image.width, image.height, levels).unwrap()
}

pub(crate) fn run(_: &[String]) -> Result<(), String> {
    let mut scenario = Preset::Quick.scenario();
    scenario.timing.frame_period_s = scenario.timing.duration_s / (PICTURES + 1.0);
    let SensorModel::CameraLaser { camera, laser_plane_in_camera } = scenario.cell.sensor else {
        return Ok(());
    };
    let lens = Lens::new(camera, laser_plane_in_camera);
    let methods = [
        ("brightest pixel, parabola", Method::Peak),
        ("centre of gravity", Method::Gravity),
        ("Gaussian fit (weighted, logarithmic)", Method::GaussianFit),
        ("Steger: smoothed picture, vertex", Method::Steger),
    ];
    for (name, look) in [("clean", Look::clean()), ("speckle", Look::speckled()), ("shiny", Look::shiny())] {
        let scan = PictureScan::new(&scenario, Scene::fillet(), look.clone(), 1).unwrap();
        let clean = PictureScan::new(&scenario, Scene::fillet(), Look::clean(), 1).unwrap();
        let (mut renderer, mut clean_renderer) = (scan.renderer(), clean.renderer());
        let mut detector = Detector::new(lens.clone());
        let mut bench =
            Bench { lens: lens.clone(), regressor: Regressor::default(), track: Track::default() };
        let mut errors = vec![Vec::new(); methods.len() + 1];
        let mut times = vec![Duration::ZERO; methods.len() + 1];
        let mut bounds = Vec::new();
        for exposed in scan.exposures() {
            let drawn = scan.draw(&mut renderer, exposed);
            let reference = clean.draw(&mut clean_renderer, exposed);
            let Some(truth) = drawn.seam_px else { continue };
            let picture = eight(&drawn.image);
            let start = Instant::now();
            let Ok(seam) = detector.seam(&picture, Joint::Fillet) else { continue };
            times[methods.len()] += start.elapsed();
            errors[methods.len()].push((seam.pixel - truth).norm_squared());
            let pair = pairs(detector.segments(), &lens)
                .filter_map(|(_, pair)| pair.ok())
                .max_by(|a, b| a.score().total_cmp(&b.score()))
                .unwrap();
            let stripes =
                [0, 1].map(|k| stripe_of(&eight(&reference.image), &lens, &pair.arms[k], pair.lengths[k]));
            bounds.push(bound(&pair, stripes, &look));
            for (k, (_, method)) in methods.iter().enumerate() {
                let start = Instant::now();
                let smooth =
                    if matches!(method, Method::Steger) { smoothed(&picture, 2.0) } else { Vec::new() };
                let corner = bench.corner(*method, &picture, &smooth, &pair);
                times[k] += start.elapsed();
                errors[k].extend(corner.map(|corner| (corner - truth).norm_squared()));
            }
        }
        let rms = |values: &[f64]| (values.iter().sum::<f64>() / values.len() as f64).sqrt();
        let count = bounds.len();
        println!("\n{name}: {count} pictures, bound {:.4} px", rms(&bounds));
        for (k, (errors, time)) in errors.iter().zip(&times).enumerate() {
            let label = methods.get(k).map_or("ours, with everything", |(label, _)| label);
            let ms = time.as_secs_f64() * 1e3 / count as f64;
            println!("| {label} | {:.4} px | {:.2} | {ms:.2} ms |", rms(errors), rms(errors) / rms(&bounds));
        }
    }
    Ok(())
}
