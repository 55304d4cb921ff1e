//! Is the covariance honest from gray levels to the result? Renders sets of pictures of a board, calibrates camera and laser
//! plane of each, and compares the errors with the stated ±.
//!
//! ```sh
//! cargo run --release -p trueline-studies -- rendered_boards 100          # both
//! cargo run --release -p trueline-studies -- rendered_boards 100 plane    # or camera
//! ```
//!
//! Printed: squared error by covariance over its dimension (one if honest), and the part of the 95 % intervals that hold the
//! truth. With 100 sets the first is good to √(2 / (100 · 8)) = 5 % for a camera, to 8 % for a plane.

use crate::arguments::number;
use nalgebra::{DMatrix, DVector, SMatrix, UnitQuaternion, Vector2, Vector3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha12Rng;
use trueline_dataset::Pixels;
use trueline_geometry::{Plane, Pose, se3, so3};
use trueline_model::{BrownConrady, Camera, LaserSheet};
use trueline_sensor::intrinsics::{DistortionModel, fit};
use trueline_sensor::laser_plane::{BoardPicture, KnownCamera, StripeOn, fit_pictures, striped_picture};
use trueline_sensor::projection::{project_from_board, to_vector};
use trueline_sensor::{Board, Gray, View, chessboard};
use trueline_sim::boards::{BoardScene, Stripe, render};

const BOARD: Board = Board { columns: 9, rows: 6, square_m: 0.020 };
const MODEL: DistortionModel = DistortionModel::K1K2;
/// Pictures of a set, with and without stripe.
const PICTURES: usize = 10;

pub(crate) fn run(arguments: &[String]) -> Result<(), String> {
    let sets: u64 = number(arguments, 0, 20)?;
    let asked = |name: &str| arguments.get(1).is_none_or(|what| what == name);
    if asked("camera") {
        honesty(sets, camera_set).print("camera", sets);
    }
    if asked("plane") {
        honesty(sets, plane_set).print("laser plane", sets);
    }
    Ok(())
}

type Outcome = Option<(DVector<f64>, DMatrix<f64>)>;

fn honesty(sets: u64, of_set: impl Fn(&mut ChaCha12Rng) -> Outcome) -> Honesty {
    let mut sums = Honesty::default();
    for set in 0..sets {
        if let Some((error, covariance)) = of_set(&mut ChaCha12Rng::seed_from_u64(set)) {
            sums.add(&error, &covariance);
        }
    }
    sums
}

/// Sums over sets.
#[derive(Default)]
struct Honesty {
    sets: usize,
    nees: f64,
    inside: usize,
    intervals: usize,
}

impl Honesty {
    fn add(&mut self, error: &DVector<f64>, covariance: &DMatrix<f64>) {
        let size = error.len();
        let scale = covariance.diagonal().map(|v| 1.0 / v.sqrt());
        let scaled = DMatrix::from_fn(size, size, |i, j| covariance[(i, j)] * scale[i] * scale[j]);
        let z = error.component_mul(&scale);
        let Some(factor) = scaled.cholesky() else { return };
        self.sets += 1;
        self.nees += z.dot(&factor.solve(&z)) / size as f64;
        self.inside += z.iter().filter(|z| z.abs() < 1.96).count();
        self.intervals += size;
    }

    fn print(&self, name: &str, asked: u64) {
        println!(
            "{name}: {} of {asked} sets; error² / σ² {:.3}; {:.1} % of {} intervals hold the truth",
            self.sets,
            self.nees / self.sets as f64,
            100.0 * self.inside as f64 / self.intervals as f64,
            self.intervals
        );
    }
}

fn camera() -> Camera {
    Camera {
        size: [400, 300],
        focal: Vector2::new(350.0, 349.0),
        centre: Vector2::new(203.0, 147.0),
        distortion: BrownConrady { k1: -0.15, k2: 0.05, ..BrownConrady::default() },
    }
}

fn plane() -> Option<Plane> {
    Plane::new(Vector3::new(0.03, 0.866, 0.5), 0.2)
}

fn picture(pose: Pose, stripe: Option<Stripe>, seed: u64) -> Option<Gray> {
    let scene = BoardScene {
        camera: camera(),
        camera_from_board: pose,
        corners: [BOARD.columns, BOARD.rows],
        square_m: BOARD.square_m,
        levels: [40.0, 150.0, 90.0],
        blur_px: 0.8,
        noise: 2.5,
        stripe,
    };
    let image = render(&scene, seed);
    let Pixels::Eight(levels) = &image.pixels else { return None };
    Gray::new(image.width, image.height, levels.iter().map(|level| f32::from(*level)).collect())
}

/// A board tilted to some side, near or far, wholly in the picture.
fn pose(random: &mut ChaCha12Rng, middle: impl Fn(&mut ChaCha12Rng, f64) -> Vector3<f64>) -> Pose {
    loop {
        let around = random.random_range(0.0..std::f64::consts::TAU);
        let tilt = random.random_range(0.2..0.6);
        let rotation = so3::exp(&(Vector3::new(around.cos(), around.sin(), 0.0) * tilt))
            * UnitQuaternion::from_scaled_axis(Vector3::z() * random.random_range(-0.3..0.3));
        let depth = random.random_range(0.28..0.5);
        let pose = se3::from_parts(rotation, middle(random, depth) - rotation * BOARD.middle());
        let inside = |p: &Vector2<f64>| p.x > 12.0 && p.y > 12.0 && p.x < 388.0 && p.y < 288.0;
        let whole = [(-0.5, -0.5), (8.5, -0.5), (-0.5, 5.5), (8.5, 5.5)].iter().all(|(x, y)| {
            let corner = Vector3::new(*x, *y, 0.0) * BOARD.square_m;
            project_from_board(&camera(), &pose, &corner).is_some_and(|seen| inside(&seen.pixel))
        });
        if whole {
            return pose;
        }
    }
}

fn camera_set(random: &mut ChaCha12Rng) -> Outcome {
    let anywhere = |random: &mut ChaCha12Rng, depth: f64| {
        Vector3::new(random.random_range(-0.25..0.25), random.random_range(-0.2..0.2), 1.0) * depth
    };
    let views: Vec<View> = (0..PICTURES)
        .filter_map(|_| {
            let pose = pose(random, anywhere);
            chessboard::find(&picture(pose, None, random.random())?, &BOARD).ok()
        })
        .collect();
    let fit = fit(camera().size, &BOARD, &views, Some(MODEL)).ok()?;
    let off = to_vector(&fit.state.camera) - to_vector(&camera());
    let free = 6;
    Some((DVector::from_fn(free, |k, _| off[k]), DMatrix::from_fn(free, free, |i, j| fit.covariance[(i, j)])))
}

fn plane_set(random: &mut ChaCha12Rng) -> Outcome {
    let plane = plane()?;
    let n = plane.normal().into_inner();
    let on_plane = |random: &mut ChaCha12Rng, depth: f64| {
        let x = random.random_range(-0.04..0.04);
        Vector3::new(x, (plane.offset() - n.x * x - n.z * depth) / n.y, depth)
    };
    let laser = Stripe { laser_plane_in_camera: plane, brightness: 100.0, thickness_m: 0.5e-3 };
    let exact = KnownCamera { camera: camera(), covariance: SMatrix::zeros() };
    let looked: Vec<BoardPicture> = (0..PICTURES)
        .filter_map(|_| {
            let lit = picture(pose(random, on_plane), Some(laser), random.random())?;
            striped_picture::look(&lit, None, &exact.camera, (&BOARD, StripeOn::Sheet)).ok()
        })
        .collect();
    let fit = fit_pictures(&exact, &BOARD, &looked).ok()?.fit;
    let found = fit.plane()?;
    // Tilts are counted from the estimate toward its own axes.
    let tilt = LaserSheet::from_plane(found).axes().transpose() * (n - found.normal().into_inner());
    let error = [tilt.x, tilt.y, plane.offset() - found.offset()];
    Some((
        DVector::from_fn(3, |k, _| error[k]),
        DMatrix::from_fn(3, 3, |i, j| fit.covariance[(9 + i, 9 + j)]),
    ))
}
