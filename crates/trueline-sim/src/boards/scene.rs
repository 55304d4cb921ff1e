//! A board in front of a camera, perhaps with a laser's stripe on it.

use super::lens;
use nalgebra::Vector3;
use rand::SeedableRng;
use rand_chacha::ChaCha12Rng;
use rand_distr::{Distribution, Normal};
use trueline_dataset::{GrayImage, Pixels};
use trueline_geometry::{Plane, Pose};
use trueline_model::Camera;

/// A chessboard, how it is lit, and the camera's faults.
#[derive(Clone, Debug)]
pub struct BoardScene {
    /// The camera.
    pub camera: Camera,
    /// Pose of the board: x along its columns, y along its rows, the first inner corner at the origin.
    pub camera_from_board: Pose,
    /// Inner corners along x and y; [0, 0] is a plain white plate, 1.5 squares to one side of its origin and half of one to the other.
    pub corners: [usize; 2],
    /// Side of a square, m.
    pub square_m: f64,
    /// Gray levels of black, white and the background.
    pub levels: [f64; 3],
    /// Blur of the lens, standard deviation, px.
    pub blur_px: f64,
    /// Noise, gray levels.
    pub noise: f64,
    /// The laser's stripe, if it is on.
    pub stripe: Option<Stripe>,
}

/// A laser's stripe.
#[derive(Clone, Copy, Debug)]
pub struct Stripe {
    /// The laser plane in the camera frame.
    pub laser_plane_in_camera: Plane,
    /// Gray levels that it adds in its middle on white; black takes a third of it.
    pub brightness: f64,
    /// Standard deviation of its thickness on the board, m.
    pub thickness_m: f64,
}

/// Sampling points of light in a pixel with an edge. A corner is measured to a hundredth of a pixel, so an edge in it must
/// be right to a tenth.
const POINTS: usize = 150;

/// Steps of a sequence that fills a square evenly: the inverse of the root of x³ = x + 1, and its square.
const EVEN: [f64; 2] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_2];

/// The picture of a scene. The same seed gives the same noise.
#[must_use]
pub fn render(scene: &BoardScene, seed: u64) -> GrayImage {
    let [width, height] = scene.camera.size.map(|n| n as usize);
    // Rays at the corners of the pixels; between them a lens is as good as linear.
    let corner = |k: usize| (k as f64) - 0.5;
    let rays: Vec<Vector3<f64>> = (0..=height)
        .flat_map(|row| (0..=width).map(move |column| (column, row)))
        .map(|(column, row)| lens::ray(&scene.camera, corner(column), corner(row)))
        .collect();
    let board_from_camera = scene.camera_from_board.inverse();
    let mut light = vec![0.0; width * height];
    for row in 0..height {
        for column in 0..width {
            let first = row * (width + 1) + column;
            let corners = [rays[first], rays[first + 1], rays[first + width + 1], rays[first + width + 2]];
            light[row * width + column] = of_pixel(scene, &board_from_camera, &corners, [column, row]);
        }
    }
    let light = blurred(&light, [width, height], scene.blur_px);
    let mut random = ChaCha12Rng::seed_from_u64(seed);
    let noise = Normal::new(0.0, scene.noise).ok();
    let levels = light
        .iter()
        .map(|level| {
            let noisy = level + noise.map_or(0.0, |noise| noise.sample(&mut random));
            noisy.round().clamp(0.0, 255.0) as u8
        })
        .collect();
    GrayImage { width, height, pixels: Pixels::Eight(levels) }
}

/// The mean light over a pixel. Its points are spread evenly and shifted from pixel to pixel: on a fixed grid, edges along the
/// rows would jump from one line of points to the next.
fn of_pixel(
    scene: &BoardScene,
    board_from_camera: &Pose,
    corners: &[Vector3<f64>; 4],
    [column, row]: [usize; 2],
) -> f64 {
    let outer = corners.map(|ray| of_ray(scene, board_from_camera, &ray));
    let (low, high) = outer.iter().fold((f64::INFINITY, 0.0), |(l, h): (f64, f64), x| (l.min(*x), h.max(*x)));
    if high - low < 1e-9 {
        return low;
    }
    let shift = (column * 7 + row * 13) as f64 * 0.618_033_988_749_894_9;
    let mut sum = 0.0;
    for k in 0..POINTS {
        let [x, y] = EVEN.map(|step| (shift + (k + 1) as f64 * step).fract());
        let above = corners[0] * (1.0 - x) + corners[1] * x;
        let below = corners[2] * (1.0 - x) + corners[3] * x;
        sum += of_ray(scene, board_from_camera, &(above * (1.0 - y) + below * y));
    }
    sum / POINTS as f64
}

/// The light along a ray.
fn of_ray(scene: &BoardScene, board_from_camera: &Pose, ray: &Vector3<f64>) -> f64 {
    let [black, white, behind] = scene.levels;
    let (from, along) = (board_from_camera.translation.vector, board_from_camera.rotation * ray);
    let depth = -from.z / along.z;
    if !(depth > 0.0 && depth.is_finite()) {
        return behind;
    }
    let place = from + along * depth;
    let square = [place.x, place.y].map(|x| (x / scene.square_m).floor() as i64);
    // A square around the inner corners, and half a square of white margin around those.
    let inside = |k: usize| scene.corners[k] > 0 && square[k] >= -1 && square[k] < scene.corners[k] as i64;
    let margin = |k: usize, x: f64| {
        let x = x / scene.square_m;
        x >= -1.5 && x < scene.corners[k] as f64 + 0.5
    };
    let (paint, white_part) = if inside(0) && inside(1) {
        if (square[0] + square[1]).rem_euclid(2) == 0 { (black, 0.35) } else { (white, 1.0) }
    } else if margin(0, place.x) && margin(1, place.y) {
        (white, 1.0)
    } else {
        return behind;
    };
    let laser = scene.stripe.map_or(0.0, |stripe| {
        let off = stripe.laser_plane_in_camera.signed_distance(&(ray * depth));
        stripe.brightness * white_part * (-0.5 * (off / stripe.thickness_m).powi(2)).exp()
    });
    paint + laser
}

/// Gaussian blur, first along rows and then along columns; beyond the border the outermost level continues.
fn blurred(light: &[f64], [width, height]: [usize; 2], sigma_px: f64) -> Vec<f64> {
    if sigma_px <= 0.0 {
        return light.to_vec();
    }
    let reach = (4.0 * sigma_px).ceil() as isize;
    let weights: Vec<f64> = (-reach..=reach).map(|k| (-0.5 * (k as f64 / sigma_px).powi(2)).exp()).collect();
    let total: f64 = weights.iter().sum();
    let along = |from: &[f64], count: usize, other: usize, step: usize, other_step: usize| {
        let mut out = vec![0.0; from.len()];
        for o in 0..other {
            for k in 0..count {
                let mut sum = 0.0;
                for (w, d) in weights.iter().zip(-reach..=reach) {
                    let at = (k as isize + d).clamp(0, count as isize - 1) as usize;
                    sum += w * from[o * other_step + at * step];
                }
                out[o * other_step + k * step] = sum / total;
            }
        }
        out
    };
    let rows = along(light, width, height, 1, width);
    along(&rows, height, width, width, 1)
}
