//! Pictures of a board as somebody takes them to calibrate a sensor, with the poses chosen at random.

use super::scene::{BoardScene, Stripe, render};
use nalgebra::{Point3, UnitQuaternion, Vector2, Vector3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha12Rng;
use rayon::prelude::*;
use std::f64::consts::{FRAC_PI_2, TAU};
use std::fs;
use std::path::Path;
use trueline_dataset::sensor_setup::SensorSetup;
use trueline_dataset::sensor_toml::{CameraFile, format_camera};
use trueline_dataset::{Error, GrayImage, Problem, gray_png};
use trueline_geometry::{Plane, Pose, se3, so3};
use trueline_model::{BrownConrady, Camera};

/// Middle of the boards, m; the laser plane meets the optical axis there.
const MIDDLE_M: f64 = 0.36;

/// Tilts of the boards, radians.
const TILT: std::ops::Range<f64> = 0.25..0.6;

/// Pixels that are free around a board.
const MARGIN_PX: f64 = 8.0;

/// Poses tried before an error reports that the board does not fit into the picture.
const MOST_TRIES: usize = 20_000;

/// A board, and the sensor that looks at it.
#[derive(Clone, Debug)]
pub struct BoardPictures {
    /// The camera.
    pub camera: Camera,
    /// The laser plane in the camera frame.
    pub laser_plane_in_camera: Plane,
    /// Inner corners along x and y.
    pub corners: [usize; 2],
    /// Side of a square, m.
    pub square_m: f64,
}

impl BoardPictures {
    /// A camera of 640 × 480 pixels that sees a board well which is 20 cm wide, and a laser 65° from its axis.
    #[must_use]
    pub fn new(corners: [usize; 2], square_m: f64) -> Self {
        let camera = Camera {
            size: [640, 480],
            focal: Vector2::new(702.0, 700.0),
            centre: Vector2::new(324.0, 236.0),
            distortion: BrownConrady { k1: -0.15, k2: 0.05, ..BrownConrady::default() },
        };
        let slope = 65_f64.to_radians().tan();
        let laser_plane_in_camera = Plane::from_height(-0.03, -slope, MIDDLE_M)
            .unwrap_or_else(|| unreachable!("the coefficients are finite"));
        Self { camera, laser_plane_in_camera, corners, square_m }
    }

    /// `camera_from_board` of a board that is anywhere in the picture. `None` if none fits.
    fn anywhere(&self, random: &mut ChaCha12Rng) -> Option<Pose> {
        self.whole(random, &|random, depth_m| {
            Vector3::new(random.random_range(-0.35..0.35), random.random_range(-0.27..0.27), 1.0) * depth_m
        })
    }

    /// The same with its middle near the laser plane.
    fn on_the_stripe(&self, random: &mut ChaCha12Rng) -> Option<Pose> {
        let (n, offset) = (self.laser_plane_in_camera.normal(), self.laser_plane_in_camera.offset());
        self.whole(random, &|random, depth_m| {
            let x = random.random_range(-0.03..0.03);
            let beside = random.random_range(-1.0..1.0) * self.square_m;
            Vector3::new(x, (offset - n.x * x - n.z * depth_m) / n.y + beside, depth_m)
        })
    }

    /// A board at random that is wholly in the picture.
    fn whole(
        &self,
        random: &mut ChaCha12Rng,
        middle: &dyn Fn(&mut ChaCha12Rng, f64) -> Vector3<f64>,
    ) -> Option<Pose> {
        let last = self.middle() * 2.0;
        let edge = [self.square_m * 1.5, last[0] + 1.5 * self.square_m, last[1] + 1.5 * self.square_m];
        let outline = [(-edge[0], -edge[0]), (edge[1], -edge[0]), (-edge[0], edge[2]), (edge[1], edge[2])];
        (0..MOST_TRIES).find_map(|_| {
            let around = random.random_range(0.0..TAU);
            let tilt = Vector3::new(around.cos(), around.sin(), 0.0) * random.random_range(TILT);
            // People hold a board upright, or on its side.
            let on_its_side = random.random::<f64>() < 0.3;
            let spin = random.random_range(-0.3..0.3) + if on_its_side { FRAC_PI_2 } else { 0.0 };
            let rotation = so3::exp(&tilt) * UnitQuaternion::from_scaled_axis(Vector3::z() * spin);
            let depth_m = random.random_range(0.75 * MIDDLE_M..1.35 * MIDDLE_M);
            let pose = se3::from_parts(rotation, middle(random, depth_m) - rotation * self.middle());
            let inside = |&(x, y): &(f64, f64)| self.shows(&(pose * Point3::new(x, y, 0.0)).coords);
            outline.iter().all(inside).then_some(pose)
        })
    }

    /// The middle of the corners, in the board's frame, m.
    pub(super) fn middle(&self) -> Vector3<f64> {
        let [x, y] = self.corners.map(|count| (count as f64 - 1.0) * self.square_m * 0.5);
        Vector3::new(x, y, 0.0)
    }

    /// Whether a point in the camera frame is in the picture.
    fn shows(&self, point: &Vector3<f64>) -> bool {
        let free = |at: f64, size: u32| at > MARGIN_PX && at < f64::from(size) - MARGIN_PX;
        let pixel = self.camera.project(point);
        pixel.is_some_and(|p| free(p.x, self.camera.size[0]) && free(p.y, self.camera.size[1]))
    }

    pub(super) fn picture(&self, camera_from_board: Pose, is_laser_on: bool, seed: u64) -> GrayImage {
        let stripe = Stripe {
            laser_plane_in_camera: self.laser_plane_in_camera,
            brightness: 90.0,
            thickness_m: 0.4e-3,
        };
        let scene = BoardScene {
            camera: self.camera,
            camera_from_board,
            corners: self.corners,
            square_m: self.square_m,
            levels: [40.0, 150.0, 90.0],
            blur_px: 0.7,
            noise: 2.0,
            stripe: is_laser_on.then_some(stripe),
        };
        render(&scene, seed)
    }

    /// Writes `boards` (laser off, anywhere in the picture), `stripes` (laser on) and `without-laser` (the same poses, laser off), `count`
    /// pictures each, and `truth_sensor.toml`. `drawn` is called after each picture.
    ///
    /// # Errors
    /// A board that does not fit into the picture; files that cannot be written.
    pub(super) fn write(
        &self,
        folder: &Path,
        count: u32,
        seed: u64,
        drawn: &(dyn Fn() + Sync),
    ) -> Result<(), Error> {
        let mut random = ChaCha12Rng::seed_from_u64(seed);
        let too_large = || {
            let expected = "a board that fits into a picture of 640 x 480 px, some 100 to 200 mm wide";
            let found = format!("squares of {} mm", self.square_m * 1e3);
            Error::in_file(folder, Problem::Value { key: "--boards", expected, found })
        };
        let mut poses = |of: &dyn Fn(&mut ChaCha12Rng) -> Option<Pose>| {
            (0..count).map(|_| of(&mut random)).collect::<Option<Vec<Pose>>>().ok_or_else(too_large)
        };
        let anywhere = poses(&|random| self.anywhere(random))?;
        let on_the_stripe = poses(&|random| self.on_the_stripe(random))?;
        let sets = [
            ("boards", &anywhere, false),
            ("stripes", &on_the_stripe, true),
            ("without-laser", &on_the_stripe, false),
        ];
        for ((name, poses, is_laser_on), set) in sets.into_iter().zip(1..) {
            let folder = folder.join(name);
            fs::create_dir_all(&folder).map_err(|error| Error::in_file(&folder, Problem::Io(error)))?;
            poses.par_iter().enumerate().try_for_each(|(k, pose)| {
                let noise = seed.wrapping_mul(1_000_003).wrapping_add(set * 100_000 + k as u64);
                gray_png::write(
                    &folder.join(format!("{k:02}.png")),
                    &self.picture(*pose, is_laser_on, noise),
                )?;
                drawn();
                Ok::<(), Error>(())
            })?;
        }
        let file = folder.join("truth_sensor.toml");
        let truth = CameraFile {
            camera: self.camera,
            laser_plane_in_camera: Some(self.laser_plane_in_camera),
            setup: SensorSetup::default(),
        };
        fs::write(&file, format_camera(&truth)).map_err(|error| Error::in_file(&file, Problem::Io(error)))
    }
}
